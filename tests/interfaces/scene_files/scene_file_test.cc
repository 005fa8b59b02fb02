// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/scene_file.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <set>

#include "tests/interfaces/scene_files/scene_texts.h"
#include "tests/interfaces/scene_files/small_scene.h"
#include "tests/interfaces/scene_files/yaml_edits.h"
#include "tests/support/matchers.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using belief::Scene;
using geometry::Pose;
using geometry::Vector3d;
using small_scene::error_of;
using small_scene::scene_of;
using small_scene::small;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

belief::PoseDistribution pose_of(const std::string& pose) {
  return scene_of(small("", "", "    pose: " + pose + "\n")).objects.at(0).pose;
}

TEST(SceneFile, OfThePageHasAllThatThePageSays) {
  const Scene scene = scene_of(tests::code_blocks(tests::text_of_file("docs/reference/scene_files.md"), "yaml"));
  EXPECT_EQ(scene.models.size(), 11U);
  EXPECT_EQ(scene.supports.size(), 4U);
  EXPECT_EQ(scene.robot.size(), 2U);
  EXPECT_EQ(scene.objects.size(), 8U);
  EXPECT_EQ(scene.joints.size(), 2U);
  EXPECT_EQ(scene.actions.size(), 12U);
  EXPECT_EQ(scene.exclusive_outcomes[1].outcomes.size(), 6U);
  EXPECT_EQ(scene.objects[0].held_by, "gripper");
  EXPECT_EQ(core::ok_status(), belief::validate(scene));
}

// What `unknown` in each map is answered with lists the keys that the map knows; each has to stand on the page.
TEST(SceneFile, ThePageNamesEveryKey) {
  const std::string page = tests::text_of_file("docs/reference/scene_files.md");
  const std::string text = tests::code_blocks(page, "yaml");
  std::set<std::string> known;
  for (const tests::YamlKey& key : tests::all_keys(*parse_yaml(text, "page.yaml"))) {
    FileReport report;
    const auto damaged = tests::replaced(text, key.line, key.column, key.name.size(), "zzzzzzzzzzzzzzzz");
    EXPECT_TRUE(parse_scene(damaged, "page.yaml", tests::options_with_meshes(), &report).ok() ||
                !report.errors.empty());
    for (const Problem& problem : report.errors) {
      if (problem.reason != "unknown key") continue;
      std::string rest = problem.remedy;
      for (std::size_t at = rest.find('\''); at != std::string::npos; at = rest.find('\'')) {
        const std::size_t end = rest.find('\'', at + 1);
        known.insert(rest.substr(at + 1, end - at - 1));
        rest = rest.substr(end + 1);
      }
    }
  }
  EXPECT_GT(known.size(), 80U);
  for (const std::string& key : known) {
    const bool named = page.find("`" + key + "`") != std::string::npos || page.find(key + ":") != std::string::npos ||
                       page.find(key + ",") != std::string::npos || page.find(key + "}") != std::string::npos;
    EXPECT_TRUE(named) << key;
  }
}

TEST(SceneFile, DefaultsAreThoseOfTheStructs) {
  const Scene scene = scene_of(small());
  const Scene defaults;
  EXPECT_EQ(scene.gravity_W, defaults.gravity_W);
  EXPECT_EQ(scene.duration, defaults.duration);
  EXPECT_EQ(scene.stop_at_rest, defaults.stop_at_rest);
  EXPECT_EQ(scene.models[0].contact, belief::ContactProperties{});
  EXPECT_EQ(scene.models[0].mass, belief::ScalarDistribution(belief::FixedScalar{1.0}));
  EXPECT_FALSE(scene.camera.has_value());
  EXPECT_EQ(scene.depth_noise, belief::DepthNoiseSettings{});
  EXPECT_FALSE(scene.models[0].learn_colors);
  // Uniform density: (y^2 + z^2) / 12.
  EXPECT_NEAR(scene.models[0].unit_inertia(0, 0), (0.04 + 0.09) / 12.0, 1e-12);
}

