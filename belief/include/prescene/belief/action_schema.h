// SPDX-License-Identifier: Apache-2.0
// Actions as schemas: which numbers each takes, in which unit, between which bounds. What a question may leave free.
//
//   PRESCENE_TRY(const ActionSchema* schema, find_action_schema("place"));
//   PRESCENE_TRY(const ActionParameter* yaw, find_action_parameter(*schema, "yaw"));   // or "yaw_deg"
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::belief {

/// A number that an action takes.
struct ActionParameter {
  std::string name;  ///< With "_deg" at its end where it is in degrees; it may be left out where it is named.
  std::string unit;  ///< "m", "deg", "s", "m/s", "N", "N m" or "N s".
  double least = 0.0, most = 0.0;  ///< What makes sense at all.
  /// Where it is not given; nothing: the scene gives it.
  std::optional<double> value;
  /// Where it is searched and no range is given; nothing: the scene gives it.
  std::optional<double> low, high;
  std::string meaning;

  bool is_angle() const { return unit == "deg"; }
};

/// What one might think to search, and why that can't be.
struct NotSearched {
  std::string name;
  std::string reason;
};

struct ActionSchema {
  std::string name;
  std::string meaning;
  bool of_held = false;  ///< The object has to be held when it begins.
  std::vector<ActionParameter> parameters;
  /// It stands in for the scene's own action of this kind; what is neither free nor given is as there.
  bool of_scene = false;
  std::vector<NotSearched> not_searched = {};
};

/// "place", "push", "bump", "release", "tilt", "pour", "insert", "grasp", "pull", "move_joint" and "transport".
const std::vector<ActionSchema>& action_schemas();
/// kNotFound with the nearest name.
core::Result<const ActionSchema*> find_action_schema(const std::string& name);
/// kNotFound with the nearest name; kInvalidInput with the reason of what is not searched.
core::Result<const ActionParameter*> find_action_parameter(const ActionSchema& schema, const std::string& name);

}  // namespace prescene::belief
