// SPDX-License-Identifier: Apache-2.0
// A data set as a laboratory records one, through the program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "prescene/service/backends.h"
#include "program.h"
#include "tests/support/paths.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests {
namespace {

using ::testing::HasSubstr;

class CalibrateTest : public ::testing::Test {
 protected:
  CalibrateTest() {
    core::ThreadPool pool(1);
    service::Backends backends(pool);
    const belief::Scene scene = box_scene({});
    const auto simulator = backends.make_simulator(scene);
    BoxTruth guess;
    guess.friction = 0.3;
    write_file(folder_ / "scene.yaml", box_scene_yaml(guess));
    write_file(folder_ / "tosses.csv", motion_table(simulated_slides(
                                           scene, **simulator, 6, core::RandomStream(1, core::Purpose::kTest), pool)));
  }

  std::vector<std::string> command(const std::string& output) const {
    std::vector<std::string> args = {"calibrate", folder_.string(), "-o", output, "--json", "-q"};
    args.insert(args.end(), {"--samples", "4", "--max-evaluations", "60"});
    for (const char* name :
         {"impact_friction", "inertia_size", "edge_radius", "center_of_mass_x", "center_of_mass_y", "center_of_mass_z"})
      args.insert(args.end(), {"--keep", name});
    return args;
  }

  const ScratchDir scratch_;
  const std::filesystem::path folder_ = scratch_.path();
};

TEST_F(CalibrateTest, WritesAModelThatValidates) {
  const std::string output = (folder_ / "object.yaml").string();
  const Finished finished = run_program(command(output));
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const auto document = nlohmann::json::parse(finished.out);
  EXPECT_EQ(document["slides"], 6);
  ASSERT_EQ(document["parameters"].size(), 2U);
  EXPECT_EQ(document["parameters"][0]["name"], "friction");
  EXPECT_NEAR(document["parameters"][0]["value"].get<double>(), 0.22, 0.02);
  EXPECT_THAT(document["remarks"].dump(), HasSubstr("these recordings say nothing about restitution: record bounces"));
  EXPECT_EQ(run_program({"validate", output}).exit_code, 0);
  EXPECT_THAT(read_file(output), HasSubstr("box: [0.1, 0.1, 0.1]"));
}

TEST_F(CalibrateTest, NeverWritesOverAnInput) {
  for (const char* name : {"scene.yaml", "tosses.csv"}) {
    const std::string before = read_file(folder_ / name);
    const Finished finished = run_program(command((folder_ / name).string()));
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_EQ(read_file(folder_ / name), before);
  }
}

TEST_F(CalibrateTest, AFewTriesAreNotCalledSettled) {
  std::vector<std::string> args = command((folder_ / "object.yaml").string());
  *(std::ranges::find(args, "--max-evaluations") + 1) = "5";
  const Finished finished = run_program(args);
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const auto document = nlohmann::json::parse(finished.out);
  EXPECT_EQ(document["settled"], false);
  EXPECT_THAT(document["remarks"].dump(), HasSubstr("give more --max-evaluations"));
}

TEST_F(CalibrateTest, MillimetresEndWithTwoAndOneMessage) {
  core::ThreadPool pool(1);
  service::Backends backends(pool);
  const belief::Scene scene = box_scene({});
  auto motions =
      simulated_tosses(scene, **backends.make_simulator(scene), 12, core::RandomStream(1, core::Purpose::kTest), pool);
  for (SimulatedMotion& motion : motions)
    for (geometry::Pose& pose : motion.X_WO) pose.translation *= 1000.0;
  write_file(folder_ / "tosses.csv", motion_table(motions));
  const Finished finished = run_program(command((folder_ / "object.yaml").string()));
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.err, HasSubstr("millimetres"));
  EXPECT_EQ(std::ranges::count(finished.err, '\n'), 1) << finished.err;
}

TEST_F(CalibrateTest, WhatNeverMovesEndsWithTwoAndWithoutAModel) {
  std::vector<SimulatedMotion> motions(8);
  for (SimulatedMotion& motion : motions) {
    for (int i = 0; i < 100; ++i) {
      motion.times.push_back(i / 120.0);
      motion.X_WO.push_back(geometry::Pose::from_translation({0.0, 0.0, 0.05}));
    }
  }
  write_file(folder_ / "tosses.csv", motion_table(motions));
  const Finished finished = run_program(command((folder_ / "object.yaml").string()));
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.err, HasSubstr("8 of 8 recordings can't be used: toss 0: it does not move"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "object.yaml"));
}

TEST_F(CalibrateTest, BadDataSetsEndWithTwo) {
  write_file(folder_ / "tosses.csv", "toss,t,x,y,z\n1,0,0,0,0\n");
  const Finished finished = run_program(command((folder_ / "object.yaml").string()));
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_THAT(finished.err, HasSubstr("tosses.csv, line 1: there is no column 'qw'"));
  EXPECT_THAT(nlohmann::json::parse(finished.out)["error"].get<std::string>(), HasSubstr("qw"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "object.yaml"));
  EXPECT_EQ(run_program({"calibrate", folder_.string()}).exit_code, 2);
  EXPECT_EQ(run_program({"calibrate", folder_.string(), "-o", "x.yaml", "--keep", "colour"}).exit_code, 2);
}

TEST_F(CalibrateTest, EvaluateScoresAFolder) {
  core::ThreadPool pool(1);
  service::Backends backends(pool);
  const belief::Scene scene = box_scene({});
  auto motions =
      simulated_tosses(scene, **backends.make_simulator(scene), 6, core::RandomStream(3, core::Purpose::kTest), pool);
  for (SimulatedMotion& motion : motions) {
    for (int i = 0; i < 24; ++i) {
      motion.times.push_back(motion.times.back() + 1.0 / 120.0);
      motion.X_WO.push_back(geometry::Pose(motion.X_WO.back()));
    }
  }
  write_file(folder_ / "tosses.csv", motion_table(motions));
  const Finished finished = run_program({"evaluate", folder_.string(), "--json", "-q"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const auto document = nlohmann::json::parse(finished.out);
  EXPECT_EQ(document["scores"]["n"], 6);
  EXPECT_EQ(document["tosses"].size(), 6U);
  EXPECT_THAT(document["remarks"].dump(), HasSubstr("the model says nothing of how throws differ"));
  const std::string report = (folder_ / "report.html").string();
  const Finished text = run_program({"evaluate", folder_.string(), "--each", "-q", "--report", report});
  EXPECT_THAT(read_file(report), HasSubstr("Whether probabilities mean what they say"));
  EXPECT_THAT(read_file(report), HasSubstr("toss 5"));
  EXPECT_THAT(text.out, HasSubstr("in 90 % region, %"));
  EXPECT_THAT(text.out, HasSubstr("toss 5"));
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"evaluate", folder_.string(), "--model", "x.yaml", "--folds", "2"},
           {"evaluate", folder_.string(), "--model", (folder_ / "absent.yaml").string()},
           {"evaluate", folder_.string(), "--folds", "7"},
           {"evaluate", folder_.string(), "--data", "data"},
           {"evaluate", (folder_ / "absent").string()},
           {"evaluate", folder_.string(), "--report", (folder_ / "tosses.csv").string()},
           {"evaluate", "credible_regions", "--report", report},
           {"evaluate", "credible_regions", "--folds", "2"}})
    EXPECT_EQ(run_program(wrong).exit_code, 2) << wrong.back();
}

}  // namespace
}  // namespace prescene::tests
