// SPDX-License-Identifier: Apache-2.0
// The noise found in simulated recordings is the one that they were simulated with.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "prescene/geometry/primitives.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/service/calibration/depth_noise.h"

namespace prescene::service {
namespace {

using geometry::Pose;
using geometry::Vector3d;

/// A wall, boxes before it, and a board at a steep slant, seen by a simulated camera.
class DepthNoiseTest : public testing::Test {
 protected:
  static rendering::RenderInstance box(const Vector3d& size, const Vector3d& p, const Vector3d& turn) {
    return {rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{size})),
            {geometry::exp_rotation(turn), p},
            {}};
  }

  DepthNoiseTest() {
    scene_.instances = {box({6, 4, 0.1}, {0, 0, 1.85}, {0, 0, 0}), box({0.3, 0.3, 0.2}, {-0.45, -0.15, 1.0}, {0, 0, 0}),
                        box({0.16, 0.16, 0.2}, {-0.35, 0.3, 1.3}, {0, 0, 0}),
                        box({1.2, 0.6, 0.01}, {0.35, 0.0, 1.2}, {0, 1.25, 0})};
  }

  core::Result<DepthNoise> measure(
      const rendering::SensorModelOptions& sensor, const rendering::SimulatedCameraOptions& options, int frames,
      const std::function<double(int)>& shift_of = [](int) { return 0.0; }) {
    const rendering::SimulatedCamera simulated(rendering::SensorModel(sensor), options);
    const auto renderer = rendering::make_reference_renderer();
    rendering::RenderOptions with_normals;
    with_normals.normals = true;
    DepthNoiseEstimator estimator;
    for (int frame = 0; frame < frames; ++frame) {
      const Pose X_WC = Pose::from_translation({shift_of(frame), 0.0, 0.0});
      rendering::RenderedView view;
      EXPECT_TRUE(renderer->render(scene_, camera_, X_WC, with_normals, &view).ok());
      geometry::DepthImage depth;
      simulated.sample(scene_, view, nullptr, camera_, X_WC, core::RandomStream(7, core::Purpose::kSensorNoise),
                       static_cast<std::uint64_t>(frame), &depth, nullptr);
      const core::Status added = estimator.add(depth, camera_);
      EXPECT_TRUE(added.ok()) << added.message();
    }
    return estimator.finish();
  }

  static bool found(const DepthNoise& noise, const std::string& name) {
    return std::find(noise.found.begin(), noise.found.end(), name) != noise.found.end();
  }

  rendering::RenderScene scene_;
  geometry::PinholeCamera camera_{320, 240, 290.0, 290.0, 159.5, 119.5};
};

TEST_F(DepthNoiseTest, FindsWhatTheCameraWasSimulatedWith) {
  for (const double s : {0.0038, 0.0020}) {
    rendering::SensorModelOptions sensor;
    sensor.sigma_per_depth_squared = s;
    const auto noise = measure(sensor, {}, 40);
    ASSERT_TRUE(noise.ok()) << noise.status().message();
    EXPECT_EQ(noise->frames, 40);
    // 40 frames tell a deviation to 11 % a pixel, the middle of a thousand patches far better; steps of 0.0013 add
    // 0.0013 / sqrt(12) in squares: 0.5 and 2 %.
    EXPECT_NEAR(noise->sigma_over_time, std::sqrt(0.75) * s, 0.05 * s);
    EXPECT_TRUE(found(*noise, "sigma_per_depth_squared"));
    EXPECT_NEAR(noise->settings.sigma_per_depth_squared, s, 0.06 * s);
    ASSERT_GE(noise->by_depth.size(), 2u);
    for (const DepthNoiseClass& c : noise->by_depth) {
      if (c.pixels > 500) {
        EXPECT_NEAR(c.sigma, std::sqrt(0.75) * s, 0.10 * s) << c.limit;
      }
    }
    // Patches of missing returns: some 500 a frame, 40 frames, 3 % of them: 0.12 points of standard error.
    EXPECT_NEAR(noise->missing, 0.03, 0.01);
    EXPECT_NEAR(noise->outliers, 0.01, 0.006);
    ASSERT_TRUE(noise->quantisation_per_depth_squared.has_value());
    EXPECT_NEAR(*noise->quantisation_per_depth_squared, 0.0013, 0.0002);
  }
}

