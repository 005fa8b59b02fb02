// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>

#include "prescene/interfaces/scene_files/model_file.h"
#include "tests/belief/random_values.h"
#include "tests/interfaces/scene_files/scene_texts.h"
#include "tests/support/laws.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::RandomStream;
using geometry::SymmetryGroup;
using testing::HasSubstr;

belief::ScalarDistribution random_between(RandomStream& stream, double low, double high) {
  const double a = stream.uniform(low, high), b = stream.uniform(low, high);
  switch (tests::random_below(stream, 4)) {
    case 0:
      return belief::FixedScalar{a};
    case 1:
      return belief::NormalScalar{a, 0.1 * (high - low), low, high};
    case 2:
      return belief::UniformScalar{std::min(a, b), std::max(a, b)};
    default:
      return belief::SampledScalar{{a, b}};
  }
}

SymmetryGroup random_symmetry(RandomStream& stream) {
  const geometry::Vector3d center =
      tests::random_below(stream, 2) == 1 ? tests::random_vector(stream, 0.1) : geometry::Vector3d(0, 0, 0);
  const geometry::Vector3d axis = geometry::Vector3d::Unit(tests::random_below(stream, 3));
  switch (tests::random_below(stream, 7)) {
    case 0:
      return SymmetryGroup::none();
    case 1:
      return SymmetryGroup::cuboid(center);
    case 2:
      return SymmetryGroup::every_rotation(center);
    case 5:
      return SymmetryGroup::cube(center);
    case 3:
      return SymmetryGroup::cyclic(axis, 2 + tests::random_below(stream, 7), center);
    case 4: {
      SymmetryGroup dihedral = SymmetryGroup::cyclic(geometry::Vector3d::UnitZ(), 4, center);
      const geometry::Quaterniond flip(0, 1, 0, 0);
      const std::vector<geometry::Quaterniond> turns = dihedral.rotations;
      dihedral.rotations.push_back(flip);
      for (const geometry::Quaterniond& turn : turns) dihedral.rotations.push_back(turn * flip);
      return dihedral;
    }
    default:
      return SymmetryGroup::continuous(axis, tests::random_below(stream, 2) == 1, center);
  }
}

ModelFile random_model(RandomStream& stream) {
  ModelFile file;
  file.mesh_file = "a \"quoted\" \\ name.ply";
  file.scale = 0.001;
  file.y_up = tests::random_below(stream, 2) == 1;
  if (const auto use = tests::random_below(stream, 4); use < 3) file.use = static_cast<belief::MeshUse>(use);
  belief::ObjectModel& model = file.model;
  model.name = "mug";
  model.mass = random_between(stream, 0.1, 2.0);
  model.center_of_mass = {random_between(stream, -0.1, 0.1), random_between(stream, -0.1, 0.1),
                          random_between(stream, -0.1, 0.1)};
  model.contact.friction = random_between(stream, 0.0, 1.0);
  if (tests::random_below(stream, 2) == 1) model.contact.impact_friction = random_between(stream, 0.0, 1.0);
  model.contact.restitution = random_between(stream, 0.0, 1.0);
  model.contact.rolling_friction = tests::random_below(stream, 2) * 0.00123;
  model.contact.edge_radius = tests::random_below(stream, 2) * 0.0023;
  Eigen::MatrixXd spread = tests::random_covariance(stream, 3, 3);  // of mass about its centre, of a box of 0.1 m
  spread = 0.001 * (spread / spread.trace() + 0.1 * geometry::Matrix3d::Identity());
  model.unit_inertia = spread.trace() * geometry::Matrix3d::Identity() - spread;
  model.symmetry = random_symmetry(stream);
  model.surface = static_cast<belief::SurfaceKind>(tests::random_below(stream, 3));
  model.color = {stream.uniform(), stream.uniform(), stream.uniform()};
  model.learn_colors = tests::random_below(stream, 2) == 1;
  if (tests::random_below(stream, 2) == 1)
    model.hollow = belief::Hollow{tests::random_pose(stream), geometry::Vector3d(0.1, 0.2, stream.uniform(0.1, 0.3))};
  return file;
}

TEST(ModelFileLaws, WhatIsWrittenIsReadBackToTheBit) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "model.yaml";
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, core::Purpose::kTest);
    ModelFile file = random_model(stream);
    file.remarks = {"found: nothing\nwrong"};
    RC_ASSERT(write_model(path, file) == core::ok_status());
    MeshRequest asked;
    SceneFileOptions options;
    options.read_mesh = [&](const MeshRequest& request) {
      asked = request;
      return tests::options_with_meshes().read_mesh(request);
    };
    const auto read = read_model(path, "mug", options);
    RC_ASSERT(read.status() == core::ok_status());
    belief::ObjectModel expected = file.model;
    expected.collision = read->collision;
    expected.visual = read->visual;
    RC_ASSERT(*read == expected);
    RC_ASSERT(asked.path == folder.path() / file.mesh_file);
    RC_ASSERT(asked.scale == file.scale);
    RC_ASSERT(asked.y_up == file.y_up);
    // The mesh of these tests is convex.
    RC_ASSERT(std::get<belief::MeshShape>(read->collision[0]).use == file.use.value_or(belief::MeshUse::kConvexHull));
    const auto from_text = parse_model(model_yaml(file), path.string(), "mug", options);
    RC_ASSERT(from_text.ok() && *from_text == *read);
  }));
}

