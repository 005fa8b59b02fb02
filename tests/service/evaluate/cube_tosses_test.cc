// SPDX-License-Identifier: Apache-2.0
// The scores by hand, the reader's errors, and the evaluator on tosses of its own making.
#include "prescene/service/evaluate/cube_tosses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "prescene/service/evaluate/cube_calibration.h"
#include "prescene/service/evaluate/forecast_scores.h"
#include "prescene/tests/support/paths.h"

namespace prescene::service {
namespace {

using geometry::Vector3d;

TEST(ForecastScores, BrierAndLogByHand) {
  const std::vector<double> p = {0.7, 0.2, 0.1, 0.0, 0.0, 0.0};
  EXPECT_DOUBLE_EQ(brier_score(p, 0), 0.09 + 0.04 + 0.01);
  EXPECT_DOUBLE_EQ(brier_score(p, 1), 0.49 + 0.64 + 0.01);
  EXPECT_DOUBLE_EQ(brier_score(p, 5), 0.49 + 0.04 + 0.01 + 1.0);
  EXPECT_DOUBLE_EQ(brier_score(std::vector<double>(6, 1.0 / 6.0), 2), 5.0 / 6.0);
  EXPECT_DOUBLE_EQ(log_score(p, 1), std::log(0.2));
  EXPECT_DOUBLE_EQ(log_score(p, 4), std::log(1e-3));
  EXPECT_EQ(mode_of(p), 0);
}

TEST(ForecastScores, ProbabilitiesOfCounts) {
  const std::vector<int> counts = {61, 0, 0, 0, 0, 0};
  const std::vector<double> p = probabilities_of(counts);
  EXPECT_DOUBLE_EQ(p[0], 61.5 / 64.0);
  EXPECT_DOUBLE_EQ(p[3], 0.5 / 64.0);
}

TEST(ForecastScores, QuantilesInterpolate) {
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.9), 3.7);
  EXPECT_DOUBLE_EQ(quantile({7.0}, 0.9), 7.0);
}

TEST(ForecastScores, EnergyScoreByHand) {
  const std::vector<Eigen::Vector2d> samples = {{0.0, 0.0}, {4.0, 0.0}};
  EXPECT_DOUBLE_EQ(energy_score(samples, {0.0, 3.0}), 0.5 * (3.0 + 5.0) - 0.5 * 4.0);
}

TEST(ForecastScores, RegionMassOfOneGaussianIsItsChiSquare) {
  // One sample: a Gaussian of deviation 3 mm; the region through a point at r has the mass 1 - exp(-r^2 / 2 s^2).
  const std::vector<int> groups = {0};
  const PlaneDensity density = density_of({{0.1, 0.2}}, groups, 0.7, 0.003);
  EXPECT_EQ(region_mass(density, {0.1, 0.2}), 0.0);
  EXPECT_NEAR(region_mass(density, Eigen::Vector2d(0.1 + 0.003 * std::sqrt(2.0 * std::log(2.0)), 0.2)), 0.5, 0.13);
  EXPECT_EQ(region_mass(density, {0.2, 0.2}), 1.0);
}

TEST(ForecastScores, RegionsCoverWhatTheyPromise) {
  // Truths from the distribution that the samples come from, two far groups: regions of mass m hold a share m of them.
  core::RandomStream stream(3, core::Purpose::kTest);
  const auto draw = [&](int& group) {
    group = stream.uniform() < 0.3 ? 1 : 0;
    const Eigen::Vector2d z(0.02 * stream.normal(), 0.005 * stream.normal());
    return Eigen::Vector2d(z + Eigen::Vector2d(group * 0.3, 0.0));
  };
  const int repeats = 300;
  int inside_50 = 0;
  int inside_90 = 0;
  for (int r = 0; r < repeats; ++r) {
    std::vector<Eigen::Vector2d> samples;
    std::vector<int> groups(64);
    for (int& group : groups) samples.push_back(draw(group));
    int group = 0;
    const Eigen::Vector2d truth = draw(group);
    const double mass = region_mass(density_of(samples, groups, CubeModel().kernel_scale, 1e-4), truth);
    inside_50 += mass < 0.5;
    inside_90 += mass < 0.9;
  }
  // Three binomial deviations.
  EXPECT_NEAR(inside_50 / double(repeats), 0.5, 0.087);
  EXPECT_NEAR(inside_90 / double(repeats), 0.9, 0.052);
}