TEST_F(DepthNoiseTest, FindsHowNoiseAndHolesGrowWithIncidenceAndTowardsEdges) {
  const auto noise = measure({}, {}, 60);
  ASSERT_TRUE(noise.ok()) << noise.status().message();
  EXPECT_TRUE(found(*noise, "incidence_knee"));
  EXPECT_NEAR(noise->settings.incidence_knee, 0.6, 0.09);
  // The board's slant changes over the picture, so that classes' shares are of pixels near their limits, too.
  const rendering::SensorModelOptions truth;
  for (std::size_t i = 0; i < 3; ++i) {
    if (found(*noise, "incidence_missing[" + std::to_string(i) + "]")) {
      EXPECT_NEAR(noise->settings.incidence_missing[i], truth.incidence_missing[i], 0.06) << i;
    }
  }
  int edges = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (!found(*noise, "outline_missing[" + std::to_string(i) + "]")) continue;
    ++edges;
    EXPECT_NEAR(noise->settings.outline_missing[i], truth.outline_missing[i], 0.08) << i;
  }
  EXPECT_GE(edges, 3);
  EXPECT_FALSE(noise->remarks.empty());
  const auto json = to_json(*noise);
  EXPECT_EQ(json["settings"]["incidence_knee"], noise->settings.incidence_knee);
  EXPECT_EQ(json["frames"], 60);
}

TEST_F(DepthNoiseTest, AnotherFixedShareIsNotTold) {
  // The same noise over time, whatever stays: what the setting assumes, the remarks say.
  rendering::SimulatedCameraOptions camera;
  camera.fixed_pattern_share = 0.0;
  camera.correlated_share = 0.5;
  const auto noise = measure({}, camera, 30);
  ASSERT_TRUE(noise.ok()) << noise.status().message();
  EXPECT_NEAR(noise->sigma_over_time, 0.0038, 0.05 * 0.0038);
  EXPECT_GT(noise->settings.sigma_per_depth_squared, 1.1 * 0.0038);
  EXPECT_TRUE(std::any_of(noise->remarks.begin(), noise->remarks.end(),
                          [](const std::string& r) { return r.find("calibration") != std::string::npos; }));
}

TEST_F(DepthNoiseTest, RefusesWhatMoves) {
  const std::function<double(int)> shifts[] = {[](int frame) { return 0.004 * frame; },
                                               // There and back again.
                                               [](int frame) { return frame >= 8 && frame < 16 ? 0.05 : 0.0; }};
  for (const auto& shift : shifts) {
    const auto noise = measure({}, {}, 24, shift);
    ASSERT_FALSE(noise.ok());
    EXPECT_NE(noise.status().message().find("moves"), std::string::npos) << noise.status().message();
  }
}

TEST_F(DepthNoiseTest, TakesNoNoiseForMotion) {
  for (const double s : {0.004, 0.008, 0.02}) {
    for (const int frames : {12, 13, 40}) {
      rendering::SensorModelOptions sensor;
      sensor.sigma_per_depth_squared = s;
      const auto noise = measure(sensor, {}, frames);
      ASSERT_TRUE(noise.ok()) << s << ", " << frames << " frames: " << noise.status().message();
    }
  }
}

TEST_F(DepthNoiseTest, RefusesTooFewFramesAndViewsWithoutSurfaces) {
  const auto few = measure({}, {}, 5);
  ASSERT_FALSE(few.ok());
  EXPECT_NE(few.status().message().find("5 depth images"), std::string::npos);
  scene_.instances.clear();
  const auto empty = measure({}, {}, 15);
  ASSERT_FALSE(empty.ok());
  EXPECT_NE(empty.status().message().find("wall"), std::string::npos);
  DepthNoiseEstimator estimator;
  EXPECT_FALSE(estimator.add(geometry::DepthImage(10, 10, 1.0f), camera_).ok());
}

}  // namespace
}  // namespace prescene::service
