// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/heat_map_picture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/service/load_scene.h"
#include "prescene/service/pictures/ground_density.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;

belief::PoseComponent blob(double weight, double x, double y, const Eigen::Matrix2d& covariance) {
  belief::PoseComponent component;
  component.weight = weight;
  component.mean.translation = {x, y, 0.0};
  component.covariance.block<2, 2>(3, 3) = covariance;
  return component;
}

Eigen::Matrix2d wide(double sx, double sy) { return Eigen::Vector2d(sx * sx, sy * sy).asDiagonal().toDenseMatrix(); }

/// Of a normal variable: P(low < X < high).
double between(double mean, double sigma, double low, double high) {
  const auto cdf = [&](double x) { return 0.5 * std::erfc((mean - x) / (sigma * std::sqrt(2.0))); };
  return cdf(high) - cdf(low);
}

TEST(GroundDensity, TheMassOfASquareIsItsIntegral) {
  const std::vector<belief::PoseComponent> blobs{blob(0.7, 0.1, 0.0, wide(0.01, 0.03)),
                                                 blob(0.3, 0.15, 0.05, wide(0.05, 0.02))};
  const GroundDensity density(blobs, Vector2d(-0.3, -0.3), Vector2d(0.6, 0.6), 0.02);
  for (const Vector2d& p : {Vector2d(0.1, 0.0), Vector2d(0.115, 0.02), Vector2d(0.15, 0.05), Vector2d(0.0, 0.1)}) {
    const double expected =
        0.7 * between(0.1, 0.01, p.x() - 0.01, p.x() + 0.01) * between(0.0, 0.03, p.y() - 0.01, p.y() + 0.01) +
        0.3 * between(0.15, 0.05, p.x() - 0.01, p.x() + 0.01) * between(0.05, 0.02, p.y() - 0.01, p.y() + 0.01);
    EXPECT_NEAR(density.mass_around(p.x(), p.y()), expected, 0.03 * 0.7 * 0.7);
  }
}

TEST(GroundDensity, NoSquareHoldsMoreThanAll) {
  // However narrow a blob is, and on a grid far coarser than it: all of it lies in the square around it.
  for (const double sigma : {1e-6, 1e-4, 1e-3}) {
    for (const double extent : {0.05, 0.5, 2.0}) {
      const std::vector<belief::PoseComponent> one{blob(1.0, 0.003, -0.001, wide(sigma, sigma))};
      const GroundDensity density(one, Vector2d::Constant(-extent), Vector2d::Constant(extent), 0.02);
      EXPECT_LE(density.largest_mass(), 1.0) << sigma << " " << extent;
      EXPECT_GT(density.largest_mass(), 0.9) << sigma << " " << extent;
    }
  }
}

TEST(GroundDensity, ACorrelatedBlobKeepsItsMass) {
  Eigen::Matrix2d covariance;
  covariance << 1e-4, 0.99e-4, 0.99e-4, 1e-4;
  const std::vector<belief::PoseComponent> one{blob(1.0, 0.0, 0.0, covariance)};
  const GroundDensity density(one, Vector2d::Constant(-0.1), Vector2d::Constant(0.1), 0.2);
  EXPECT_NEAR(density.mass_around(0.0, 0.0), 1.0, 2e-3);
  // Along its diagonal lies more than across it.
  const GroundDensity fine(one, Vector2d::Constant(-0.1), Vector2d::Constant(0.1), 0.005);
  EXPECT_GT(fine.mass_around(0.01, 0.01), 10.0 * fine.mass_around(0.01, -0.01));
}

TEST(GroundDensity, ARectangleHoldsEveryDensePlace) {
  // 1 % of the ends, but within a millimetre: denser than anything else, so the lines go around it.
  const std::vector<belief::PoseComponent> blobs{blob(0.99, 0.0, 0.0, wide(0.1, 0.1)),
                                                 blob(0.01, 1.0, 0.5, wide(0.001, 0.001))};
  const GroundDensity density(blobs, Vector2d::Constant(-1.0), Vector2d::Constant(2.0), 0.02);
  ASSERT_GT(density.at(1.0, 0.5), density.level_of(0.9));
  const auto rectangle = density.rectangle_of(0.98);
  ASSERT_TRUE(rectangle);
  EXPECT_GT(rectangle->high.x(), 1.0);
  EXPECT_GT(rectangle->high.y(), 0.5);
  EXPECT_LT(rectangle->low.x(), -0.15);
  EXPECT_FALSE(GroundDensity({}, Vector2d::Constant(-1.0), Vector2d::Constant(1.0), 0.02).rectangle_of(0.98));
}

/// Pixels in the colours of the map: far more red than blue.
int warm_pixels(const belief::Scene& scene, const belief::PredictAnswer& answer, Backends& backends) {
  const auto picture = heat_map_picture(scene, answer, backends);
  EXPECT_TRUE(picture.ok()) << picture.status().message();
  int warm = 0;
  for (int y = 150; y < 700; ++y)
    for (int x = 0; x < picture->width() / 2; ++x) warm += (*picture)(x, y)[0] > (*picture)(x, y)[2] + 60 ? 1 : 0;
  return warm;
}

TEST(HeatMapPicture, NeighboursHideNothing) {
  const auto loaded = load_scene_text(
      "name: pair\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\n  flat: {box: [0.3, 0.3, 0.02], mass: 0.4}\n"
      "supports:\n  floor: {ground: {size: 4}}\n"
      "objects:\n  a: {model: box, pose: {position: [0, 0, 0.05]}}\n"
      "  b: {model: flat, pose: {position: [0, 0, 0.11]}}\noutcomes:\n  stays: {object: a, below: 1}\n",
      "test.yaml", {});
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  const belief::Scene& scene = **loaded;
  belief::PredictAnswer answer;
  answer.outcomes = {{"stays", "", 1.0, 0.9, 1.0}};
  belief::FinalPoses& poses = answer.final_poses.emplace_back();
  poses.object = "a";
  poses.components = {blob(1.0, 0.0, 0.0, wide(0.02, 0.02))};
  poses.components[0].mean.translation.z() = 0.05;
  poses.components[0].outcome = "stays";
  poses.heat_map = {0.02, -0.1, -0.1, 10, 10, std::vector<double>(100, 0.01)};
  belief::TypicalRun& run = answer.typical_runs.emplace_back();
  run.outcome = "stays";
  run.share = 1.0;
  run.trajectory.states = {belief::mean_start(scene)};
  core::ThreadPool pool(2);
  Backends backends(pool);
  const int covered = warm_pixels(scene, answer, backends);
  run.trajectory.states[0].objects[1].X_WO.translation.x() = 3.0;
  const int open = warm_pixels(scene, answer, backends);
  EXPECT_GT(open, 2000);
  EXPECT_GT(covered, 0.5 * open);  // its edges, and the plate that the picture makes room for, take some
}

}  // namespace
}  // namespace prescene::service
