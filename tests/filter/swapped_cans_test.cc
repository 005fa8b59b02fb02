// SPDX-License-Identifier: Apache-2.0
// Two cans of one shape and different colours change places behind a plate: only colour tells.
#include <gtest/gtest.h>

#include "filter_fixture.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::TrackState;

SimulatedSequence swapped_cans(std::uint64_t seed, double swap_at) {
  belief::ObjectModel red = can_model("red", 0.035, 0.12), blue = can_model("blue", 0.035, 0.12);
  red.color = {0.85, 0.15, 0.1};
  blue.color = {0.1, 0.25, 0.8};
  const Pose left = Pose::from_translation({0.0, 0.07, 0.06}), right = Pose::from_translation({0.0, -0.07, 0.06});
  SimulatedSequence sequence = still_sequence({red, blue}, {left, right});
  sequence.objects = {[=](double time) { return time < swap_at ? left : right; },
                      [=](double time) { return time < swap_at ? right : left; }};
  sequence.occluders.push_back(
      plate(sequence.X_WC, fixed(Pose::from_translation({0.0, 0.0, 0.06})), 0.15, 0.40, 0.34, 1.0, 1.6));
  sequence.seed = seed;
  sequence.frame_rate = 15.0;
  return sequence;
}

// Of both cans in four sequences.
int tracked_where_they_are(double swap_at, bool learn) {
  Backends backends;
  int right = 0;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const SimulatedSequence sequence = swapped_cans(seed, swap_at);
    FilterSettings settings;
    settings.frame.colors.learn = learn;
    ParticleFilter filter = backends.make_filter(settings);
    Belief belief = filter.start(sequence.scene, seed);
    for (int frame = 0; frame < 45; ++frame)
      belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    for (std::size_t i = 0; i < 2; ++i) {
      const Pose truth = sequence.objects[i](sequence.time_of(44));
      const double error = (belief::estimate(belief.objects[i]).mode.translation - truth.translation).norm();
      right += belief.objects[i].state == TrackState::kTracked && error < 0.02;
    }
  }
  return right;
}

constexpr double kHidden = 1.3, kNever = 1e9;  // s

TEST(SwappedCans, AreToldApartByColour) { EXPECT_EQ(tracked_where_they_are(kHidden, true), 8); }
TEST(SwappedCans, AreNotByDepthAlone) { EXPECT_EQ(tracked_where_they_are(kHidden, false), 0); }
TEST(SwappedCans, StayWhereTheyAreWhenTheyDid) { EXPECT_EQ(tracked_where_they_are(kNever, true), 8); }

}  // namespace
}  // namespace prescene::filter_tests