TEST(ModelFile, OfThePageIsReadAndOverriddenByAScene) {
  const std::string page = tests::text_of_file("docs/reference/scene_files.md");
  const tests::ScratchDir folder;
  std::ofstream(folder.path() / "mug.yaml") << tests::code_blocks(page, "yaml model file");
  const std::string scene_text =
      tests::code_blocks(page, "yaml model file in a scene") + "objects:\n  o: {model: mug, pose: {}}\n";
  const auto scene = parse_scene(scene_text, folder.path() / "scene.yaml", tests::options_with_meshes());
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  EXPECT_NEAR(belief::mean(scene->models[0].mass), 0.35, 1e-6);
  EXPECT_EQ(belief::dimensions(scene->models[0].mass), 1);
  EXPECT_EQ(scene->models[0].contact.friction, belief::ScalarDistribution(belief::FixedScalar{0.4}));
}

TEST(ModelFile, OfAFittedModelHasEverythingElseAsItsSceneDescribesIt) {
  const tests::ScratchDir folder;
  const std::filesystem::path elsewhere = folder.path() / "fitted";
  std::filesystem::create_directory(elsewhere);
  int models = 0;
  for (const tests::SceneText& text : tests::scene_texts()) {
    std::ofstream(folder.path() / "scene.yaml") << text.text;
    const auto scene = read_scene(folder.path() / "scene.yaml", tests::options_with_meshes());
    ASSERT_TRUE(scene.ok()) << text.file << scene.status().message();
    for (belief::ObjectModel model : scene->models) {
      model.contact.friction = belief::NormalScalar{0.3, 0.01, 0.0, 2.0};
      model.contact.impact_friction = belief::FixedScalar{0.25};
      model.contact.edge_radius = 0.0009;
      model.center_of_mass.y = belief::NormalScalar{0.001, 2e-4};
      model.unit_inertia *= 1.1;
      const auto yaml = fitted_model_yaml(folder.path() / "scene.yaml", model.name, model, elsewhere, {"a remark"});
      ASSERT_TRUE(yaml.ok()) << yaml.status().message();
      std::ofstream(elsewhere / "model.yaml") << *yaml;
      const auto read = read_model(elsewhere / "model.yaml", model.name, tests::options_with_meshes());
      ASSERT_TRUE(read.ok()) << text.file << read.status().message() << *yaml;
      EXPECT_EQ(*read, model) << text.file << *yaml;
      ++models;
    }
  }
  EXPECT_GT(models, 15);
  EXPECT_EQ(fitted_model_yaml(folder.path() / "scene.yaml", "none such", {}, elsewhere).status().code(),
            core::StatusCode::kNotFound);
}

TEST(ModelFile, OfAFittedModelFindsTheSameFilesFromItsOwnFolder) {
  const tests::ScratchDir folder;
  std::filesystem::create_directories(folder.path() / "models");
  std::filesystem::create_directories(folder.path() / "fitted");
  std::ofstream(folder.path() / "models" / "mug.yaml") << "model:\n  mesh: {file: mesh/mug.ply, scale: 0.001}\n"
                                                          "  mass: 0.3\n  friction: 0.2\n";
  std::ofstream(folder.path() / "scene.yaml") << "models:\n  mug: {file: models/mug.yaml, mass: 0.4}\n"
                                                 "objects:\n  o: {model: mug, pose: {}}\n";
  const auto scene = read_scene(folder.path() / "scene.yaml", tests::options_with_meshes());
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const auto yaml = fitted_model_yaml(folder.path() / "scene.yaml", "mug", scene->models[0], folder.path() / "fitted");
  ASSERT_TRUE(yaml.ok()) << yaml.status().message();
  EXPECT_THAT(*yaml, HasSubstr("\"../models/mesh/mug.ply\""));
  EXPECT_THAT(*yaml, HasSubstr("mass: 0.4"));

  // The folder of a file that is named without one.
  const auto here = fitted_model_yaml(folder.path() / "scene.yaml", "mug", scene->models[0], {});
  ASSERT_TRUE(here.ok()) << here.status().message();
  const auto mesh = (folder.path() / "models" / "mesh" / "mug.ply").lexically_relative(std::filesystem::current_path());
  EXPECT_THAT(*here, HasSubstr("\"" + mesh.generic_string() + "\""));
}

TEST(ModelFile, MistakesInItAreToldWithItsOwnName) {
  const tests::ScratchDir folder;
  std::ofstream(folder.path() / "mug.yaml") << "model:\n  mesh: {file: mug.ply, scale: 0.001}\n  mas: 0.3\n";
  const auto scene = parse_scene("models:\n  mug: {file: mug.yaml}\nobjects:\n  o: {model: mug, pose: {}}\n",
                                 folder.path() / "scene.yaml", tests::options_with_meshes());
  EXPECT_THAT(scene.status().message(), HasSubstr("mug.yaml:3: model.mas: unknown key: did you mean 'mass'?"));
  EXPECT_THAT(parse_scene("models:\n  mug: {file: none.yaml}\nobjects:\n  o: {model: mug, pose: {}}\n",
                          folder.path() / "scene.yaml", tests::options_with_meshes())
                  .status()
                  .message(),
              HasSubstr("scene.yaml:2: models.mug.file: the model file can't be used"));
  SceneFileOptions closed;
  closed.follow_files = false;
  EXPECT_THAT(parse_scene("models:\n  mug: {file: mug.yaml}\nobjects:\n  o: {model: mug, pose: {}}\n", "s.yaml", closed)
                  .status()
                  .message(),
              HasSubstr("model files can't be read here"));
}

}  // namespace
}  // namespace prescene::interfaces