TEST(SceneFile, ReadsPosesInEveryForm) {
  EXPECT_EQ(pose_of("{position: [1, 2, 3]}"),
            belief::PoseDistribution(belief::FixedPose{Pose::from_translation({1, 2, 3})}));
  const auto rotation = [&](const std::string& text) {
    return std::get<belief::FixedPose>(pose_of("{position: [0, 0, 0], rotation: " + text + "}")).X_WO.rotation;
  };
  const Vector3d x = Vector3d::UnitX();
  EXPECT_THAT(rotation("{euler_deg: [0, 0, 90]}") * x, tests::is_near(Vector3d(0, 1, 0), 1e-12));
  EXPECT_THAT(rotation("{euler_deg: [90, 0, 90]}") * Vector3d(0, 1, 0), tests::is_near(Vector3d(0, 0, 1), 1e-12))
      << "roll about the fixed x comes first";
  EXPECT_THAT(rotation("{axis_angle_deg: [0, 2, 0, 90]}") * x, tests::is_near(Vector3d(0, 0, -1), 1e-12));
  EXPECT_THAT(rotation("{quaternion_wxyz: [0.7071, 0, 0, 0.7071]}") * x, tests::is_near(Vector3d(0, 1, 0), 1e-12));

  const auto normal = std::get<belief::NormalPose>(
      pose_of("{position: [1, 0, 0], normal: {position: [0.1, 0.2, 0], rotation_deg: 2}}"));
  geometry::Vector6d expected;
  expected << Vector3d::Constant(2 * kDegree).cwiseAbs2(), 0.01, 0.04, 0.0;
  EXPECT_THAT(normal.covariance, tests::is_near(geometry::Matrix6d(expected.asDiagonal()), 1e-15));
  const auto box =
      std::get<belief::BoxPose>(pose_of("{position: [{uniform: [0, 1]}, 2, {normal: [0, 0.1]}], rotation: any}"));
  EXPECT_TRUE(box.any_rotation);
  EXPECT_EQ(box.position.x, belief::ScalarDistribution(belief::UniformScalar{0.0, 1.0}));
  EXPECT_EQ(std::get<belief::SampledPose>(pose_of("{samples: [{position: [0, 0, 1]}, {position: [0, 0, 2]}]}"))
                .samples.size(),
            2U);
}

TEST(SceneFile, CutsNormalsWhereNatureDoes) {
  const Scene scene = scene_of(small("",
                                     "    mass: {normal: [1, 0.1]}\n    friction: {normal: [0.1, 0.1]}\n    "
                                     "restitution: {normal: [0.1, 0.1], max: 0.5}\n"));
  EXPECT_GT(belief::lowest(scene.models[0].mass), 0.0);
  EXPECT_EQ(belief::lowest(scene.models[0].contact.friction), 0.0);
  EXPECT_EQ(belief::lowest(scene.models[0].contact.restitution), 0.0);
  EXPECT_EQ(belief::highest(scene.models[0].contact.restitution), 0.5);
}

TEST(SceneFile, AnOpenBinHasARealHollow) {
  const Scene scene = scene_of(small("outcomes:\n  in: {inside: bin}\n"));
  const belief::Support& bin = scene.supports[1];
  EXPECT_EQ(bin.collision.size(), 5U);
  EXPECT_EQ(bin.hollow->size, Vector3d(0.2, 0.3, 0.4));
  EXPECT_THAT(bin.hollow->X_OV.translation, tests::is_near(Vector3d(0, 0, 0.21), 1e-12));
  const auto& volume = std::get<belief::InsideVolume>(scene.outcomes[0].all_of[0].predicate);
  EXPECT_EQ(volume.size, bin.hollow->size);
  // The boxes fill just the walls of the mesh: same volume.
  double boxes = 0.0;
  for (const belief::CollisionShape& shape : bin.collision) boxes += belief::mass_properties(shape, 1.0)->mass;
  EXPECT_NEAR(boxes, geometry::mass_properties(*bin.visual, 1.0)->mass, 1e-9);
}

