// SPDX-License-Identifier: Apache-2.0
// What an explanation says, for a person.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace prescene::service {

/// Each with a head.
struct ExplanationTables {
  std::vector<std::vector<std::string>> events, places, frames;
};
/// `explained`: as to_json(Explained).
ExplanationTables explanation_tables(const nlohmann::ordered_json& explained);
/// "812 instances weighed, 640 simulated, in 1.2 s".
std::string explanation_work_text(const nlohmann::ordered_json& explained);
/// The paragraph, the tables and the remarks.
std::string explanation_text(const nlohmann::ordered_json& explained);

}  // namespace prescene::service
