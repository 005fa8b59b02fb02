// SPDX-License-Identifier: Apache-2.0
// JSON forms of the belief's values: poses as {"position": [x, y, z], "rotation": {"quaternion_wxyz": [w, x, y, z]}},
// enums as lower-case words, actions and outcomes with the keys of scene files, else names as in the structs. Reading
// is strict: unknown keys and wrong types fail with the path of the place.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/core/status.h"

namespace prescene::belief {

nlohmann::ordered_json to_json(const Pose& pose);
nlohmann::ordered_json to_json(const Twist& twist);
nlohmann::ordered_json to_json(const Action& action);
nlohmann::ordered_json to_json(const Outcome& outcome);
nlohmann::ordered_json to_json(const WorldState& state);
nlohmann::ordered_json to_json(const Timeline& timeline);
nlohmann::ordered_json to_json(const Trajectory& trajectory);
nlohmann::ordered_json to_json(const ObjectBelief& object);
/// [{"name", "mean", "standard_deviation", "low", "high"}]
nlohmann::ordered_json to_json(const std::vector<ParameterEstimate>& estimates);
nlohmann::ordered_json to_json(const std::vector<JointEstimate>& estimates);
nlohmann::ordered_json to_json(const std::vector<AlternativePose>& alternatives);
/// Without the scene (which a scene file holds).
nlohmann::ordered_json to_json(const Belief& belief);
nlohmann::ordered_json to_json(const Query& query);
nlohmann::ordered_json to_json(const Answer& answer);
/// {"error": "there is no object 'mug'", "code": "not_found"}: why something could not be done. The codes are the names
/// of core::StatusCode in lower case. `status` is not ok (checked).
nlohmann::ordered_json error_to_json(const core::Status& status);
/// The error of an answer, or of anything that error_to_json wrote; ok where it has no "error". Without a code that is
/// known it is kInvalidInput.
core::Status error_from_json(const nlohmann::ordered_json& document);

/// The text of a document; all JSON that is written goes through here. In one line, or with so many spaces a level. It
/// never fails on what a document holds: bytes that are not UTF-8 become U+FFFD, numbers that are not finite null.
std::string json_text(const nlohmann::ordered_json& document, int indent = -1);

/// The document, or where it stops being JSON. What is nested deeper than 64 lists and objects is refused too: such a
/// value could be neither copied nor printed without running out of stack. So are objects of more than 1024 keys, each
/// of which is compared with all before it. For texts from outside.
core::Result<nlohmann::ordered_json> parse_json(std::string_view text, std::size_t max_bytes = 16u << 20);
/// {"id": "...", "where": {...}} or "predict", "stability", "view", "achieve", "relations", "timeline".
core::Result<Query> query_from_json(std::string_view text);
/// {"position": [x, y, z], "rotation": {"quaternion_wxyz": [w, x, y, z]}}, or another form of rotation of scene files.
/// The rotation is normalised; zero or not finite is an error.
core::Result<Pose> pose_from_json(const nlohmann::ordered_json& value);
core::Result<Action> action_from_json(const nlohmann::ordered_json& value);
core::Result<Outcome> outcome_from_json(const nlohmann::ordered_json& value);
/// A belief written by to_json, given its scene.
core::Result<Belief> belief_from_json(const nlohmann::ordered_json& value, std::shared_ptr<const Scene> scene);

}  // namespace prescene::belief
