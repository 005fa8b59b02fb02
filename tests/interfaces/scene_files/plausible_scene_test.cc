// SPDX-License-Identifier: Apache-2.0
// What a scene file says that cannot be, or hardly is meant.
#include <gmock/gmock.h>

#include <cmath>

#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

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

// A cube of 0.1 m and 0.5 kg, whose unit inertia is 0.00167 m^2 about each axis.
Read cube(const std::string& more, const std::string& position = "[0, 0, 0.05]") {
  return read("models:\n  m:\n    box: [0.1, 0.1, 0.1]\n    mass: 0.5\n    " + more +
              "\nsupports:\n  table: {ground: {size: 4}}\nobjects:\n  o:\n    model: m\n    pose: {position: " +
              position + "}\n");
}

TEST(PlausibleScene, CentresOfMassAreInTheShape) {
  EXPECT_THAT(cube("center_of_mass: [0, 0, -10]").errors,
              AllOf(HasSubstr("s.yaml:5: models.m.center_of_mass: the centre of mass lies 9.95 m outside of the shape"),
                    HasSubstr("millimetres? then write [0, 0, -0.01]")));
  EXPECT_THAT(cube("center_of_mass: [0, {normal: [-3, 0.1]}, 0]").errors,
              HasSubstr("millimetres? then write [0, -0.003, 0]; centimetres? then write [0, -0.03, 0]"));
  // Outside, but it may be that the shape stands for a part only.
  for (const char* near : {"[0, 0, -0.06]", "[0.1, 0, 0]", "[0, -0.2, 0]"}) {
    const Read found = cube(std::string("center_of_mass: ") + near);
    EXPECT_EQ(found.errors, "") << near;
    EXPECT_THAT(found.warnings, HasSubstr("outside of the shape")) << near;
  }
  for (const char* in : {"[0, 0, 0]", "[0.05, -0.05, 0.05]", "[0, 0, {normal: [0.01, 0.02]}]"}) {
    const Read found = cube(std::string("center_of_mass: ") + in);
    EXPECT_EQ(found.errors + found.warnings, "") << in;
  }
}

TEST(PlausibleScene, AnObjectIsNamedUnlessOthersAreLookedFor) {
  const std::string table = "supports:\n  table: {ground: {size: 4}}\n";
  // No object is no object, however it is written.
  for (const char* none : {"", "objects: {}\n"}) {
    const Read found = read(table + none);
    EXPECT_EQ(found.errors, "") << none;
    EXPECT_THAT(found.warnings, HasSubstr("the scene names no object")) << none;
    const Read looks = read(table + none + "new_objects: true\n");
    EXPECT_EQ(looks.errors + looks.warnings, "") << none;
  }
  // A list of none is still no map.
  EXPECT_THAT(read(table + "objects: []\n").errors, HasSubstr("give a map of names"));
}

TEST(PlausibleScene, InertiasAreThoseOfABodyOfThatSizeAndMass) {
  for (const char* large : {"[1000, 1000, 1000]", "[1, 1, 1]", "[0.05, 0.05, 0.05]"})
    EXPECT_THAT(cube(std::string("unit_inertia: ") + large).errors,
                AllOf(HasSubstr("s.yaml:5: models.m.unit_inertia"), HasSubstr("more than the shape can have")))
        << large;
  for (const char* small : {"[1e-12, 1e-12, 1e-12]", "[1e-300, 1e-300, 1e-300]", "[1e-300, 0.0016, 0.0016]"})
    EXPECT_THAT(cube(std::string("unit_inertia: ") + small).errors, HasSubstr("less than any body of this mass"))
        << small;
  EXPECT_THAT(cube("unit_inertia: [1600, 1700, 1600]").errors, HasSubstr("mm^2? then write [0.0016, 0.0017, 0.0016]"));
  EXPECT_THAT(cube("inertia: [800, 800, 800]").errors, HasSubstr("kg mm^2? then write [0.0008, 0.0008, 0.0008]"));
  EXPECT_THAT(cube("inertia: [8000, 8000, 8000]").errors, HasSubstr("g cm^2? then write [0.0008, 0.0008, 0.0008]"));
  // A ball of lead in a light box, and a cube's frame: odd and not odd.
  EXPECT_THAT(cube("unit_inertia: [6e-5, 6e-5, 6e-5]").warnings, HasSubstr("far from that of the shape"));
  EXPECT_EQ(cube("unit_inertia: [6e-5, 6e-5, 6e-5]").errors, "");
  for (const char* right : {"unit_inertia: [0.0017, 0.0016, 0.0017]", "unit_inertia: [0.004, 0.004, 0.004]",
                            "inertia: [0.0008, 0.0008, 0.0008]", "center_of_mass: [0, 0, 0.03]"}) {
    const Read found = cube(right);
    EXPECT_EQ(found.errors + found.warnings, "") << right;
  }
}

