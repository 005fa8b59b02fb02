// SPDX-License-Identifier: Apache-2.0
// The section `joints` of scene files: what it makes, and what it refuses where.
#include <gmock/gmock.h>

#include "prescene/geometry/angles.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces::joints_file_test {
namespace {

using geometry::Vector3d;
using testing::AllOf;
using testing::HasSubstr;

/// Lines 1 to 16; the joint's keys begin on line 17.
std::string text_of(const std::string& joint, const std::string& more = "") {
  return R"(models:
  box: {box: [0.3, 0.3, 0.1], mass: 1}
supports:
  cabinet:
    box: [0.2, 0.5, 0.5]
    pose: {position: [1, 0, 0.25]}
robot:
  hook: {sphere: 0.01, pose: {position: [2, 0, 1]}}
objects:
  drawer:
    model: box
    pose: {position: [1.05, 0, 0.25]}
  lid: {model: box, pose: {position: [1.05, 0, 0.35]}}
joints:
  slide:
)" + joint +
         more;
}
const char* const kSlide = "    {type: slider, parent: cabinet, child: drawer, axis: x, min: 0, max: 0.3";

struct Read {
  std::string errors;
  std::string warnings;
};
Read read(const std::string& text) {
  FileReport report;
  Read found;
  found.errors = parse_scene(text, "s.yaml", {}, &report).status().message();
  for (const Problem& warning : report.warnings) found.warnings += warning.text() + "\n";
  return found;
}
Read slide_with(const std::string& keys) { return read(text_of(kSlide + (", " + keys) + "}\n")); }

TEST(JointsFile, AJointStartsWhereTheObjectsDo) {
  const auto scene = parse_scene(
      text_of(kSlide + std::string(", start: 0.05, friction: {normal: [2, 0.5]}, damping: 1}\n")), "s.yaml");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const belief::Joint& joint = scene->joints.at(0);
  EXPECT_EQ(joint.name, "slide");
  EXPECT_EQ(joint.high, 0.3);
  EXPECT_EQ(belief::lowest(joint.friction), 0.0);  // cut by itself
  EXPECT_NEAR(belief::joint_states(*scene, belief::mean_start(*scene)).at(0).position, 0.05, 1e-12);
  EXPECT_LT((joint.X_PC0.translation - Vector3d(0.0, 0.0, 0.0)).norm(), 1e-12);
}

TEST(JointsFile, AChildMayStartInsideTheSolidThatItHangsOn) {
  std::string inside = text_of(kSlide + std::string(", start: 0.05}\n"));
  inside.replace(inside.find("[0.2, 0.5, 0.5]"), 15, "[0.6, 0.5, 0.2]");
  EXPECT_EQ(read(inside).errors, "");
}

TEST(JointsFile, AHingeIsInDegrees) {
  const auto scene = parse_scene(
      text_of("    {type: hinge, parent: drawer, child: lid, axis: [0, 2, 0], anchor: [-0.15, 0, 0.1], min_deg: -90, "
              "max_deg: 0}\n",
              "outcomes:\n  opens: {joint: {name: slide, max_deg: -45}}\n"),
      "s.yaml");
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->joints.at(0).low, geometry::kDegree * -90.0);
  EXPECT_EQ(scene->joints.at(0).axis_P, Vector3d::UnitY());
  EXPECT_EQ(scene->outcomes.at(0).object, "lid");
}

TEST(JointsFile, AnAxisHasAnyLength) {
  for (const char* axis : {"[1e-200, 0, 0]", "[1e300, 0, 0]", "[7, 0, 0]"}) {
    const auto scene = parse_scene(
        text_of(std::string("    {type: slider, parent: cabinet, child: drawer, axis: ") + axis + ", start: 0.05}\n"),
        "s.yaml");
    ASSERT_TRUE(scene.ok()) << axis << ": " << scene.status().message();
    EXPECT_EQ(scene->joints.at(0).axis_P, Vector3d::UnitX()) << axis;
  }
  const auto across =
      parse_scene(text_of("    {type: slider, parent: cabinet, child: drawer, axis: [1e300, 1e300, 0]}\n"), "s.yaml");
  ASSERT_TRUE(across.ok()) << across.status().message();
  EXPECT_LT((across->joints.at(0).axis_P - Vector3d(1, 1, 0).normalized()).norm(), 1e-15);
}