TEST(SceneFile, ReadsOutcomesWithTheirTimesAndNegations) {
  const Scene scene =
      scene_of(small("outcomes:\n"
                     "  a: {below: 0.1, when: ever, not: {touched: bin}}\n"
                     "  b: {moving: false}\n"
                     "  c: {not: {upright: {within_deg: 20, axis: -x}, when: always}}\n"
                     "  d: {all_of: [{touched: table}, {touched: bin}]}\n"
                     "  e: {any_of: [{face_up: z}, {face_up: -z}, {not: {moving: true}}]}\n"));
  using belief::Condition;
  const std::vector<Condition>& a = scene.outcomes[0].all_of;
  EXPECT_EQ(a[0], (Condition{belief::BelowHeight{0.1}, belief::When::kEver, false}));
  EXPECT_EQ(a[1], (Condition{belief::Touched{"bin"}, belief::When::kAtEnd, true}));
  EXPECT_EQ(scene.outcomes[1].all_of[0], (Condition{belief::StillMoving{}, belief::When::kAtEnd, true}));
  EXPECT_EQ(scene.outcomes[2].all_of[0],
            (Condition{belief::UprightWithin{-Vector3d::UnitX(), 20 * kDegree}, belief::When::kAlways, true}));
  EXPECT_EQ(scene.outcomes[3].all_of.size(), 2U);
  EXPECT_TRUE(scene.outcomes[4].all_of.empty());
  EXPECT_EQ(scene.outcomes[4].any_of, (std::vector<Condition>{{belief::FaceUp{Vector3d::UnitZ()}},
                                                              {belief::FaceUp{-Vector3d::UnitZ()}},
                                                              {belief::StillMoving{}, belief::When::kAtEnd, true}}));
  EXPECT_EQ(scene.outcomes[3].object, "block") << "the only object need not be named";
}

TEST(SceneFile, ListsAllMistakesAtOnce) {
  FileReport report;
  const std::string text = small("gravty: [0, 0, -9.81]\nduration: -1\n", "    fricton: 0.4\n", "    held_by: hand\n");
  EXPECT_FALSE(parse_scene(text, "s.yaml", {}, &report).ok());
  ASSERT_EQ(report.errors.size(), 4U);
  EXPECT_THAT(error_of(text), HasSubstr("s.yaml:5: models.block.fricton: unknown key: did you mean 'friction'?"));
  EXPECT_THAT(error_of(text), HasSubstr("gravty: unknown key: did you mean 'gravity'?"));
  EXPECT_THAT(error_of(text), HasSubstr("duration: -1 is out of range: give seconds"));
  EXPECT_THAT(error_of(text),
              HasSubstr("objects.block.held_by: 'hand' is not a robot body of this file: define it first"));
}

TEST(SceneFile, GuessesWrongUnits) {
  EXPECT_EQ(error_of(small("", "    mass: 100\n")), "") << "a box of lead is no mistake";
  EXPECT_THAT(error_of("models:\n  m: {box: [0.105, 0.105, 0.105], mass: 370}\nobjects:\n  o: {model: m, pose: {}}\n"),
              HasSubstr("denser than any metal: grams? then write 0.37"));
  EXPECT_THAT(error_of("models:\n  m: {box: [105, 105, 105], mass: 0.37}\nobjects:\n  o: {model: m, pose: {}}\n"),
              HasSubstr("105 is out of range: millimetres? then write 0.105"));
  EXPECT_THAT(error_of("models:\n  m: {box: [10, 10, 10], mass: 0.37}\nobjects:\n  o: {model: m, pose: {}}\n"),
              HasSubstr("lighter than air: check the sizes (metres"));
  EXPECT_THAT(
      error_of("models:\n  m: {mesh: {file: a.ply, scale: 1}, mass: 0.37}\nobjects:\n  o: {model: m, pose: {}}\n"),
      HasSubstr(" m: the mesh is probably in millimetres: give scale: 0.001"));
  EXPECT_THAT(error_of(small("", "", "    pose: {position: [0, 0, 5 cm]}\n")), HasSubstr("write 0.05 without a unit"));
  EXPECT_THAT(error_of(small("", "", "    pose: {rotation: {euler: [0, 0, 1]}}\n")),
              HasSubstr("did you mean 'euler_deg'?"));
}

TEST(SceneFile, OutcomesOfAGroupMayJudgeDifferentObjects) {
  const std::string second =
      "    pose: {position: [0, 0, 0.2]}\n  other_block: {model: block, pose: {position: [0.5, 0, 0.2]}}\n";
  const auto group = [&](const std::string& text) {
    return small("exclusive_outcomes:\n  g: " + text + "\n", "", second);
  };
  const Scene scene =
      scene_of(group("{outcomes: {a: {object: block, below: 0.1}, b: {object: other_block, below: 0.1}}}"));
  ASSERT_EQ(scene.exclusive_outcomes.size(), 1U);
  EXPECT_EQ(scene.exclusive_outcomes[0].outcomes[0].object, "block");
  EXPECT_EQ(scene.exclusive_outcomes[0].outcomes[1].object, "other_block");
  for (const char* unclear : {"{outcomes: {a: {object: block, below: 0.1}, b: {below: 0.1}}}", "{face_up: true}"})
    EXPECT_THAT(error_of(group(unclear)), HasSubstr("name the object that is judged")) << unclear;
}

