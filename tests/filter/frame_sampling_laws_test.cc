// SPDX-License-Identifier: Apache-2.0
// Small things are seen in more pixels, near ones in as many as before.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "filter_fixture.h"
#include "prescene/filter/proposals/frame_sampling.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::TrackState;

belief::Observation frame_of(int width, double focal) {
  belief::Observation observation;
  observation.frame.camera = {.width = width,
                              .height = static_cast<int>(0.75 * width),
                              .fx = focal,
                              .fy = focal,
                              .cx = 0.5 * (width - 1),
                              .cy = 0.5 * (0.75 * width - 1)};
  return observation;
}

/// Cubes on the axis of the camera, each of its edge (m) at its distance.
Belief cubes_before(Backends& backends, const std::vector<std::pair<double, double>>& edges_and_distances) {
  std::vector<belief::ObjectModel> models;
  std::vector<Pose> poses;
  for (const auto& [edge, distance] : edges_and_distances) {
    models.push_back(box_model("cube " + std::to_string(models.size()), Vector3d::Constant(edge)));
    poses.push_back(Pose::from_translation({0.0, 0.0, distance}));
  }
  const auto scene = table_scene(std::move(models), poses, 0.001, 0.01);
  Belief belief = backends.make_filter().start(scene, 1);
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    belief.objects[i].state = TrackState::kTracked;
    for (belief::Particle& particle : belief.objects[i].particles) particle.X_WO = poses[i];
  }
  return belief;
}

int sampled_columns(const Belief& belief, const belief::Observation& observation, const FrameOptions& options,
                    MeshCache& meshes) {
  return sampled_for(belief, observation, options, meshes).terms.target_width;
}

/// 3/2 of the square of the edge is the mean of a cube's shadow over all turns.
double pixels_on_cube(double edge, double distance, int width, double focal, int sampled) {
  const double step = std::round(static_cast<double>(width) / sampled);
  return 1.5 * std::pow(edge * focal / distance / step, 2);
}

TEST(FrameSampling, TheSmallestThingCoversEnoughPixelsOrNoFinerImageIsTaken) {
  Backends backends(1);
  const FrameOptions options;
  for (const int width : {320, 384, 640, 848, 1280, 1920})
    for (const double edge : {0.02, 0.05, 0.1, 0.3})
      for (const double distance : {0.4, 0.7, 1.0, 1.5, 2.5}) {
        const double focal = 0.9 * width;
        const Belief belief = cubes_before(backends, {{0.1, 0.6}, {edge, distance}});
        const int sampled = sampled_columns(belief, frame_of(width, focal), options, backends.meshes);
        const int coarse = options.terms.target_width;
        EXPECT_GE(sampled, coarse);
        const double step = std::round(static_cast<double>(width) / sampled);
        const double covered = pixels_on_cube(edge, distance, width, focal, sampled);
        EXPECT_LE(sampled, 320);
        const bool is_finest = step <= 4.0 || 2 * sampled > 320;
        EXPECT_TRUE(covered >= options.enough_pixels || is_finest) << width << " " << edge << " " << distance;
        // And no more than that takes.
        if (sampled > coarse && !is_finest) {
          EXPECT_LT(covered, 5.0 * options.enough_pixels);
        }
      }
}

TEST(FrameSampling, OnlyHowLargeThingsAppearMatters) {
  Backends backends(1);
  for (const double scale : {0.1, 0.5, 3.0, 20.0}) {
    const Belief one = cubes_before(backends, {{0.05, 1.1}}),
                 other = cubes_before(backends, {{0.05 * scale, 1.1 * scale}});
    EXPECT_EQ(sampled_columns(one, frame_of(640, 570.0), {}, backends.meshes),
              sampled_columns(other, frame_of(640, 570.0), {}, backends.meshes));
  }
}

