// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/final_poses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>

#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "prescene/queries/merge_components.h"

namespace prescene::queries {
namespace {

using belief::PoseComponent;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Vector3d;
using geometry::Vector6d;

const std::vector<std::string> kNames = {"left", "right"};

/// Two humps half a metre apart, each its own outcome, with turns about the vertical.
std::vector<FinalSample> two_humps(int count) {
  const core::SobolNet net(4, 5);
  std::vector<FinalSample> samples;
  std::vector<double> u(4);
  for (int i = 0; i < count; ++i) {
    net.point(static_cast<std::uint64_t>(i), u);
    FinalSample sample;
    sample.outcome = u[0] < 0.3 ? 0 : 1;
    sample.weight = 1.0 / count;
    sample.X_WO.translation = {(sample.outcome == 0 ? -0.25 : 0.25) + 0.05 * core::inverse_normal_cdf(u[1]),
                               0.03 * core::inverse_normal_cdf(u[2]), 0.1};
    sample.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 0.2 * core::inverse_normal_cdf(u[3])});
    samples.push_back(sample);
  }
  return samples;
}

/// Share of an outcome, and mean and covariance of all positions, of components.
struct Moments {
  std::map<std::string, double> mass;
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};
Moments moments_of(const std::vector<PoseComponent>& components) {
  Moments moments;
  for (const PoseComponent& c : components) {
    moments.mass[c.outcome] += c.weight;
    moments.mean += c.weight * c.mean.translation;
  }
  for (const PoseComponent& c : components) {
    const Vector3d d = c.mean.translation - moments.mean;
    moments.covariance += c.weight * (c.covariance.bottomRightCorner<3, 3>() + d * d.transpose());
  }
  return moments;
}

std::vector<PoseComponent> components_of(const std::vector<Kernel>& kernels) {
  std::vector<PoseComponent> components;
  for (const Kernel& kernel : kernels) components.push_back(kernel.component);
  return components;
}

TEST(Kernels, AreAsWideAsTheRuleSays) {
  const std::vector<FinalSample> samples = two_humps(512);
  const std::vector<Kernel> all = kernels(samples, kNames, {}, {});
  double count = 0.0, sum = 0.0, squares = 0.0;
  for (const FinalSample& sample : samples) {
    if (sample.outcome != 1) continue;
    count += 1.0;
    sum += sample.X_WO.translation.x();
    squares += sample.X_WO.translation.x() * sample.X_WO.translation.x();
  }
  const double spread = std::sqrt(squares / count - sum / count * sum / count);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(all[i].component.outcome, kNames[static_cast<std::size_t>(samples[i].outcome)]);
    if (samples[i].outcome != 1) continue;
    EXPECT_NEAR(std::sqrt(all[i].component.covariance(3, 3)), 0.6 * spread * std::pow(count, -1.0 / 6.0), 1e-9);
  }
}

TEST(Kernels, StandingAndLyingAreNotSmoothedTogether) {
  std::vector<FinalSample> samples(4);
  for (std::size_t i = 0; i < 4; ++i) {
    samples[i].weight = 0.25;
    samples[i].X_WO.translation.x() = i < 2 ? 0.001 * static_cast<double>(i) : 1.0;
    if (i >= 2) samples[i].X_WO.rotation = geometry::exp_rotation({M_PI / 2, 0.0, 0.0});
  }
  const std::vector<Kernel> all = kernels(samples, kNames, {}, {});
  EXPECT_NE(all[0].group, all[2].group);
  for (const Kernel& kernel : all) EXPECT_LT(std::sqrt(kernel.component.covariance(3, 3)), 0.002);
}

TEST(Kernels, PlacesFarApartAreAsWideAsEachAlone) {
  // What one hump's instances give does not depend on another place that the same outcome has far away.
  std::vector<FinalSample> samples = two_humps(512);
  const std::vector<Kernel> apart = kernels(samples, kNames, {}, {});
  for (FinalSample& sample : samples) sample.outcome = 0;
  for (const Vector3d& shift : {Vector3d(0.5, 0.0, 0.0), Vector3d(0.0, 1.0, 0.0), Vector3d(0.5, -0.5, 0.3)}) {
    std::vector<FinalSample> moved = samples;
    for (std::size_t i = 0; i < moved.size(); ++i)
      if (apart[i].component.outcome == kNames[1]) moved[i].X_WO.translation += shift;
    const std::vector<Kernel> together = kernels(moved, kNames, {}, {});
    for (std::size_t i = 0; i < moved.size(); ++i) {
      EXPECT_LT((together[i].component.covariance - apart[i].component.covariance).norm(), 1e-9);
      EXPECT_EQ(together[i].group, 0) << "they may still be merged";
    }
  }
}

