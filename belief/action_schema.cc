// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/action_schema.h"

#include "prescene/core/spelling.h"

namespace prescene::belief {
namespace {

std::vector<ActionSchema> all_schemas() {
  return {
      {"place",
       "the held object is brought down to a place above a support and let go there",
       true,
       {{"x", "m", -20.0, 20.0, {}, {}, {}, "where the origin of the object's frame is let go, in the world"},
        {"y", "m", -20.0, 20.0, {}, {}, {}, "the same along y"},
        {"height", "m", -2.0, 2.0, 0.005, 0.0, 0.1,
         "of the object's lowest point above the support: above the floor of its hollow, else above its top"},
        {"yaw_deg", "deg", -360.0, 360.0, 0.0, -180.0, 180.0, "turn about the vertical, from how it is held"},
        {"pitch_deg", "deg", -180.0, 180.0, 0.0, -15.0, 15.0, "turn about the world's y axis, before the yaw"},
        {"roll_deg", "deg", -180.0, 180.0, 0.0, -15.0, 15.0, "turn about the world's x axis, before the pitch"},
        {"approach", "m", 0.0, 2.0, 0.1, 0.02, 0.3, "way straight down on which nothing must be hit"}}},
      {"push",
       "a finger tip moves along a straight level line past the object and pushes it",
       false,
       {{"direction_deg", "deg", -360.0, 360.0, 0.0, -180.0, 180.0,
         "of the motion, from the world's x axis to its y axis"},
        {"offset", "m", -1.0, 1.0, 0.0, -0.05, 0.05, "of the line to the left of the origin of the object's frame"},
        {"height", "m", 0.0, 2.0, {}, {}, {}, "of the finger tip above the object's lowest point"},
        {"distance", "m", 0.001, 5.0, 0.1, 0.02, 0.3, "from where the finger tip meets the object at the earliest"},
        {"speed", "m/s", 0.001, 5.0, 0.1, 0.02, 0.5, "of the finger tip"},
        {"time", "s", 0.0, 3600.0, 0.0, 0.0, {}, "when it begins"}}},
      {"bump",
       "the object gets a level blow that is over at once",
       false,
       {{"direction_deg", "deg", -360.0, 360.0, 0.0, -180.0, 180.0,
         "of the blow, from the world's x axis to its y axis"},
        {"impulse", "N s", 1e-6, 1e3, {}, {}, {}, "how hard: mass times the change of velocity"},
        {"offset", "m", -1.0, 1.0, 0.0, -0.05, 0.05, "of its line to the left of the origin of the object's frame"},
        {"height", "m", 0.0, 2.0, {}, {}, {}, "of its line above the object's lowest point"},
        {"time", "s", 0.0, 3600.0, 0.0, 0.0, {}, "when it comes"}}},
      {"release",
       "the hand that holds the object opens, wherever its motion has brought it by then",
       true,
       {{"time", "s", 0.0, 3600.0, {}, 0.0, {}, "when the hand is commanded to open"}}},
  };
}

std::string meant(const std::string& name, const std::vector<std::string>& known, const std::string& what) {
  const std::string near = core::did_you_mean(name, known);
  return near + (near.empty() ? "" : " ") + what + " " + core::comma_list(known);
}

}  // namespace

const std::vector<ActionSchema>& action_schemas() {
  static const std::vector<ActionSchema> kSchemas = all_schemas();
  return kSchemas;
}

core::Result<const ActionSchema*> find_action_schema(const std::string& name) {
  std::vector<std::string> names;
  for (const ActionSchema& schema : action_schemas()) {
    if (schema.name == name) return &schema;
    names.push_back(schema.name);
  }
  return core::not_found("there is no action '" + name + "': " + meant(name, names, "the actions are"));
}

core::Result<const ActionParameter*> find_action_parameter(const ActionSchema& schema, const std::string& name) {
  std::vector<std::string> names;
  for (const ActionParameter& parameter : schema.parameters) {
    if (parameter.name == name || parameter.name == name + "_deg") return &parameter;
    names.push_back(parameter.name);
    if (parameter.name == "y") names.push_back("position");  // stands for both in questions
  }
  return core::not_found("'" + schema.name + "' has no parameter '" + name +
                         "': " + meant(name, names, "its parameters are"));
}

}  // namespace prescene::belief