TEST(FrameSampling, WhatIsNotInSightDoesNotCount) {
  Backends backends(1);
  const FrameOptions options;
  const belief::Observation observation = frame_of(640, 570.0);
  const int coarse = options.terms.target_width;
  Belief belief = cubes_before(backends, {{0.2, 0.6}, {0.02, 1.5}});
  EXPECT_GT(sampled_columns(belief, observation, options, backends.meshes), coarse);
  const auto with_second = [&](TrackState state, const Vector3d& place) {
    Belief changed = belief;
    changed.objects[1].state = state;
    for (belief::Particle& particle : changed.objects[1].particles) particle.X_WO = Pose::from_translation(place);
    return sampled_columns(changed, observation, options, backends.meshes);
  };
  EXPECT_EQ(with_second(TrackState::kLost, {0.0, 0.0, 1.5}), coarse);
  EXPECT_EQ(with_second(TrackState::kUnseen, {0.0, 0.0, 1.5}), coarse);
  EXPECT_EQ(with_second(TrackState::kTracked, {0.0, 0.0, -1.5}), coarse);
  EXPECT_EQ(with_second(TrackState::kTracked, {3.0, 0.0, 1.5}), coarse);
  belief.objects.clear();
  EXPECT_EQ(sampled_columns(belief, observation, options, backends.meshes), coarse);
}

TEST(FrameSampling, ManyPixelsOnAllThingsTogetherKeepItCoarse) {
  Backends backends(1);
  const FrameOptions options;
  std::vector<std::pair<double, double>> cubes(20, {0.3, 0.5});
  cubes.emplace_back(0.02, 1.5);
  EXPECT_EQ(sampled_columns(cubes_before(backends, cubes), frame_of(640, 570.0), options, backends.meshes),
            options.terms.target_width);
}

TEST(FrameSampling, CamerasThatCannotBeDoNotMatter) {
  Backends backends(1);
  const Belief belief = cubes_before(backends, {{0.05, 1.0}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const int width : {-1, 0, 1, 100'000, std::numeric_limits<int>::max()})
    for (const double focal : {nan, 0.0, -5.0, 1e300}) {
      belief::Observation observation = frame_of(width, focal);
      EXPECT_GE(sampled_columns(belief, observation, {}, backends.meshes), 1);
    }
  belief::Observation lost = frame_of(640, 570.0);
  lost.X_WC.translation.x() = nan;
  EXPECT_EQ(sampled_columns(belief, lost, {}, backends.meshes), FrameOptions().terms.target_width);
}

TEST(FrameSampling, FinerImagesTellNoMore) {
  Backends backends(1);
  const FrameOptions options;
  const double usual = 8.0, area = usual * usual;
  for (const double edge : {0.02, 0.05, 0.3}) {
    const FrameSampling sampling =
        sampled_for(cubes_before(backends, {{edge, 1.0}}), frame_of(640, 570.0), options, backends.meshes);
    const rendering::FrameTermsOptions& terms = sampling.terms;
    const int step = 640 / terms.target_width;
    EXPECT_EQ(sampling.density, area / (step * step));
    for (const double pixels : {5.0, 80.0, 700.0}) {
      const double as_many = pixels * area / (step * step);
      EXPECT_NEAR(as_many * rendering::tempering(terms.tempering.weight, as_many, step),
                  pixels * rendering::tempering(options.terms.tempering.weight, pixels, 8), 1e-9 * as_many);
      EXPECT_NEAR(as_many * rendering::tempering(terms.tempering.information, as_many, step),
                  pixels * rendering::tempering(options.terms.tempering.information, pixels, 8), 1e-9 * as_many);
    }
  }
}

// A cube of 3 cm at 1.3 m covers some 10 of 80 x 60 pixels.
TEST(FrameSampling, ASmallThingIsFollowedBetter) {
  Backends backends;
  const Pose X_WO = Pose::from_translation({0.0, 0.25, 0.12});
  SimulatedSequence sequence = still_sequence({box_model("die", {0.03, 0.025, 0.03})}, {X_WO});
  sequence.camera = frame_of(640, 570.0).frame.camera;
  const auto median_error = [&](double enough_pixels) {
    FilterSettings settings;
    settings.frame.enough_pixels = enough_pixels;
    ParticleFilter filter = backends.make_filter(settings);
    std::vector<double> errors;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      sequence.seed = seed;
      sequence.objects = {wandering(X_WO, 0.1, 0.5, seed)};
      Belief belief = filter.start(sequence.scene, seed);
      for (int frame = 0; frame < 25; ++frame) {
        belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
        const Pose truth = sequence.objects[0](sequence.time_of(frame));
        errors.push_back((belief::estimate(belief.objects[0]).mode.translation - truth.translation).norm());
      }
    }
    std::nth_element(errors.begin(), errors.begin() + 50, errors.end());
    return errors[50];
  };
  EXPECT_LT(median_error(FrameOptions().enough_pixels), 0.8 * median_error(0.0));
}

}  // namespace
}  // namespace prescene::filter_tests