TEST(PlausibleScene, ObjectsStartInTheWorld) {
  EXPECT_THAT(cube("friction: 0.4", "[300, 20, 50]").errors,
              AllOf(HasSubstr("s.yaml:11: objects.o.pose.position: it starts 304.795 m from the world's origin"),
                    HasSubstr("ends at 20 m"), HasSubstr("millimetres? then write [0.3, 0.02, 0.05]")));
  EXPECT_THAT(cube("friction: 0.4", "[0, 20.1, 0.05]").errors, HasSubstr("objects.o.pose"));
  EXPECT_EQ(cube("friction: 0.4", "[0, 19, 0.05]").errors, "");
}

const char* const kTwo =
    "models:\n  light: {box: [0.1, 0.1, 0.1], mass: 0.1}\n  heavy: {box: [0.1, 0.1, 0.1], mass: %}\n"
    "supports:\n  table: {ground: {size: 4}}\nobjects:\n  a: {model: light, pose: {position: [0, 0, 0.05]}}\n"
    "  b: {model: heavy, pose: {position: [0, 0, 0.15]}}\n";
std::string two(const std::string& mass) {
  std::string text = kTwo;
  return text.replace(text.find('%'), 1, mass);
}

TEST(PlausibleScene, WarnsOfMassesThatTheSolverCannotStack) {
  const Read found = read(two("20"));
  EXPECT_EQ(found.errors, "");
  EXPECT_THAT(found.warnings, AllOf(HasSubstr("s.yaml:8: objects.b: it has more than 100 times the mass of 'a'"),
                                    HasSubstr("20 and 0.1 kg")));
  EXPECT_EQ(read(two("10")).warnings, "");
}

TEST(PlausibleScene, WarnsOfSizesThatOneSimulationDoesNotFit) {
  using Vector3d = geometry::Vector3d;
  // All of water.
  const auto beside = [](double radius, const Vector3d& edges) {
    const auto number = [](double value) { return core::rounded_text(value); };
    return read(
        "models:\n  small: {sphere: " + number(radius) + ", mass: " + number(4189.0 * std::pow(radius, 3)) +
        "}\n  large: {box: [" + number(edges.x()) + ", " + number(edges.y()) + ", " + number(edges.z()) +
        "], mass: " + number(1000.0 * edges.prod()) + "}\n" +
        "supports:\n  table: {ground: {size: 4}}\nobjects:\n  a: {model: small, pose: {position: [0, 0, 1]}}\n" +
        "  b: {model: large, pose: {position: [9, 0, 6]}}\n");
  };
  // By the volume of its box, a plank is no larger than a cube.
  for (const auto& edges : {Vector3d(2.1, 2.1, 2.1), Vector3d(10, 10, 0.1)}) {
    const Read found = beside(0.001, edges);
    EXPECT_EQ(found.errors, "") << edges.transpose();
    EXPECT_THAT(found.warnings, AllOf(HasSubstr("s.yaml:8: objects.b: it is more than 1000 times as large as 'a'"),
                                      HasSubstr("check the units of both")))
        << edges.transpose();
  }
  EXPECT_THAT(beside(0.001, Vector3d(2.1, 2.1, 2.1)).warnings, HasSubstr(", 2.1 and 0.002 m"));
  for (const auto& edges : {Vector3d(1.9, 1.9, 1.9), Vector3d(10, 10, 0.05)})
    EXPECT_THAT(beside(0.001, edges).warnings, Not(HasSubstr("times as large"))) << edges.transpose();
}

TEST(PlausibleScene, NothingTouchesOrRestsOnItself) {
  for (const char* condition : {"resting_on", "touched"}) {
    const std::string key(condition);
    EXPECT_THAT(read(two("1") + "outcomes:\n  x: {object: b, " + key + ": b}\n").errors,
                AllOf(HasSubstr("s.yaml:10: outcomes.x." + key), HasSubstr("never touches itself")));
    EXPECT_THAT(read(two("1") + "outcomes:\n  x: {object: b, all_of: [{not: {" + key + ": b}}]}\n").errors,
                HasSubstr("never touches itself"));
    EXPECT_EQ(read(two("1") + "outcomes:\n  x: {object: b, " + key + ": a}\n").errors, "");
  }
  // Those that come in no file.
  const auto scene = parse_scene(two("1"), "s.yaml");
  ASSERT_TRUE(scene.ok());
  const belief::Outcome self{"x", "b", {belief::Condition{belief::Touched{"b"}}}};
  EXPECT_THAT(belief::validate(*scene, self).message(), HasSubstr("neither touches itself nor rests on itself"));
}

TEST(PlausibleScene, OutcomesThatNeverCountAreToldWithTheirLine) {
  EXPECT_THAT(
      read(two("1") + "exclusive_outcomes:\n  g:\n    object: b\n    outcomes:\n      low: {below: 1}\n" +
           "      again: {below: 1}\n")
          .errors,
      HasSubstr("s.yaml:14: exclusive_outcomes.g.outcomes.again: 'again' never counts, as 'low' above it holds"));
  EXPECT_THAT(read(two("1") + "outcomes:\n  x:\n    object: b\n    below: 1\n    not: {below: 1}\n").errors,
              HasSubstr("s.yaml:11: outcomes.x: "));
}