TEST(CubeModel, NamesTheFaceThatIsUp) {
  const auto turned = [](const Vector3d& axis, double angle) {
    return geometry::Quaterniond(Eigen::AngleAxisd(angle, axis));
  };
  EXPECT_EQ(face_up(geometry::Quaterniond::Identity()), 4);  // +z
  EXPECT_EQ(face_up(turned(Vector3d::UnitX(), 3.1)), 5);     // -z
  EXPECT_EQ(face_up(turned(Vector3d::UnitX(), 1.5)), 2);     // +y
  EXPECT_EQ(face_up(turned(Vector3d::UnitX(), -1.5)), 3);    // -y
  EXPECT_EQ(face_up(turned(Vector3d::UnitY(), -1.5)), 0);    // +x
  EXPECT_EQ(face_up(turned(Vector3d::UnitY(), 1.5)), 1);     // -x
}

/// Tosses simulated with `model` and seen without noise, as the tracker would.
std::vector<CubeToss> made_tosses(const CubeModel& model, int count) {
  simulation::ShapeStore shapes;
  const belief::Scene scene = make_cube_scene(model);
  const auto simulator = *simulation::make_bullet_simulator(scene, shapes, make_cube_options(model));
  core::RandomStream stream(21, core::Purpose::kTest);
  std::vector<CubeToss> tosses;
  for (int i = 0; i < count; ++i) {
    const auto instance = simulator->make_instance({}, stream);
    belief::WorldState start = belief::mean_start(scene);
    start.objects[0].X_WO = {geometry::uniform_rotation(stream), {0.2, 0.1, 0.2}};
    start.objects[0].V_WO.linear = Vector3d(-1.0, -0.5, 0.2) + 0.2 * geometry::normal_vector(stream);
    start.objects[0].V_WO.angular = 3.0 * geometry::normal_vector(stream);
    instance->set_state(start);
    CubeToss toss;
    toss.number = 2 * i;
    for (int row = 0; row < 250; ++row) {
      const belief::WorldState state = instance->state();
      toss.frames.push_back({state.time, state.objects[0].X_WO});
      while (instance->state().time < (row + 1) / 148.0) instance->step();
    }
    tosses.push_back(toss);
  }
  return tosses;
}

TEST(CubeTosses, ForecastsItsOwnTossesAlmostSurely) {
  CubeModel model = shipped_cube_model();
  model.position_noise = 1e-4;
  model.rotation_noise = 5e-4;
  model.velocity_noise = 1e-3;
  model.spin_noise = 5e-3;
  model.friction_noise = 0.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 20);
  core::ThreadPool one(1);
  core::ThreadPool two(2);
  CubeOptions options;
  options.samples = 16;
  const auto forecasts = forecast_cube_tosses(tosses, model, 1, one, {}, nullptr, options);
  ASSERT_TRUE(forecasts.ok()) << forecasts.status().message();
  const CubeReport report = report_of(*forecasts);
  EXPECT_EQ(report.n, 20);
  EXPECT_GE(report.right_face_share, 0.95);
  EXPECT_LT(report.brier, 0.1);
  EXPECT_LT(report.median_xy_error_m, 0.003);

  const auto again = forecast_cube_tosses(tosses, model, 1, two, {}, nullptr, options);
  ASSERT_TRUE(again.ok());
  for (std::size_t i = 0; i < forecasts->size(); ++i) {
    EXPECT_EQ((*again)[i].face_probabilities, (*forecasts)[i].face_probabilities);
    EXPECT_EQ((*again)[i].place, (*forecasts)[i].place);
    EXPECT_EQ((*again)[i].region_mass, (*forecasts)[i].region_mass);
  }
}

