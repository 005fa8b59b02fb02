// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/timeline.h"

#include <gmock/gmock.h>

#include "prescene/belief/trajectory.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"

namespace prescene::belief {
namespace {

// The block is held, let go above the bin, falls into it and comes to rest; the ball lies still on the table.
Trajectory drop_into_bin() {
  struct Moment {
    double time, z, speed;
    MotionMode mode;
    double tilt;
  };
  Trajectory trajectory;
  for (const Moment& moment :
       {Moment{0.0, 0.8, 0.0, MotionMode::kHeld, 0.0}, Moment{0.1, 0.8, 0.0, MotionMode::kHeld, 0.0},
        Moment{0.2, 0.75, -1.0, MotionMode::kMoving, 0.1}, Moment{0.3, 0.5, -2.0, MotionMode::kMoving, 0.4},
        Moment{0.4, 0.3, -1.0, MotionMode::kMoving, 0.8}, Moment{0.5, 0.2, 0.0, MotionMode::kResting, 1.5}}) {
    WorldState state;
    state.time = moment.time;
    state.objects.resize(2);
    state.objects[0].X_WO = {geometry::exp_rotation({moment.tilt, 0.0, 0.0}), Vector3d(1.0, 0.0, moment.z)};
    state.objects[0].V_WO.linear.z() = moment.speed;
    state.objects[0].mode = moment.mode;
    state.objects[1].mode = MotionMode::kResting;
    trajectory.states.push_back(state);
  }
  trajectory.contacts = {{1, 2, 0.0, 0.5, 0.01, 1.0}, {0, 3, 0.35, 0.5, 0.2, 0.9}};
  return trajectory;
}

TEST(Timeline, OfADropIntoABinTellsTheStory) {
  const Scene scene = tests::small_scene();
  const Timeline timeline = timeline_of(scene, drop_into_bin());
  const auto of_block = [&](Relation relation) {
    std::vector<std::pair<double, double>> spans;
    for (const Interval& interval : timeline)
      if (interval.relation == relation && (interval.subject == "block" || interval.other == "block"))
        spans.emplace_back(interval.begin, interval.end);
    return spans;
  };
  using Spans = std::vector<std::pair<double, double>>;
  EXPECT_EQ(of_block(Relation::kHolds), (Spans{{0.0, 0.2}}));
  EXPECT_EQ(of_block(Relation::kMoving), (Spans{{0.2, 0.5}}));
  EXPECT_EQ(of_block(Relation::kFalling), (Spans{{0.2, 0.4}}));
  EXPECT_EQ(of_block(Relation::kUpright), (Spans{{0.0, 0.3}}));
  EXPECT_EQ(of_block(Relation::kContact), (Spans{{0.35, 0.5}}));
  EXPECT_EQ(of_block(Relation::kSupports), (Spans{{0.35, 0.5}}));
  EXPECT_EQ(of_block(Relation::kInside), (Spans{{0.4, 0.5}})) << "the hollow of the bin reaches from 0 to 0.4 m";
  EXPECT_THAT(timeline, testing::Contains(Interval{Relation::kHolds, "hand", "block", 0.0, 0.2}));
  EXPECT_THAT(timeline, testing::Contains(Interval{Relation::kInside, "block", "bin", 0.4, 0.5}));
  EXPECT_THAT(timeline, testing::Contains(Interval{Relation::kSupports, "table", "ball", 0.0, 0.5}));
}

TEST(Timeline, NamesVolumesOfOutcomesAboutTheObject) {
  Scene scene = tests::small_scene();
  const InsideVolume below{Pose::from_translation({1.0, 0.0, 0.5}), {0.2, 0.2, 0.3}};
  scene.outcomes = {{"near_the_rim", "block", {Condition{below}}}, {"elsewhere", "ball", {Condition{below}}}};
  const Timeline timeline = timeline_of(scene, drop_into_bin());
  EXPECT_THAT(timeline, testing::Contains(Interval{Relation::kInside, "block", "near_the_rim", 0.3, 0.4}));
  for (const Interval& interval : timeline) EXPECT_NE(interval.other, "elsewhere");
}

TEST(TimelineLaws, IntervalsAreOrderedLieWithinTheTrajectoryAndDoNotOverlapThemselves) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    const Timeline timeline = timeline_of(scene, trajectory);
    for (std::size_t i = 0; i < timeline.size(); ++i) {
      const Interval& a = timeline[i];
      RC_ASSERT(a.begin >= trajectory.start().time && a.begin <= a.end && a.end <= trajectory.final().time);
      if (i > 0) RC_ASSERT(timeline[i - 1].begin <= a.begin);
      const bool is_contact = a.relation == Relation::kContact || a.relation == Relation::kSupports;
      for (std::size_t j = 0; j < i && !is_contact; ++j) {
        const Interval& b = timeline[j];
        const bool same = a.relation == b.relation && a.subject == b.subject && a.other == b.other;
        RC_ASSERT(!same || b.end < a.begin);
      }
    }
  }));
}

}  // namespace
}  // namespace prescene::belief