TEST(SceneFile, ExplainsWhatDoesNotGoTogether) {
  EXPECT_THAT(error_of(small("", "    density: 5\n    mass: 1\n")),
              HasSubstr("'density' and 'mass' exclude each other"));
  EXPECT_THAT(error_of(small("", "    sphere: 1\n")), HasSubstr("exclude each other"));
  EXPECT_THAT(error_of(small("actions:\n  - {time: 1, release: {object: block}}\n")),
              HasSubstr("'block' is not held at that time"));
  EXPECT_THAT(error_of(small("actions:\n  - {time: 1, tilt: {object: block, angle_deg: 5}}\n")),
              HasSubstr("'block' is not held at that time"));
  EXPECT_THAT(error_of(small("actions:\n  - {time: 1, bump: {object: block}}\n")),
              HasSubstr("give the impulse [x, y, z] in the world, N s"));
  EXPECT_THAT(error_of(small("actions:\n  - {time: 1, pull: {object: block, by: [1, 0, 0], force: -1}}\n")),
              HasSubstr("give a force in N"));
  EXPECT_THAT(error_of(small("actions:\n  - {time: 1, pull: {object: block, by: [0, 0, 0]}}\n")),
              HasSubstr("it pulls nowhere"));
  EXPECT_THAT(error_of(small("outcomes:\n  a: {inside: table}\n")),
              HasSubstr("'table' has no hollow: make it an open_bin"));
  EXPECT_THAT(error_of(small("outcomes:\n  a: {object: block}\n")), HasSubstr("the outcome has no condition"));
  EXPECT_THAT(error_of(small("outcomes:\n  a: {not: {below: 1, moving: true}}\n")),
              HasSubstr("'not' holds 2 conditions"));
  EXPECT_THAT(error_of(small("exclusive_outcomes:\n  g: {outcomes: {other: {below: 1}}}\n")),
              HasSubstr("'other' is made by itself"));
  EXPECT_THAT(error_of(small("outcomes:\n  a: {below: 1, not: {below: 1}}\n")), HasSubstr("never hold together"));
  EXPECT_THAT(error_of(small("exclusive_outcomes:\n  g: {outcomes: {a: {below: 1}, b: {below: 1}}}\n")),
              HasSubstr("'b' never counts, as 'a' above it"));
  EXPECT_THAT(error_of(small("exclusive_outcomes:\n  g: {outcomes: {a: {below: 1}, b: {below: 1, moving: true}}}\n")),
              HasSubstr("put the narrower outcome first"));
  EXPECT_THAT(error_of(small("", "    mass: 0\n")), HasSubstr("more than 0"));
  EXPECT_THAT(error_of(small("", "    inertia: [1, 1, 3]\n")), HasSubstr("no body has this inertia"));
  EXPECT_THAT(error_of(small("", "    symmetry: {axis: z}\n")), HasSubstr("the turns about the axis are missing"));
  EXPECT_THAT(error_of(small("", "    symmetry: {rotations: [{quaternion_wxyz: [0.707, 0, 0, 0.707]}]}\n")),
              HasSubstr("no group"));
  EXPECT_THAT(error_of(small("", "", "    pose: {rotation: {quaternion_wxyz: [1, 1, 0, 0]}}\n")),
              HasSubstr("has length 1.41"));
  EXPECT_THAT(error_of(small("", "", "    pose: {position: [{uniform: [0, 1]}, 0, 0], normal: {position: 1}}\n")),
              HasSubstr("as its mean"));
  EXPECT_THAT(error_of(small("", "", "    pose: {position: [{uniform: [1, 0]}, 0, 0]}\n")),
              HasSubstr("runs backwards"));
  EXPECT_THAT(error_of(small("", "", "    pose: {position: [0, 0, 0], normal: {position: 1.0e+9}}\n")),
              HasSubstr("no larger than the value itself may be"));
  EXPECT_THAT(error_of(small("", "",
                             "    pose: {position: [0, 0, 0], normal: {covariance: [[1, 2, 0, 0, 0, 0], "
                             "[2, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], "
                             "[0, 0, 0, 0, 0, 1]]}}\n")),
              HasSubstr("a negative eigenvalue"));
  EXPECT_THAT(error_of(small("", "", "    velocity: [0, 0, 1.0e+6]\n")), HasSubstr("m/s between"));
  EXPECT_THAT(error_of("objects:\n  a b: {}\n"), HasSubstr("characters that names can't have"));
  EXPECT_THAT(error_of(small("robot:\n  table: {sphere: 0.1, pose: {}}\n")), HasSubstr("the name is taken on line"));
  for (const char* shape : {"mesh: {file: a.ply, use: surface}", "lathe: {profile: [[0, 0], [1, 1]], use: surface}"}) {
    EXPECT_THAT(error_of("models:\n  m: {" + std::string(shape) + ", mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n"),
                HasSubstr("a surface of triangles can't move"));
  }
  const auto lathe_error = [](const std::string& keys) {
    return error_of("models:\n  m: {lathe: {profile: [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]], " + keys +
                    "}, mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n");
  };
  EXPECT_THAT(lathe_error("use: convex_hull, spheres: 1000"), HasSubstr("only meshes of spheres have this"));
  EXPECT_THAT(lathe_error("use: spheres, spheres: 10"), HasSubstr("about how many spheres"));
  EXPECT_THAT(lathe_error("use: spheres, edge_fidelity: 0.05"), HasSubstr("a tenth of the mesh's diagonal"));
  EXPECT_THAT(error_of("models:\n  m: {mesh: {file: a.obj}, mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n"),
              HasSubstr("a.obj: no such file"));
  EXPECT_THAT(error_of("[1, 2]\n"), HasSubstr("this is a list of 2: give a map of keys"));
}

