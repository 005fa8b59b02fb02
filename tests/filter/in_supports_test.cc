// SPDX-License-Identifier: Apache-2.0
// Where supports are, objects are not, however much the support looks like the object's top.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "filter_fixture.h"
#include "prescene/filter/particle_filter.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::TrackState;

constexpr double kThin = 0.039;  // m; a little less than the table

/// A thin box that may be anywhere on the table.
SimulatedSequence thin_box(const Pose& X_WO, double shift) {
  return still_sequence({box_model("box", {0.16, 0.10, kThin})}, {X_WO}, shift, 0.05);
}

TEST(InSupports, AThingThatIsNotThereIsNotTheTopOfTheTable) {
  Backends backends;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SimulatedSequence sequence = thin_box(Pose::from_translation({0.0, 0.0, 0.5 * kThin}), 0.2);
    sequence.objects = {fixed(Pose::from_translation({0.0, 0.0, -5.0}))};
    sequence.seed = seed;
    ParticleFilter filter = backends.make_filter();
    Belief belief = filter.start(sequence.scene, seed);
    for (int frame = 0; frame < 20; ++frame) {
      belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
      if (frame < 5) continue;
      EXPECT_NE(belief.objects[0].state, TrackState::kTracked) << "seed " << seed << ", frame " << frame;
      EXPECT_LT(belief::estimate(belief.objects[0]).confidence, 0.5) << "seed " << seed << ", frame " << frame;
    }
  }
}

TEST(InSupports, IsNotRefutedWhereTheTableIsLowerThanTheSceneSays) {
  Backends backends;
  for (const double lower : {0.0, 0.006, 0.011}) {
    const double half = 0.010;
    const Pose X_WO = Pose::from_translation({0.0, 0.0, half - lower});
    SimulatedSequence sequence =
        still_sequence({box_model("box", {0.16, 0.10, 2.0 * half})}, {Pose::from_translation({0.0, 0.0, half})}, 0.01);
    sequence.objects = {fixed(X_WO)};
    const std::shared_ptr<const belief::Scene> as_said = sequence.scene;
    auto as_is = std::make_shared<belief::Scene>(*as_said);
    as_is->supports.front().X_WS.translation.z() -= lower;
    sequence.scene = as_is;
    ParticleFilter filter = backends.make_filter();
    Belief belief = filter.start(as_said, 3);
    for (int frame = 0; frame < 15; ++frame)
      belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    EXPECT_EQ(belief.objects[0].state, TrackState::kTracked) << lower << " m lower";
  }
}

TEST(InSupports, ASheetOnTheTableIsNotInIt) {
  Backends backends;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedSequence sequence =
        still_sequence({box_model("sheet", {0.16, 0.10, 0.004})}, {Pose::from_translation({0.0, 0.0, 0.002})});
    sequence.seed = seed;
    ParticleFilter filter = backends.make_filter();
    Belief belief = filter.start(sequence.scene, seed);
    for (int frame = 0; frame < 20; ++frame) {
      belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
      EXPECT_NE(belief.objects[0].state, TrackState::kLost) << "seed " << seed << ", frame " << frame;
    }
  }
}

}  // namespace
}  // namespace prescene::filter_tests