TEST(CubeTosses, MeasuresLengthsAndGravity) {
  CubeModel model = shipped_cube_model();
  const std::vector<CubeToss> tosses = made_tosses(model, 6);
  const auto measured = measure_cube(tosses, model);
  ASSERT_TRUE(measured.ok());
  EXPECT_NEAR(measured->half_edge, model.half_edge, 2e-5);
  // Frames fall on the next step of 1 ms, which is 0.3 ms late on average.
  EXPECT_NEAR(measured->gravity, model.gravity, 0.02);
}

TEST(CubeTosses, CalibrationFindsTheFrictionThatItWasMadeWith) {
  CubeModel model = shipped_cube_model();
  model.step = 1.0 / 240.0;
  model.friction_noise = 0.0;
  const std::vector<CubeToss> tosses = made_tosses(model, 12);
  CubeModel wrong = model;
  wrong.sliding_friction += 0.06;
  core::ThreadPool threads(1);
  const auto found = calibrate_cube(tosses, wrong, 3, 8, 25, threads);
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_NEAR(found->model.sliding_friction, model.sliding_friction, 0.03);
}

TEST(CubeTosses, SplitsByPlaceInTheList) {
  std::vector<CubeToss> tosses(5);
  for (int i = 0; i < 5; ++i) tosses[static_cast<std::size_t>(i)].number = 10 + i;
  EXPECT_EQ(select(tosses, CubeSplit::kCalibrate).size(), 3u);
  EXPECT_EQ(select(tosses, CubeSplit::kReport).front().number, 11);
  EXPECT_EQ(select(tosses, CubeSplit::kAll).size(), 5u);
}

TEST(CubeTosses, ReportHasTheKeysOfTheEvaluator) {
  CubeForecast forecast;
  forecast.face_probabilities = {0.9, 0.02, 0.02, 0.02, 0.02, 0.02};
  forecast.place = {0.03, 0.04};
  forecast.region_mass = 0.6;
  const nlohmann::ordered_json json = to_json(report_of({forecast}));
  EXPECT_EQ(json.dump(), R"({"n":1,"right_face_share":1.0,"brier":)" +
                             nlohmann::json(brier_score(forecast.face_probabilities, 0)).dump() + R"(,"log_score":)" +
                             nlohmann::json(std::log(0.9)).dump() +
                             R"(,"median_xy_error_m":0.05,"p90_xy_error_m":0.05,"coverage_50":0.0,"coverage_90":1.0})");
}

TEST(CubeTosses, BrokenFilesAreNamedWithTheirLine) {
  const tests::ScratchDir scratch;
  core::ThreadPool threads(1);
  const auto status_of = [&](const std::string& text) {
    std::ofstream(scratch.path() / "tosses_even.csv") << text;
    return evaluate_cube_tosses(scratch.path(), CubeSplit::kAll, 1, threads).status();
  };
  EXPECT_EQ(evaluate_cube_tosses(scratch.path(), CubeSplit::kAll, 1, threads).status().code(),
            core::StatusCode::kNotFound);
  const std::string header = "toss,row,t_s,x_m,y_m,z_m,qw,qx,qy,qz,vx_mps\n";
  EXPECT_THAT(status_of("a,b\n").message(), testing::HasSubstr("line 1"));
  EXPECT_THAT(status_of(header).message(), testing::HasSubstr("no toss"));
  EXPECT_THAT(status_of(header + "0,0,0.0,0.1,0.1,0.2,1,0,0,x,0\n").message(), testing::HasSubstr("line 2"));
  EXPECT_THAT(status_of(header + "0,0,0.0,0.1,0.1,0.2,2,0,0,0,0\n").message(), testing::HasSubstr("norm"));
  EXPECT_THAT(status_of(header + "0,0,0.0,0.1,0.1,0.2,1,0,0,0,0\n0,1,0.0,0.1,0.1,0.2,1,0,0,0,0\n").message(),
              testing::HasSubstr("line 3"));
  EXPECT_THAT(status_of(header + "0,0,0.0,0.1,0.1,0.2,1,0,0,0,0\n").message(), testing::HasSubstr("too short"));
}

}  // namespace
}  // namespace prescene::service