TEST(SceneFile, RefusesDistributionsOfWhichHardlyAnythingIsLeft) {
  const auto error = [](const std::string& friction) {
    return error_of("models:\n  m:\n    sphere: 0.1\n    mass: 1\n    friction: " + friction +
                    "\nobjects:\n  o: {model: m, pose: {}}\n");
  };
  EXPECT_THAT(error("{normal: [0.3, 0.01], min: 0.5}"),
              AllOf(HasSubstr(":5:"), HasSubstr("mean 0.3 and deviation 0.01"), HasSubstr("its min (0.5)"),
                    HasSubstr("give a min below the mean")));
  EXPECT_THAT(error("{normal: [0.3, 0.01], max: 0.2}"), HasSubstr("its max (0.2)"));
  EXPECT_THAT(error("{normal: [0.3, 0], min: 0.5}"), HasSubstr("hardly anything"));
  EXPECT_EQ(error("{normal: [0.3, 0.1], min: 0.5}"), "");
  EXPECT_EQ(error("{normal: [0.3, 0.1], min: 0.2, max: 0.4}"), "");
}

TEST(SceneFile, RefusesEdgesRounderThanTheShape) {
  const auto error = [](const std::string& shape) {
    return error_of("models:\n  m:\n    mass: 1\n    " + shape + "\nobjects:\n  o: {model: m, pose: {}}\n");
  };
  EXPECT_THAT(error("box: [0.1, 0.1, 0.04]\n    edge_radius: 0.03"),
              AllOf(HasSubstr(":5:"), HasSubstr("0.02 m where it is thinnest"), HasSubstr("give a smaller radius")));
  EXPECT_EQ(error("box: [0.1, 0.1, 0.04]\n    edge_radius: 0.02"), "");
  // A part that is turned is as thin as before.
  EXPECT_THAT(
      error(
          "parts:\n      - {box: [0.2, 0.2, 0.01], rotation: {axis_angle_deg: [1, 0, 0, 45]}}\n    edge_radius: 0.01"),
      HasSubstr("0.005 m where it is thinnest"));
}

