// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/action_schema.h"

#include <utility>

#include "prescene/core/spelling.h"

namespace prescene::belief {
namespace {

std::vector<ActionSchema> schemas_on_their_own() {
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

ActionParameter when_it_begins() { return {"time", "s", 0.0, 3600.0, {}, 0.0, {}, "when it begins"}; }
ActionParameter how_long() { return {"duration", "s", 0.01, 3600.0, {}, {}, {}, "how long the motion takes"}; }
ActionParameter turn_of(const char* what) { return {"angle_deg", "deg", -360.0, 360.0, {}, {}, {}, what}; }
ActionParameter level_axis() {
  return {"axis_deg", "deg",
          -360.0,     360.0,
          {},         {},
          {},         "direction of the level axis that it turns about, from the world's x axis to its y axis"};
}
ActionParameter force_of(const char* name, const char* what) { return {name, "N", 1e-3, 1e5, {}, {}, {}, what}; }

/// Those that stand in for the scene's own.
std::vector<ActionSchema> schemas_of_scene() {
  return {
      {"tilt",
       "the held object is turned about a level axis through its pivot, and held so",
       true,
       {turn_of("how far it is turned"), level_axis(), how_long(), when_it_begins()},
       true,
       {{"pivot", "the pivot is a point of three coordinates: give it in the scene's own tilt"}}},
      {"pour",
       "the held container is turned about a level axis, so that its content leaves it",
       true,
       {turn_of("how far it is turned"),
        level_axis(),
        {"height", "m", -20.0, 20.0, {}, {}, {}, "z in the world of the origin of the container's frame meanwhile"},
        how_long(),
        when_it_begins()},
       true,
       {}},
      {"insert",
       "the held object is moved along a line into something by a hand that gives way",
       true,
       {{"x", "m", -20.0, 20.0, {}, {}, {}, "of the origin of the object's frame in the world when it begins"},
        {"y", "m", -20.0, 20.0, {}, {}, {}, "the same along y"},
        {"yaw_deg", "deg", -360.0, 360.0, 0.0, -10.0, 10.0, "turn about the vertical, from how it would be held then"},
        force_of("force", "with no more than which the hand keeps the object on its line"),
        {"torque", "N m", 1e-4, 1e4, {}, {}, {}, "with no more than which it keeps its attitude"},
        {"distance", "m", 0.001, 5.0, {}, {}, {}, "length of the line"},
        how_long(),
        when_it_begins()},
       true,
       {{"axis", "the line's direction has three coordinates: give it in the scene's own insert"}}},
      {"grasp",
       "two fingers of a hand press on the object, which moves with the hand as far as they hold it",
       false,
       {force_of("grip_force", "of each finger"),
        {"pad_length", "m", 0.001, 1.0, {}, {}, {}, "once it has slid so far, the object is out of the fingers"},
        when_it_begins()},
       true,
       {{"along",
         "the place along the object has no part in how a grip holds: friction does not depend on it, and the pads "
         "keep the object's attitude. Search grip_force, and give the hand's place in the scene"},
        {"place",
         "where the fingers press has no part in how a grip holds: friction does not depend on it, and the pads keep "
         "the object's attitude. Search grip_force, and give the hand's place in the scene"},
        {"finger_friction", "it is a property of the fingers, not a choice: give it in the scene's own grasp"},
        {"hand", "a hand is not a number: give it in the scene's own grasp"}}},
      {"pull",
       "a hand that is hooked in at a point of the object draws it along a line",
       false,
       {force_of("force", "with no more than which the hand draws"),
        {"distance", "m", 0.001, 5.0, {}, {}, {}, "way of the hand"},
        {"direction_deg", "deg", -360.0, 360.0, {}, {}, {}, "of a level way, from the world's x axis to its y axis"},
        how_long(),
        when_it_begins()},
       true,
       {{"point", "the point has three coordinates: give it in the scene's own pull"}}},
      {"move_joint",
       "a hand at the handle of what hangs on a joint opens or closes it",
       false,
       {{"to", "m", -100.0, 100.0, {}, {}, {}, "position of a slider that it is brought to"},
        {"to_deg", "deg", -36000.0, 36000.0, {}, {}, {}, "position of a hinge that it is brought to"},
        force_of("force", "with no more than which the hand moves the handle"),
        how_long(),
        when_it_begins()},
       true,
       {{"handle", "the handle is a point of three coordinates: give it in the scene's own move_joint"},
        {"distance",
         "how far a joint is moved is its position at the end: name 'to' of a slider, 'to_deg' of a hinge"}}},
      {"transport",
       "the held object and its hand are carried along a straight line",
       true,
       {{"speed", "m/s", 0.001, 20.0, {}, {}, {}, "mean of the way from where the object is to where it is carried"},
        when_it_begins()},
       true,
       {{"pose", "where it is carried to is not searched: search a place, or the start of an insert"},
        {"duration", "it follows from the speed: name 'speed'"}}},
  };
}

std::string meant(const std::string& name, const std::vector<std::string>& known, const std::string& what) {
  const std::string near = core::did_you_mean(name, known);
  return near + (near.empty() ? "" : " ") + what + " " + core::comma_list(known);
}

}  // namespace

const std::vector<ActionSchema>& action_schemas() {
  static const std::vector<ActionSchema> kSchemas = [] {
    std::vector<ActionSchema> schemas = schemas_on_their_own();
    for (ActionSchema& schema : schemas_of_scene()) schemas.push_back(std::move(schema));
    return schemas;
  }();
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
  for (const NotSearched& other : schema.not_searched)
    if (name == other.name)
      return core::invalid_input("'" + name + "' of '" + schema.name + "' can't be searched: " + other.reason);
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