/// Its position is told within half a turn: what lies beyond never comes.
TEST(JointsFile, AHingeWithoutLimitsHasPositionsWithinHalfATurn) {
  const std::string hinge = "    {type: hinge, parent: drawer, child: lid, axis: y, anchor: [-0.15, 0, 0.1]";
  EXPECT_THAT(read(text_of(hinge + ", start_deg: 200}\n")).errors,
              AllOf(HasSubstr("s.yaml:16: joints.slide.start_deg"), HasSubstr("give -160, or min_deg and max_deg")));
  EXPECT_EQ(read(text_of(hinge + ", start_deg: 200, min_deg: 0, max_deg: 300}\n")).errors, "");
  EXPECT_THAT(
      read(text_of(hinge + "}\n", "outcomes:\n  o: {joint: {name: slide, min_deg: 200, max_deg: 300}}\n")).errors,
      AllOf(HasSubstr("s.yaml:18: outcomes.o"), HasSubstr("between -180 and 180 degrees: give ends within these")));
}

TEST(JointsFile, WhatCanNotBeIsRefusedWithItsLine) {
  const std::string at = "s.yaml:16: joints.slide.";
  EXPECT_THAT(slide_with("color: red").errors, HasSubstr(at + "color: unknown key"));
  EXPECT_THAT(slide_with("min_deg: 3").errors, HasSubstr("did you mean 'min'"));
  EXPECT_THAT(slide_with("friction: -2").errors, AllOf(HasSubstr(at + "friction"), HasSubstr("N for a slider")));
  EXPECT_THAT(slide_with("start: 1, child_pose: {position: [0, 0, 0]}").errors, HasSubstr(at + "start"));
  EXPECT_THAT(slide_with("start: 0.5").errors,
              AllOf(HasSubstr("the joint starts at 0.5 m"), HasSubstr("widen the limits")));
  EXPECT_THAT(slide_with("child_pose: {position: [0, 0.01, 0]}").errors,
              AllOf(HasSubstr("s.yaml:12: objects.drawer.pose"), HasSubstr("10 mm"),
                    HasSubstr("move it to [1.05, 0.01, 0.25]")));
  const auto with = [](std::string keys) { return read(text_of("    {" + keys + "}\n")).errors; };
  EXPECT_THAT(with("type: slider, parent: cabinett, child: drawer, axis: x"), HasSubstr("did you mean 'cabinet'"));
  EXPECT_THAT(with("type: slider, parent: cabinet, child: drawr, axis: x"), HasSubstr("did you mean 'drawer'"));
  EXPECT_THAT(with("type: slidr, parent: cabinet, child: drawer, axis: x"), HasSubstr("slider"));
  EXPECT_THAT(with("type: slider, parent: world, child: cabinet, axis: x"), HasSubstr("'cabinet' is fixed"));
  EXPECT_THAT(with("type: slider, parent: cabinet, child: world, axis: x"), HasSubstr("'world' is fixed"));
  EXPECT_THAT(with("type: slider, parent: hook, child: drawer, axis: x"), HasSubstr("is a robot body"));
  EXPECT_THAT(with("type: slider, parent: drawer, child: drawer, axis: x"), HasSubstr("are the same"));
  EXPECT_THAT(with("type: slider, parent: cabinet, child: drawer, axis: [0, 0, 0]"), HasSubstr("joints.slide.axis"));
  EXPECT_THAT(with("type: slider, parent: cabinet, child: drawer, axis: x, min: 1, max: 0"),
              HasSubstr("exchange them"));
  EXPECT_THAT(with("type: hinge, parent: cabinet, child: drawer, axis: x"), HasSubstr("'anchor'"));
  EXPECT_THAT(with("type: hinge, parent: cabinet, child: drawer, axis: x, anchor: [0, 0, 0], max_deg: 10"),
              HasSubstr("both limits or none"));
  EXPECT_THAT(
      read(text_of(kSlide + std::string("}\n"), "  again: {type: slider, parent: world, child: drawer, axis: y}\n"))
          .errors,
      AllOf(HasSubstr("s.yaml:17: joints.again.child"), HasSubstr("close a loop")));
  EXPECT_THAT(read(text_of("    {type: slider, parent: lid, child: drawer, axis: x}\n",
                           "  again: {type: slider, parent: drawer, child: lid, axis: y}\n"))
                  .errors,
              AllOf(HasSubstr("s.yaml:16: joints.slide: the joints make a loop"), HasSubstr("leave one of them out"),
                    testing::Not(HasSubstr("correct it"))));
  EXPECT_THAT(read(text_of(kSlide + std::string("}\n"), "outcomes:\n  o: {joint: {name: slid, min: 0.1}}\n")).errors,
              HasSubstr("did you mean 'slide'"));
  EXPECT_THAT(
      read(text_of(kSlide + std::string("}\n"), "outcomes:\n  o: {object: drawer, joint: {name: slide, min: 0.4}}\n"))
          .errors,
      AllOf(HasSubstr("s.yaml:18: outcomes.o"), HasSubstr("never gets there")));
}