// What is remarked on a model, and the model.
struct Suggested {
  std::vector<Problem> remarks;
  belief::ObjectModel model;
};

Suggested suggested(const std::string& model_keys, bool asked = true) {
  SceneFileOptions options;
  options.suggest_symmetries = asked;
  FileReport report;
  const auto scene = parse_scene("models:\n  m:\n    mass: 1\n    " + model_keys +
                                     "\nsupports:\n  t: {ground: {size: 4}}\n"
                                     "objects:\n  o: {model: m, pose: {position: [0, 0, 0.2]}}\n",
                                 "s.yaml", options, &report);
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  return {report.remarks, scene ? scene->models[0] : belief::ObjectModel{}};
}

TEST(PlausibleScene, SuggestsTheSymmetryOfWhatLooksTheSameWhenTurned) {
  struct Case {
    const char* shape;
    const char* turns;   // part of the remark
    const char* remedy;  // what is to be written
    int rotations;       // besides the identity; -1: any number
  };
  const std::vector<Case> cases = {
      {"box: [0.07, 0.11, 0.2]", "turned by 180 degrees about x, y or z", "cuboid", 3},
      {"box: [0.06, 0.06, 0.06]", "turned by 90 degrees about x, y or z", "cube", 23},
      {"box: [0.06, 0.06, 0.2]", "turned in 7 ways", "{rotations: [", 7},
      {"sphere: 0.05", "turned in any way", "ball", -1},
      {"cylinder: {radius: 0.03, length: 0.1}", "turned by any angle about z, and upside down",
       "{axis: z, continuous: true, flip: true}", -1},
      {"parts: [{box: [0.2, 0.1, 0.04], position: [0, 0, 0.02]}, {box: [0.05, 0.05, 0.1], position: [0, 0, 0.09]}]",
       "turned by 180 degrees about z", "{axis: z, order: 2", 1},
      {"parts: [{box: [0.07, 0.11, 0.2], position: [0.05, 0, 0.1]}]", "turned by 180 degrees about x, y or z",
       "{cuboid: true, center: [0.05, 0, 0.1]}", 3},
  };
  for (const Case& c : cases) {
    const Suggested found = suggested(c.shape);
    ASSERT_EQ(found.remarks.size(), 1U) << c.shape;
    EXPECT_TRUE(found.model.symmetry.trivial()) << "nobody but the user decides";
    EXPECT_EQ(found.remarks[0].line, 3) << c.shape;
    EXPECT_EQ(found.remarks[0].key, "models.m") << c.shape;
    EXPECT_THAT(found.remarks[0].text(), AllOf(HasSubstr(c.turns), HasSubstr("confidence is shared"))) << c.shape;
    // The remedy, written into the file as it is, is read, turns the shape into itself, and ends the remark.
    const std::string& remedy = found.remarks[0].remedy;
    const std::size_t from = remedy.find("'symmetry: ");
    ASSERT_NE(from, std::string::npos) << remedy;
    const std::string line = remedy.substr(from + 1, remedy.find('\'', from + 1) - from - 1);
    EXPECT_EQ(line.rfind(std::string("symmetry: ") + c.remedy, 0), 0U) << line;
    const Suggested written = suggested(std::string(c.shape) + "\n    " + line);
    EXPECT_TRUE(written.remarks.empty()) << line;
    const geometry::SymmetryGroup& group = written.model.symmetry;
    EXPECT_FALSE(group.trivial()) << line;
    if (c.rotations >= 0) {
      EXPECT_EQ(static_cast<int>(group.rotations.size()), c.rotations) << line;
    }
    const geometry::TriangleMesh shape = belief::collision_mesh(found.model.collision);
    for (const geometry::Quaterniond& rotation : group.rotations) {
      geometry::Box turned;
      for (const geometry::Vector3d& p : shape.vertices) turned.extend(group.p_BoC + rotation * (p - group.p_BoC));
      const geometry::Box box = geometry::bounding_box(shape);
      EXPECT_TRUE(turned.min().isApprox(box.min(), 1e-3) && turned.max().isApprox(box.max(), 1e-3)) << line;
    }
  }
}

TEST(PlausibleScene, SuggestsNoSymmetryWhereATurnCountsOrNobodyAsks) {
  const std::string box = "box: [0.07, 0.11, 0.2]";
  EXPECT_TRUE(suggested(box, false).remarks.empty());
  EXPECT_TRUE(suggested(box + "\n    symmetry: none").remarks.empty()) << "the user has decided";
  EXPECT_TRUE(suggested(box + "\n    learn_colors: true").remarks.empty()) << "colours may tell the turns apart";
  EXPECT_TRUE(suggested("parts: [{box: [0.2, 0.1, 0.04]}, {box: [0.05, 0.05, 0.1], position: [0.05, 0.02, 0.07]}]")
                  .remarks.empty());
}

}  // namespace
}  // namespace prescene::interfaces