TEST(Kernels, OneHumpIsNeverSplit) {
  // Normal, uniform and heavy-tailed ends of few and of many instances keep one width each.
  for (const int count : {8, 20, 64, 512, 4096}) {
    const core::SobolNet net(1, 7);
    for (int shape = 0; shape < 3; ++shape) {
      std::vector<FinalSample> samples(static_cast<std::size_t>(count));
      std::vector<double> u(1);
      for (int i = 0; i < count; ++i) {
        net.point(static_cast<std::uint64_t>(i), u);
        FinalSample& sample = samples[static_cast<std::size_t>(i)];
        sample.weight = 1.0 / count;
        sample.X_WO.translation.x() = shape == 0   ? 0.05 * core::inverse_normal_cdf(u[0])
                                      : shape == 1 ? 0.1 * u[0]
                                                   : -0.05 * std::log(u[0] + 1e-12);
      }
      const std::vector<Kernel> all = kernels(samples, kNames, {}, {});
      for (const Kernel& kernel : all)
        EXPECT_EQ(kernel.component.covariance, all.front().component.covariance) << count << " of shape " << shape;
    }
  }
}

TEST(Kernels, SymmetricEquivalentsAreNoSpread) {
  std::vector<FinalSample> samples(8);
  for (std::size_t i = 0; i < 8; ++i) {
    samples[i].weight = 0.125;
    samples[i].X_WO.rotation =
        geometry::exp_rotation({0.0, 0.0, M_PI / 2 * static_cast<double>(i % 4) + 0.01 * static_cast<double>(i / 4)});
  }
  const auto symmetry = geometry::SymmetryGroup::cyclic(Vector3d::UnitZ(), 4);
  for (const Kernel& kernel : kernels(samples, kNames, symmetry, {}))
    EXPECT_LT(std::sqrt(kernel.component.covariance(2, 2)), 0.02);
  for (const Kernel& kernel : kernels(samples, kNames, {}, {}))
    EXPECT_GT(std::sqrt(kernel.component.covariance(2, 2)), 0.3);
}

TEST(HeatMap, SumsToOneAndHasTheRightMean) {
  const std::vector<FinalSample> samples = two_humps(300);
  const belief::HeatMap map = heat_map(kernels(samples, kNames, {}, {}), {});
  EXPECT_EQ(map.cell, 0.02);
  EXPECT_EQ(map.mass.size(), static_cast<std::size_t>(map.nx * map.ny));
  EXPECT_NEAR(std::accumulate(map.mass.begin(), map.mass.end(), 0.0), 1.0, 1e-12);
  double x = 0.0, y = 0.0, between = 0.0;
  for (int iy = 0; iy < map.ny; ++iy) {
    for (int ix = 0; ix < map.nx; ++ix) {
      const double mass = map.mass[static_cast<std::size_t>(iy * map.nx + ix)];
      const double cx = map.x0 + (ix + 0.5) * map.cell;
      EXPECT_GE(mass, 0.0);
      x += mass * cx;
      y += mass * (map.y0 + (iy + 0.5) * map.cell);
      if (std::abs(cx) < 0.03) between += mass;
    }
  }
  EXPECT_NEAR(x, 0.7 * 0.25 - 0.3 * 0.25, 0.003);
  EXPECT_NEAR(y, 0.0, 0.003);
  EXPECT_LT(between, 1e-4);  // a kernel as wide as the spread over both outcomes would put a tenth of the mass there
}

TEST(HeatMap, BeatsCountingInCells) {
  // Against the exact masses of the two humps, 256 instances: total variation of kernels and of the raw histogram.
  const std::vector<FinalSample> samples = two_humps(256);
  const belief::HeatMap map = heat_map(kernels(samples, kNames, {}, {}), {});
  std::vector<double> raw(map.mass.size(), 0.0);
  for (const FinalSample& sample : samples) {
    const int ix = static_cast<int>((sample.X_WO.translation.x() - map.x0) / map.cell);
    const int iy = static_cast<int>((sample.X_WO.translation.y() - map.y0) / map.cell);
    raw[static_cast<std::size_t>(iy * map.nx + ix)] += sample.weight;
  }
  const auto normal_mass = [](double low, double high, double mean, double sigma) {
    return core::normal_cdf((high - mean) / sigma) - core::normal_cdf((low - mean) / sigma);
  };
  double smooth_error = 0.0, raw_error = 0.0;
  for (int iy = 0; iy < map.ny; ++iy) {
    for (int ix = 0; ix < map.nx; ++ix) {
      const double x = map.x0 + ix * map.cell, y = map.y0 + iy * map.cell;
      const double truth = normal_mass(y, y + map.cell, 0.0, 0.03) * (0.3 * normal_mass(x, x + map.cell, -0.25, 0.05) +
                                                                      0.7 * normal_mass(x, x + map.cell, 0.25, 0.05));
      const auto i = static_cast<std::size_t>(iy * map.nx + ix);
      smooth_error += 0.5 * std::abs(map.mass[i] - truth);
      raw_error += 0.5 * std::abs(raw[i] - truth);
    }
  }
  EXPECT_LT(smooth_error, 0.5 * raw_error) << smooth_error << " " << raw_error;
}