TEST(JointsFile, AJointIsMovedToAPositionOfItsOwnUnitWithinItsLimits) {
  const auto moved = [](const std::string& keys) {
    return read(text_of(kSlide + std::string("}\n"), "actions:\n  - {time: 0, move_joint: {" + keys + "}}\n"));
  };
  EXPECT_EQ(moved("joint: slide, to: 0.2, force: 10, handle: [0.1, 0, 0]").errors, "");
  EXPECT_THAT(moved("joint: slid, to: 0.2").errors, HasSubstr("did you mean 'slide'"));
  EXPECT_THAT(moved("joint: slide").errors, HasSubstr("give the position of the slider in m"));
  EXPECT_THAT(moved("joint: slide, to_deg: 20").errors, HasSubstr("to_deg"));
  EXPECT_THAT(moved("joint: slide, to: 0.4").errors, HasSubstr("give a position within its limits"));
  const auto turned = [](const std::string& keys) {
    return read(text_of(
        "    {type: hinge, parent: cabinet, child: drawer, axis: z, anchor: [0, 0, 0], min_deg: 0, max_deg: 90}\n",
        "actions:\n  - {time: 0, move_joint: {joint: slide, " + keys + "}}\n"));
  };
  EXPECT_THAT(turned("to: 0.2").errors, HasSubstr("give the position of the hinge in degrees"));
  EXPECT_THAT(turned("to_deg: 120").errors, HasSubstr("within its limits"));
  EXPECT_EQ(turned("to_deg: 20, handle: [0.1, 0, 0]").errors, "");
  EXPECT_THAT(turned("to_deg: 20, handle: [-0.05, 0, 0.1]").errors,
              AllOf(HasSubstr("s.yaml:18: actions"), HasSubstr("on the axis of the joint 'slide'"),
                    HasSubstr("give another point")));
}

TEST(JointsFile, WarnsOfStartsThatSpreadAcrossTheJoint) {
  const auto spread = [](const char* position) {
    std::string text = text_of(kSlide + std::string("}\n"));
    const std::string from = "pose: {position: [1.05, 0, 0.25]}";
    return read(text.replace(text.find(from), from.size(), std::string("pose: {position: ") + position + "}"));
  };
  EXPECT_EQ(spread("[{uniform: [1.05, 1.2]}, 0, 0.25]").warnings, "");
  EXPECT_THAT(spread("[1.05, {normal: [0, 0.02]}, 0.25]").warnings,
              HasSubstr("across what the joint 'slide' leaves free"));
}

}  // namespace
}  // namespace prescene::interfaces::joints_file_test