TEST(SceneFile, RefusesStartsInsideSupports) {
  const auto error = [](const std::string& support, const std::string& z) {
    return error_of("models:\n  m: {box: [0.05, 0.05, 0.05], mass: 0.1}\nsupports:\n  s: {" + support +
                    "}\nobjects:\n  o: {model: m, pose: {position: [0, 0, " + z + "]}}\n");
  };
  for (const char* support :
       {"box: [1, 1, 0.4]", "cylinder: {radius: 0.4, length: 0.4}", "capsule: {radius: 0.1, length: 0.2}",
        "cone: {radius: 0.4, length: 0.4}", "sphere: 0.2", "ground: {size: 2}",
        "gable_carton: {base: [0.2, 0.2], shoulder_height: 0.3, height: 0.4}"}) {
    const std::string z = std::string(support).starts_with("ground") ? "-0.05" : "0.0";
    const std::string inside = error(support, z);
    EXPECT_THAT(inside, AllOf(HasSubstr(":6:"), HasSubstr("wholly inside the support 's'"), HasSubstr("move it out")))
        << support;
    EXPECT_EQ(error(support, "0.225"), "") << support;  // on it, or above
    EXPECT_EQ(error(support, "0.19"), "") << support;   // partly in it: parted, and told
  }
  // In the hollow of a bin is not in its walls.
  EXPECT_EQ(error("open_bin: {inner: [0.3, 0.3, 0.3], wall: 0.01}", "0.05"), "");
}

TEST(SceneFile, HollowObjectsCollideAsSpheresWhereNothingElseIsSaid) {
  const auto use_of = [](const std::string& profile, const std::string& keys) {
    const auto scene = parse_scene("models:\n  m: {lathe: {profile: " + profile + keys +
                                       "}, mass: 1}\nsupports:\n  s: {lathe: {profile: " + profile +
                                       "}}\nobjects:\n  o: {model: m, pose: {}}\n",
                                   "s.yaml");
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(std::get<belief::MeshShape>(scene->supports[0].collision[0]).use, belief::MeshUse::kConvexHull);
    return std::get<belief::MeshShape>(scene->models[0].collision[0]);
  };
  const std::string can = "[[0, 0], [0.03, 0], [0.03, 0.1], [0, 0.1]]";
  const std::string cup = "[[0, 0], [0.04, 0], [0.04, 0.1], [0.037, 0.1], [0.037, 0.003], [0, 0.003]]";
  EXPECT_EQ(use_of(can, "").use, belief::MeshUse::kConvexHull);
  EXPECT_EQ(use_of(cup, "").use, belief::MeshUse::kSpheres);
  EXPECT_EQ(use_of(cup, ", use: convex_hull").use, belief::MeshUse::kConvexHull);
  const belief::MeshShape finer = use_of(can, ", spheres: 5000, edge_fidelity: 0.001");
  EXPECT_EQ(finer.use, belief::MeshUse::kSpheres);
  EXPECT_EQ(finer.spheres.count, 5000);
  EXPECT_EQ(finer.spheres.edge_fidelity, 0.001);
}

TEST(SceneFile, WarnsWhereAHullHidesAHollow) {
  const auto warnings = [](const std::string& model_keys, const std::string& support_keys) {
    // Of 0.1 m by 0.04 m, with walls and a floor of 3 mm: the hull is a cylinder, and 83 % of it are air.
    const std::string cup = "profile: [[0, 0], [0.04, 0], [0.04, 0.1], [0.037, 0.1], [0.037, 0.003], [0, 0.003]]";
    FileReport report;
    const auto scene =
        parse_scene("models:\n  m:\n    lathe: {" + cup + model_keys + "}\n    mass: 1\nsupports:\n  s: {lathe: {" +
                        cup + support_keys + "}}\nobjects:\n  o: {model: m, pose: {position: [0, 0, 1]}}\n",
                    "s.yaml", {}, &report);
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    std::vector<std::string> texts;
    for (const Problem& warning : report.warnings) texts.push_back(warning.text());
    return texts;
  };
  EXPECT_THAT(warnings("", ", use: surface"), testing::IsEmpty()) << "the model collides as spheres, with its hollow";
  EXPECT_THAT(
      warnings(", use: convex_hull", ", use: surface"),
      ElementsAre(AllOf(HasSubstr("s.yaml:3: models.m.lathe.use: 83 % of its convex hull is hollow in the mesh"),
                        HasSubstr("remove 'use'"))));
  EXPECT_THAT(warnings(", use: convex_parts", ", use: surface"),
              ElementsAre(HasSubstr("83 % of its convex hulls are")));
  EXPECT_THAT(warnings("", ""), ElementsAre(AllOf(HasSubstr("supports.s.lathe"), HasSubstr("write 'use: surface'"))));
}

