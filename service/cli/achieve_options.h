// SPDX-License-Identifier: Apache-2.0
// The options of the command line that make a question about what brings an outcome about: of `achieve` and of `ask`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "verb.h"

namespace prescene::service {

struct AchieveOptions {
  std::string outcome, action = "place", object, support;
  std::vector<std::string> free, fixed;  ///< "position,yaw=0:90", "height=0.01,roll=5"
  std::optional<double> position_error, rotation_error, delay, delay_error, lateral_error;
  std::optional<double> probability, confidence, max_seconds, duration;
  std::optional<int> max_instances;
  bool first_only = false;
  friend bool operator==(const AchieveOptions&, const AchieveOptions&) = default;
};

/// All but the outcome.
void add_achieve_options(CLI::App& verb, AchieveOptions& options);
/// The question as JSON, as it goes over the bus; without an id. kInvalidInput names the option.
core::Result<nlohmann::ordered_json> achieve_question(const AchieveOptions& options);

/// An answer for a person; `answer` is the document of the task.
std::string achieve_text(const nlohmann::ordered_json& answer);

}  // namespace prescene::service
