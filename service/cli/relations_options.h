// SPDX-License-Identifier: Apache-2.0
// Options, questions and texts of relations and timelines.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/status.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's own
class App;
}

namespace prescene::service {

struct TimelineOptions {
  std::string first, second;
  std::vector<std::string> relations;
  friend bool operator==(const TimelineOptions&, const TimelineOptions&) = default;
};
/// --interval, --other and --relation.
void add_timeline_options(CLI::App& verb, TimelineOptions& options);
/// {"timeline": {...}}; the service, or belief::query_from_json, says what is wrong in it.
core::Result<nlohmann::ordered_json> timeline_question(const TimelineOptions& options);

/// {"relations": {...}} of an object ("" = all) and a reach: "X,Y,Z:RADIUS" or "NAME:RADIUS" ("" = none).
core::Result<nlohmann::ordered_json> relations_question(const std::string& object, const std::string& reach);

/// What the answers say, in sentences; `answer` as in the task of an answer.
std::string relations_text(const nlohmann::ordered_json& answer);
std::string timeline_text(const nlohmann::ordered_json& answer);

}  // namespace prescene::service