TEST(SceneFile, WithoutAMeshReaderMeshesAreErrors) {
  const auto scene =
      parse_scene("models:\n  m: {mesh: {file: a.ply}, mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n", "s.yaml");
  EXPECT_THAT(scene.status().message(), HasSubstr("models.m.mesh.file: meshes can't be read here"));
}

TEST(SceneFile, ModelsOfOneMeshFileShareIt) {
  const Scene scene = scene_of(
      "models:\n  a: {mesh: {file: a.ply, scale: 0.001}, mass: 0.5}\n  b: {mesh: {file: a.ply, scale: 0.001}, mass: "
      "0.6}\n"
      "objects:\n  o: {model: a, pose: {}}\n");
  EXPECT_EQ(scene.models[0].visual, scene.models[1].visual);
}

TEST(SceneFile, ModelsHaveTheColoursOfTheirMesh) {
  SceneFileOptions options = tests::options_with_meshes();
  const auto look = std::make_shared<const geometry::MeshLook>();
  options.read_look = [&](const MeshRequest& request) {
    return request.path.filename() == "colored.ply" ? look : nullptr;
  };
  const auto scene = parse_scene(
      "models:\n  a: {mesh: {file: colored.ply, scale: 0.001}, mass: 0.5}\n  b: {mesh: {file: a.ply, scale: 0.001}, "
      "mass: "
      "0.5}\n  c: {box: [0.1, 0.1, 0.1], visual: {file: colored.ply, scale: 0.001}, mass: 0.5}\n"
      "objects:\n  o: {model: a, pose: {}}\n",
      "s.yaml", options);
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_EQ(scene->models[0].look, look);
  EXPECT_EQ(scene->models[1].look, nullptr);
  EXPECT_EQ(scene->models[2].look, look);
}

TEST(SceneFile, WarnsOfOdditiesButReads) {
  FileReport report;
  const auto scene =
      parse_scene("models:\n  m: {sphere: 0.1, mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n", "s.yaml", {}, &report);
  EXPECT_TRUE(scene.ok());
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0].text(), HasSubstr("no support"));
}

TEST(RecordingRecipe, SaysHowASimulatedRecordingIsMade) {
  const std::string scene = "models:\n  m: {sphere: 0.1, mass: 1}\nobjects:\n  o: {model: m, pose: {}}\n";
  const auto silent = parse_recording_recipe(scene, "s.yaml");
  ASSERT_TRUE(silent.ok()) << silent.status().message();
  EXPECT_FALSE(silent->seed || silent->rate || silent->step);
  EXPECT_TRUE(silent->reports_robot);
  const std::string with =
      scene + "recording: {seed: 4, rate: 10, reports_robot: false, stepper: bullet, step: 0.001}\n";
  ASSERT_TRUE(parse_scene(with, "s.yaml").ok());
  const auto recipe = parse_recording_recipe(with, "s.yaml");
  ASSERT_TRUE(recipe.ok()) << recipe.status().message();
  EXPECT_EQ(recipe->seed, 4u);
  EXPECT_EQ(recipe->rate, 10.0);
  EXPECT_FALSE(recipe->reports_robot);
  EXPECT_EQ(recipe->stepper, "bullet");
  EXPECT_EQ(recipe->step, 0.001);
  for (const char* wrong : {"{seeds: 4}", "{seed: -1}", "{rate: 0}", "{stepper: bulet}", "{step: 1}", "[1]"}) {
    const auto refused = parse_scene(scene + "recording: " + wrong + "\n", "s.yaml");
    EXPECT_FALSE(refused.ok()) << wrong;
    EXPECT_THAT(refused.status().message(), HasSubstr("recording")) << wrong;
    EXPECT_FALSE(parse_recording_recipe(scene + "recording: " + wrong + "\n", "s.yaml").ok()) << wrong;
  }
}

TEST(ReadScene, SaysThatAFileIsMissing) {
  FileReport report;
  const auto scene = read_scene("/nowhere/scene.yaml", {}, &report);
  EXPECT_EQ(scene.status().code(), core::StatusCode::kNotFound);
  EXPECT_EQ(report.errors.size(), 1U);
}

}  // namespace
}  // namespace prescene::interfaces
