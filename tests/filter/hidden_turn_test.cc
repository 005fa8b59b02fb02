// SPDX-License-Identifier: Apache-2.0
// A turn that only a hidden part would tell stays as uncertain as the frames leave it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "filter_fixture.h"
#include "mug_with_handle.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/pose_search.h"
#include "prescene/geometry/primitives.h"

namespace prescene::filter_tests {
namespace {

using belief::Particle;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kPriorTurn = 20.0 * kDegree;
constexpr int kFrames = 4;

double turn_deviation(const Particle& particle) { return std::sqrt(particle.covariance(2, 2)); }

/// A mug whose round part has flat facets, as meshes have; its turn is known by its handle alone.
belief::ObjectModel faceted_mug() {
  belief::ObjectModel mug;
  mug.name = "mug";
  const auto body =
      std::make_shared<geometry::TriangleMesh>(geometry::make_lathe({{0.0354, -0.0467}, {0.0394, 0.0467}}));
  mug.collision.push_back(belief::MeshShape{body, Pose::identity()});
  for (const double height : {-0.0187, 0.0234})
    mug.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.022, 0.010, 0.012}},
                                                   Pose::from_translation({0.0474, 0.0, height})});
  mug.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{{0.010, 0.010, 0.054}}, Pose::from_translation({0.0624, 0.0, 0.0023})});
  mug.mass = belief::FixedScalar{0.3};
  return *belief::with_derived_properties(mug);
}

/// One particle of a mug that is seen in some frames, and the posterior of its turn on a grid of turns.
struct Watched {
  Particle particle;
  double exact_deviation = 0.0;
};

Watched watch_mug(double handle_angle, double start_off, std::uint64_t seed) {
  Backends backends;
  const Pose X_WO = mug_pose(handle_angle);
  SimulatedSequence sequence = still_sequence({faceted_mug()}, {X_WO});
  sequence.seed = seed;
  Pose start = X_WO;
  start.rotation = start.rotation * geometry::exp_rotation({0.0, 0.0, start_off});
  std::vector<Particle> particles =
      particles_about(start, belief::MotionMode::kMoving, 1, {}, {4, core::Purpose::kStartBelief});
  particles.front().X_WO = start;
  particles.front().covariance.diagonal().head<3>() = Vector3d(0.02, 0.02, kPriorTurn).cwiseAbs2();
  constexpr int kSteps = 91;  // 2 degrees each
  std::vector<double> log_posterior(kSteps, 0.0);
  const auto turn_at = [](int i) { return (i - kSteps / 2) * 2.0 * kDegree; };
  for (int i = 0; i < kSteps; ++i)
    log_posterior[static_cast<std::size_t>(i)] = -0.5 * std::pow((turn_at(i) - start_off) / kPriorTurn, 2);
  for (int number = 0; number < kFrames; ++number) {
    const belief::Observation observation = sequence.observe(number, *backends.renderer);
    const FilterFrame frame = backends.frame_of(sequence.scene, observation);
    const SearchTarget target = target_of(sequence.scene->models[0], frame, backends.tools);
    weight(frame.terms, target, frame.X_WC, 1.0 / 30.0, {}, backends.tools, {5, core::Purpose::kProposal}, particles,
           {.depth = observation.frame.depth.get(), .camera = observation.frame.camera});
    const double pixels = tempering_pixels(frame.terms, target, frame.X_CW * X_WO, backends.tools);
    const double share = rendering::tempering(frame.terms.tempering.weight, pixels, frame.terms.step);
    std::vector<rendering::PoseHypothesis> turned;
    for (int i = 0; i < kSteps; ++i) {
      Pose pose = X_WO;
      pose.rotation = pose.rotation * geometry::exp_rotation({0.0, 0.0, turn_at(i)});
      turned.push_back(hypothesis(target, frame.X_CW * pose, pixels));
    }
    std::vector<rendering::PoseEvidence> evidence(turned.size());
    const rendering::WorkspacePool::Loan workspace(backends.tools.search->workspaces());
    backends.tools.search->batch().evaluate(frame.terms, turned, *workspace, evidence);
    for (std::size_t i = 0; i < evidence.size(); ++i) log_posterior[i] += share * evidence[i].log_ratio;
  }
  const double largest = *std::max_element(log_posterior.begin(), log_posterior.end());
  double total = 0.0, mean = 0.0, square = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double w = std::exp(log_posterior[static_cast<std::size_t>(i)] - largest);
    total += w;
    mean += w * turn_at(i);
    square += w * turn_at(i) * turn_at(i);
  }
  mean /= total;
  return {particles.front(), std::sqrt(square / total - mean * mean)};
}

TEST(HiddenTurn, IsNotLearnedFromFramesThatDoNotTellIt) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    for (const double off : {-15.0, 0.0, 15.0}) {
      const Watched mug = watch_mug(angle_behind(), off * kDegree, seed);
      EXPECT_GT(mug.exact_deviation, 5.0 * kDegree) << "seed " << seed << ", " << off << " degrees off";
      EXPECT_GT(turn_deviation(mug.particle), 0.7 * mug.exact_deviation) << "seed " << seed << ", " << off;
    }
}

TEST(HiddenTurn, IsLearnedAsSoonAsTheHandleIsSeen) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (const double side : {-1.0, 1.0}) {
      const Watched mug = watch_mug(angle_behind() + side * 0.5 * std::numbers::pi, 8.0 * kDegree, seed);
      EXPECT_LT(mug.exact_deviation, 5.0 * kDegree) << "seed " << seed;
      EXPECT_LT(turn_deviation(mug.particle), 5.0 * kDegree) << "seed " << seed;
      EXPECT_LT(geometry::angle_between(mug.particle.X_WO.rotation,
                                        mug_pose(angle_behind() + side * 0.5 * std::numbers::pi).rotation),
                4.0 * kDegree);
    }
}

}  // namespace
}  // namespace prescene::filter_tests
