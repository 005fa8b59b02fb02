// SPDX-License-Identifier: Apache-2.0
#include "final_states.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

std::string position_text(const geometry::Pose& X_WO) {
  const geometry::Vector3d& p = X_WO.translation;
  return fixed_text(p.x(), 3) + " " + fixed_text(p.y(), 3) + " " + fixed_text(p.z(), 3);
}

/// As scene files' euler_deg: turned about the fixed x, then y, then z axis.
std::string euler_text(const geometry::Pose& X_WO) {
  const geometry::Matrix3d R = X_WO.rotation.toRotationMatrix();
  const double angles[] = {std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
                           std::atan2(R(1, 0), R(0, 0))};
  std::string text;
  for (const double angle : angles) text += (text.empty() ? "" : " ") + fixed_text(angle * 180 / std::numbers::pi, 1);
  return text;
}

}  // namespace

void FinalStates::add(const BeliefSummary& summary) {
  for (const ObjectSummary& object : summary.objects) {
    auto known =
        std::find_if(objects_.begin(), objects_.end(), [&](const Object& o) { return o.last.name == object.name; });
    if (known == objects_.end()) known = objects_.insert(known, Object{});
    known->last = object;
    ++known->frames[object.state];
  }
}

std::string FinalStates::text() const {
  if (objects_.empty()) return "";
  std::vector<std::vector<std::string>> rows = {
      {"object", "state", "confidence", "position, m", "euler, deg", "frames"}};
  for (const Object& object : objects_) {
    const ObjectSummary& last = object.last;
    const bool lost = last.state == belief::TrackState::kLost;
    std::string frames;
    for (const auto& [state, count] : object.frames) {
      frames += (frames.empty() ? "" : ", ") + std::to_string(count) + " " + belief::to_string(state);
    }
    rows.push_back({last.name, belief::to_string(last.state), fixed_text(last.confidence, 2),
                    lost ? "-" : position_text(last.X_WO), lost ? "-" : euler_text(last.X_WO), frames});
  }
  return "\nObjects in the last frame\n" + table(rows);
}

nlohmann::ordered_json FinalStates::json() const {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Object& object : objects_) {
    nlohmann::ordered_json frames = nlohmann::ordered_json::object();
    for (const auto& [state, count] : object.frames) frames[belief::to_string(state)] = count;
    json.push_back({{"name", object.last.name},
                    {"state", belief::to_string(object.last.state)},
                    {"confidence", object.last.confidence},
                    {"pose", belief::to_json(object.last.X_WO)},
                    {"frames", frames}});
  }
  return json;
}

}  // namespace prescene::service
