// SPDX-License-Identifier: Apache-2.0
// Tosses of a box with known properties, forecast by the truth and by models that were fitted to others of them.
#include "prescene/service/calibration/toss_evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "prescene/interfaces/scene_files/model_file.h"
#include "tests/support/paths.h"
#include "tests/support/simulated_motions.h"

namespace prescene::tests::toss_evaluation_test {
namespace {

using service::evaluate_folds;
using service::evaluate_model;
using service::MotionDataset;
using service::ScoredToss;
using service::scores_of;
using service::TossEvaluation;
using service::TossScores;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class TossEvaluationTest : public ::testing::Test {
 protected:
  static service::BackendSettings automatic() {
    service::BackendSettings settings;
    settings.stepper = service::Stepper::kAutomatic;
    return settings;
  }
  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  std::vector<SimulatedMotion> tosses(int count) {
    const belief::Scene scene = box_scene({});
    auto motions = simulated_tosses(scene, **backends_.make_simulator(scene), count,
                                    core::RandomStream(1, core::Purpose::kTest), pool_);
    for (SimulatedMotion& motion : motions) rest_on(motion, 0.3);
    return motions;
  }
  /// Lies still for so long at the end, with frames as before.
  static void rest_on(SimulatedMotion& motion, double seconds) {
    const double end = motion.times.back();
    const geometry::Pose X_WO = motion.X_WO.back();
    for (int i = 1; i <= static_cast<int>(seconds * 120.0); ++i) {
      motion.times.push_back(end + i / 120.0);
      motion.X_WO.push_back(X_WO);
    }
  }
  /// With the truth as the scene.
  MotionDataset dataset(const std::vector<SimulatedMotion>& motions) const {
    write("scene.yaml", box_scene_yaml({}));
    write("tosses.csv", motion_table(motions));
    auto read = service::read_motion_dataset(folder_, {});
    EXPECT_TRUE(read.ok()) << read.status().message();
    return *std::move(read);
  }
  /// A model file of the truth with these throws.
  std::filesystem::path truth_file(const interfaces::ModelThrows& throws) const {
    const auto yaml =
        interfaces::fitted_model_yaml(folder_ / "scene.yaml", "box", box_scene({}).models[0], folder_, {});
    EXPECT_TRUE(yaml.ok());
    write("truth.yaml", *yaml + interfaces::throws_yaml(throws));
    return folder_ / "truth.yaml";
  }

  const ScratchDir scratch_;
  const std::filesystem::path folder_ = scratch_.path();
  core::ThreadPool pool_{1};
  service::Backends backends_{pool_, automatic()};
};

TEST_F(TossEvaluationTest, TheTruthHoldsWhatItsRegionsPromise) {
  const MotionDataset data = dataset(tosses(40));
  const auto found = evaluate_model(data, truth_file({2e-4, 2e-3, 0.0}), backends_, 1);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->scores.n, 40);
  EXPECT_EQ(found->scores.independent, 40);
  // The starts are known to the tracker's noise, which is what the regions are made of: 40 tosses at 0.9, within 2.7
  // standard errors.
  EXPECT_NEAR(found->scores.coverage[2].held.value, 0.9, 0.13);
  EXPECT_GT(found->scores.right_side.value, 0.8);
  EXPECT_LT(found->scores.brier.value, 0.3);
  EXPECT_LT(std::abs(found->scores.mean_error[0].value), 4.0 * found->scores.mean_error[0].standard_error + 1e-3);
  const auto json = to_json(*found);
  EXPECT_EQ(json["tosses"].size(), 40U);
  EXPECT_NEAR(json["throws"]["position_noise"].get<double>(), 2e-4, 1e-12);
  // The same bits again, and with two threads.
  core::ThreadPool two(2);
  service::Backends others(two, automatic());
  const auto again = evaluate_model(data, folder_ / "truth.yaml", others, 1);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(to_json(*again).dump(), json.dump());
}

TEST_F(TossEvaluationTest, NamesTwinsTouchesAndWhatCannotBeUsed) {
  std::vector<SimulatedMotion> motions = tosses(12);
  // Toss 12 is toss 3 turned by a radian.
  motions.push_back(motions[3]);
  for (geometry::Pose& X : motions.back().X_WO)
    X = geometry::Pose{geometry::exp_rotation({0.0, 0.0, 1.0}), geometry::Vector3d(0.2, 0.0, 0.0)} * X;
  // Toss 5 is pushed after it lay still; without the push it is scored alike.
  const auto before = evaluate_model(dataset(motions), {}, backends_, 1);
  for (int i = 1; i <= 24; ++i) {
    motions[5].times.push_back(motions[5].times.back() + 1.0 / 120.0);
    geometry::Pose X = motions[5].X_WO.back();
    X.translation.y() += 2e-3;
    motions[5].X_WO.push_back(X);
  }
  // The clock of toss 7 jumps in flight; toss 8 ends before its rest.
  for (std::size_t i = 6; i < motions[7].times.size(); ++i) motions[7].times[i] += 1.0;
  motions[8].times.resize(45);
  motions[8].X_WO.resize(45);
  const auto found = evaluate_model(dataset(motions), {}, backends_, 1);
  ASSERT_TRUE(before.ok() && found.ok()) << found.status().message();
  EXPECT_THAT(found->remarks, Contains(HasSubstr("toss 12 is a twin of toss 3")));
  EXPECT_THAT(found->remarks, Contains(HasSubstr("toss 5 was touched after its rest")));
  EXPECT_THAT(found->remarks, Contains(HasSubstr("left out: toss 7: its stamps jump by 1.0")));
  EXPECT_THAT(found->remarks, Contains(HasSubstr("toss 8 does not come to rest and is not scored")));
  EXPECT_THAT(found->remarks, Contains(HasSubstr("the model says nothing of how throws differ")));
  EXPECT_EQ(found->scores.n, 11);
  EXPECT_EQ(found->scores.independent, 10);
  const auto of = [](const TossEvaluation& evaluation, const std::string& name) {
    return *std::ranges::find(evaluation.tosses, name, &ScoredToss::name);
  };
  EXPECT_NEAR((of(*before, "toss 5").true_place - of(*found, "toss 5").true_place).norm(), 0.0, 1e-3);
  EXPECT_EQ(of(*before, "toss 5").true_side, of(*found, "toss 5").true_side);
  EXPECT_EQ(of(*found, "toss 12").group, of(*found, "toss 3").group);
}

TEST_F(TossEvaluationTest, SaysWhyNothingCanBeScored) {
  std::vector<SimulatedMotion> motions = tosses(6);
  std::vector<SimulatedMotion> cut = motions;
  for (SimulatedMotion& motion : cut) {
    const auto frames = static_cast<std::size_t>((motion.first_contact + 0.05) * 120.0);
    motion.times.resize(frames);
    motion.X_WO.resize(frames);
  }
  const auto restless = evaluate_model(dataset(cut), {}, backends_, 1);
  ASSERT_FALSE(restless.ok());
  EXPECT_EQ(restless.status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(std::string(restless.status().message()), HasSubstr("no recording comes to rest"));
  for (SimulatedMotion& motion : motions)
    for (geometry::Pose& X : motion.X_WO) X.translation *= 1000.0;
  const auto millimetres = evaluate_model(dataset(motions), {}, backends_, 1);
  ASSERT_FALSE(millimetres.ok());
  EXPECT_THAT(std::string(millimetres.status().message()), HasSubstr("millimetres"));
  EXPECT_FALSE(evaluate_model(dataset(tosses(6)), folder_ / "absent.yaml", backends_, 1).ok());
}

// Three twins are one flight, which does not measure gravity.
TEST_F(TossEvaluationTest, TwinsOfOneFlightAreScoredWithTheScenesGravity) {
  std::vector<SimulatedMotion> motions = tosses(1);
  for (int i = 1; i <= 3; ++i) {
    motions.push_back(motions[0]);
    for (geometry::Pose& X : motions.back().X_WO)
      X = geometry::Pose{geometry::exp_rotation({0.0, 0.0, 0.5 * i}), geometry::Vector3d(0.1 * i, 0.0, 0.0)} * X;
  }
  const MotionDataset data = dataset(motions);  // with the scene of truth_file()
  const auto found = evaluate_model(data, truth_file({2e-4, 2e-3, 0.0}), backends_, 1);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->scores.n, 4);
  EXPECT_EQ(found->scores.independent, 1);
  EXPECT_THAT(found->remarks, Contains(HasSubstr("one motion alone is scored")));
}

TEST_F(TossEvaluationTest, SaysThatTheSceneIsOfASmallerObject) {
  const MotionDataset data = dataset(tosses(6));
  const auto right = evaluate_model(data, truth_file({2e-4, 2e-3, 0.0}), backends_, 1);
  ASSERT_TRUE(right.ok()) << right.status().message();
  EXPECT_THAT(right->remarks, Not(Contains(HasSubstr("above a support"))));
  // Half as large: it would hang 25 mm above the board where a cube of 10 cm lies.
  write("half.yaml", "model: {box: [0.05, 0.05, 0.05], mass: 0.4}\n");
  const auto half = evaluate_model(data, folder_ / "half.yaml", backends_, 1);
  ASSERT_TRUE(half.ok()) << half.status().message();
  EXPECT_THAT(half->remarks, Contains(HasSubstr(" recordings rest where the scene's object is 2")));
}

TEST_F(TossEvaluationTest, FoldsKeepTwinsTogetherAndHoldTheTruth) {
  std::vector<SimulatedMotion> motions = tosses(24);
  for (const std::size_t twin : {0U, 4U}) motions.push_back(motions[twin]);
  const MotionDataset data = dataset(motions);
  service::ObjectCalibrationOptions options;
  options.samples = 6;
  options.max_evaluations = 60;
  options.keep = {"inertia_size",     "edge_radius",      "center_of_mass_x",
                  "center_of_mass_y", "center_of_mass_z", "impact_friction"};
  const auto found = evaluate_folds(data, 2, backends_, options);
  ASSERT_TRUE(found.ok()) << found.status().message();
  ASSERT_EQ(found->folds.size(), 2U);
  EXPECT_EQ(found->scores.n, 26);
  EXPECT_EQ(found->scores.independent, 24);
  for (const ScoredToss& toss : found->tosses) {
    for (const ScoredToss& other : found->tosses) {
      if (toss.group == other.group) {
        EXPECT_EQ(toss.fold, other.fold);
      }
    }
  }
  // 24 tosses at 0.9, and a scatter that was set by as few: within three standard errors of both together.
  EXPECT_GT(found->scores.coverage[2].held.value, 0.65);
  EXPECT_LT(found->scores.brier.value, 0.5);
  for (const service::EvaluatedFold& fold : found->folds)
    EXPECT_NEAR(fold.calibration.motion.parameters[0].value, 0.22, 0.05);
  const auto too_many = evaluate_folds(data, 25, backends_, options);
  EXPECT_THAT(std::string(too_many.status().message()), HasSubstr("24 recordings that are no twins"));
}

ScoredToss made_toss(core::RandomStream& stream, std::size_t group) {
  ScoredToss toss;
  toss.group = group;
  toss.side_probabilities = {0.7, 0.1, 0.1, 0.05, 0.05, 0.0};
  toss.true_side = stream.uniform() < 0.7 ? 0 : 1;
  toss.brier = stream.uniform();
  toss.region_mass = stream.uniform();
  toss.true_place = {0.01 * stream.normal(), 0.01 * stream.normal()};
  return toss;
}

TEST(TossScoresTest, TwinsAddNoCertainty) {
  core::RandomStream stream(11, core::Purpose::kTest);
  std::vector<ScoredToss> tosses, doubled;
  for (std::size_t i = 0; i < 400; ++i) {
    tosses.push_back(made_toss(stream, i));
    doubled.insert(doubled.end(), 2, tosses.back());
  }
  const TossScores once = scores_of(tosses, stream);
  const TossScores twice = scores_of(doubled, stream);
  EXPECT_EQ(twice.n, 800);
  EXPECT_EQ(twice.independent, 400);
  EXPECT_NEAR(twice.brier.value, once.brier.value, 1e-12);
  EXPECT_NEAR(twice.brier.standard_error, once.brier.standard_error, 1e-12);
  // Uniform on [0, 1]: a deviation of 0.2887.
  EXPECT_NEAR(once.brier.standard_error, 0.2887 / 20.0, 0.0015);
  // Of a share, by the binomial law.
  EXPECT_NEAR(once.coverage[2].held.standard_error, std::sqrt(0.9 * 0.1 / 400.0), 0.004);
  EXPECT_NEAR(once.coverage[0].held.value, 0.5, 0.1);
  // Of the median of |x| with x normal in the plane: deviation 0.5 / (density sqrt(n)), density at the median
  // sqrt(2 ln 2) / 2 / 0.01.
  const double density = std::sqrt(2.0 * std::log(2.0)) / 2.0 / 0.01;
  EXPECT_NEAR(once.median_error.standard_error, 0.5 / (density * 20.0), 2e-4);
}

TEST(TossScoresTest, SharesOfAllAndOfNoneAreNotCertain) {
  core::RandomStream stream(13, core::Purpose::kTest);
  for (const std::size_t n : {2U, 24U, 400U}) {
    std::vector<ScoredToss> tosses;
    for (std::size_t i = 0; i < n; ++i) {
      tosses.push_back(made_toss(stream, i));
      tosses.back().region_mass = 0.7;
    }
    const TossScores scores = scores_of(tosses, stream);
    const double count = static_cast<double>(n), share = 0.5 / (count + 1.0);
    for (const std::size_t level : {0U, 1U}) {
      EXPECT_EQ(scores.coverage[level].held.value > 0.5, level == 1);
      EXPECT_NEAR(scores.coverage[level].held.standard_error, std::sqrt(share * (1.0 - share) / count), 1e-12);
    }
  }
}

TEST(TossScoresTest, TheReliabilityTableCountsEveryProbabilityOnce) {
  core::RandomStream stream(12, core::Purpose::kTest);
  std::vector<ScoredToss> tosses;
  for (std::size_t i = 0; i < 500; ++i) tosses.push_back(made_toss(stream, i));
  int n = 0;
  for (const service::ReliabilityRow& row : scores_of(tosses, stream).reliability) {
    n += row.n;
    if (row.low == 0.6) {
      EXPECT_NEAR(row.observed, 0.7, 0.07);
    }
    EXPECT_GE(row.mean, row.low);
  }
  EXPECT_EQ(n, 6 * 500);
}

}  // namespace
}  // namespace prescene::tests::toss_evaluation_test