TEST(HeatMap, FarOutliersCoarsenTheCellsAndLoseNothing) {
  std::vector<FinalSample> samples = two_humps(64);
  samples[5].X_WO.translation.x() = 100.0;
  const belief::HeatMap map = heat_map(kernels(samples, kNames, {}, {}), {});
  EXPECT_LE(map.nx, 512);
  EXPECT_LE(map.ny, 512);
  EXPECT_NEAR(std::accumulate(map.mass.begin(), map.mass.end(), 0.0), 1.0, 1e-12);
}

TEST(Merging, KeepsMassMeanAndCovariance) {
  core::ThreadPool pool(2);
  for (int count : {40, 256, 1500}) {
    std::vector<Kernel> all = kernels(two_humps(count), kNames, {}, {});
    const Moments before = moments_of(components_of(all));
    const std::vector<PoseComponent> few = merged(std::move(all), {}, pool);
    const Moments after = moments_of(few);
    EXPECT_LE(few.size(), 32u);
    EXPECT_GE(few.size(), 2u);
    for (const std::string& name : kNames) EXPECT_NEAR(after.mass.at(name), before.mass.at(name), 1e-12);
    EXPECT_LT((after.mean - before.mean).norm(), 1e-12);
    EXPECT_LT((after.covariance - before.covariance).norm(), 1e-12);
    for (std::size_t i = 1; i < few.size(); ++i) EXPECT_GE(few[i - 1].weight, few[i].weight);
  }
}

TEST(Merging, EqualComponentsBecomeOne) {
  core::ThreadPool pool(1);
  std::vector<Kernel> equal(7);
  for (Kernel& kernel : equal) kernel.component = {1.0 / 7.0, "left", Pose{}, Matrix6d::Identity()};
  const std::vector<PoseComponent> one = merged(equal, {}, pool);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(one[0].weight, 1.0, 1e-12);
  EXPECT_LT((one[0].covariance - Matrix6d::Identity()).norm(), 1e-12);
}

TEST(Merging, NeverJoinsGroupsHoweverMany) {
  core::ThreadPool pool(1);
  std::vector<Kernel> apart(40);
  for (std::size_t i = 0; i < apart.size(); ++i) {
    apart[i].component = {1.0 / 40.0, "left", Pose{}, Matrix6d::Identity()};
    apart[i].group = static_cast<int>(i);
  }
  EXPECT_EQ(merged(apart, {}, pool).size(), 40u);
}

TEST(Merging, LightComponentsGoToAnotherOfTheirGroup) {
  core::ThreadPool pool(1);
  std::vector<Kernel> kernels(3);
  kernels[0].component = {0.99995, "left", Pose{}, 1e-4 * Matrix6d::Identity()};
  kernels[1].component = {4e-5, "left", Pose::from_translation({5.0, 0.0, 0.0}), 1e-4 * Matrix6d::Identity()};
  kernels[2].component = {1e-5, "right", Pose{}, 1e-4 * Matrix6d::Identity()};
  kernels[2].group = 1;
  DensityOptions options;
  options.merge_below = 0.0;
  const std::vector<PoseComponent> kept = merged(kernels, options, pool);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_NEAR(kept[0].weight, 0.99999, 1e-12);
  EXPECT_EQ(kept[1].outcome, "right");  // alone in its outcome: it stays, however light
}

TEST(FinalPoses, SameBitsForAnyNumberOfThreads) {
  core::ThreadPool one(1), many(6);
  const std::vector<FinalSample> samples = two_humps(1000);
  EXPECT_EQ(final_poses("carton", samples, kNames, {}, {}, one), final_poses("carton", samples, kNames, {}, {}, many));
}

}  // namespace
}  // namespace prescene::queries
