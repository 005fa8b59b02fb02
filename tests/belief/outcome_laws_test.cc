// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/belief/outcome.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"

namespace prescene::belief {
namespace {

using core::Purpose;
using core::RandomStream;

bool holds_one(const Scene& scene, const Trajectory& trajectory, const Condition& condition) {
  return holds(scene, trajectory, {"one", "block", {condition}});
}

Trajectory moved(const Trajectory& trajectory, const Pose& X_VW) {
  Trajectory result = trajectory;
  for (WorldState& state : result.states) {
    for (ObjectState& object : state.objects) {
      object.X_WO = X_VW * object.X_WO;
      object.V_WO = {X_VW.rotation * object.V_WO.angular, X_VW.rotation * object.V_WO.linear};
    }
  }
  return result;
}

// The same question asked of a world that was moved.
Predicate moved(Predicate predicate, const Pose& X_VW) {
  if (auto* inside = std::get_if<InsideVolume>(&predicate)) inside->X_WV = X_VW * inside->X_WV;
  if (auto* below = std::get_if<BelowHeight>(&predicate)) below->height += X_VW.translation.z();
  return predicate;
}

TEST(OutcomeLaws, TurningTheWorldAboutTheVerticalAndShiftingItChangesNoAnswer) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    const Condition condition{tests::random_predicate(stream), static_cast<When>(tests::random_below(stream, 3)),
                              false};
    const Pose X_VW{geometry::exp_rotation({0.0, 0.0, stream.uniform(-3.0, 3.0)}), tests::random_vector(stream, 3.0)};
    Condition there = condition;
    there.predicate = moved(condition.predicate, X_VW);
    RC_ASSERT(holds_one(scene, trajectory, condition) == holds_one(scene, moved(trajectory, X_VW), there));
  }));
}

TEST(OutcomeLaws, NegationTurnsTheAnswerRound) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    Condition condition{tests::random_predicate(stream), static_cast<When>(tests::random_below(stream, 3)), false};
    const bool plain = holds_one(scene, trajectory, condition);
    condition.negated = true;
    RC_ASSERT(holds_one(scene, trajectory, condition) != plain);
  }));
}

TEST(OutcomeLaws, AlwaysImpliesAtTheEndImpliesEver) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    const Predicate predicate = tests::random_predicate(stream);
    const bool always = holds_one(scene, trajectory, {predicate, When::kAlways, false});
    const bool at_end = holds_one(scene, trajectory, {predicate, When::kAtEnd, false});
    const bool ever = holds_one(scene, trajectory, {predicate, When::kEver, false});
    RC_ASSERT(!always || at_end);
    RC_ASSERT(!at_end || ever);
  }));
}

TEST(OutcomeLaws, AllOfIsTheConjunctionAnyOfTheDisjunctionAndAGroupIsAPartition) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    ExclusiveOutcomes group{"group", {}};
    std::size_t first = 0;
    bool found = false;
    for (int i = 0; i < 3; ++i) {
      const Outcome outcome = tests::random_outcome(stream, std::string(1, static_cast<char>('a' + i)));
      bool each = true;
      for (const Condition& condition : outcome.all_of) each = each && holds_one(scene, trajectory, condition);
      bool any = outcome.any_of.empty();
      for (const Condition& condition : outcome.any_of) any = any || holds_one(scene, trajectory, condition);
      each = each && any;
      RC_ASSERT(holds(scene, trajectory, outcome) == each);
      if (!found && each) {
        found = true;
        first = group.outcomes.size();
      }
      group.outcomes.push_back(outcome);
    }
    // Just one class for every trajectory: the first that holds, or "other".
    RC_ASSERT(classify(scene, trajectory, group) == static_cast<int>(found ? first : group.outcomes.size()));
  }));
}

TEST(OutcomeLaws, JustOneOfTheSixFacesIsUpAndItIsTheNearestToTheVertical) {
  const Scene scene = tests::small_scene();
  const ExclusiveOutcomes faces = which_face_up("up", "block");
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    int holding = 0;
    for (const Outcome& outcome : faces.outcomes) holding += holds(scene, trajectory, outcome) ? 1 : 0;
    RC_ASSERT(holding == 1);
    const int face = classify(scene, trajectory, faces);
    RC_ASSERT(face < 6);
    const auto& up = std::get<FaceUp>(faces.outcomes[static_cast<std::size_t>(face)].all_of[0].predicate);
    // No face is further from the vertical than a cube's diagonal.
    RC_ASSERT((trajectory.final().objects[0].X_WO.rotation * up.axis_O).z() >= 1.0 / std::sqrt(3.0) - 1e-12);
  }));
}

TEST(OutcomeLaws, WhatLooksAtTheEndOnlyNeedsNoStatesAlongTheWay) {
  const Scene scene = tests::small_scene();
  EXPECT_TRUE(tests::check_law([&](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const Trajectory trajectory = tests::random_trajectory(stream);
    const Outcome outcome = tests::random_outcome(stream, "a");
    if (needs_states_along_the_way(outcome)) return;
    Trajectory ends_only = trajectory;
    ends_only.states = {trajectory.start(), trajectory.final()};
    RC_ASSERT(holds(scene, trajectory, outcome) == holds(scene, ends_only, outcome));
  }));
}

// One state of the block at a pose, at rest; contacts as given.
Trajectory resting(const Pose& X_WO, std::vector<ContactInterval> contacts = {}) {
  Trajectory trajectory;
  WorldState state;
  state.objects.resize(2);
  state.objects[0].X_WO = X_WO;
  trajectory.states = {state, state};
  trajectory.states[1].time = 1.0;
  trajectory.contacts = std::move(contacts);
  return trajectory;
}

TEST(Outcome, WholeInsideAsksForEveryCorner) {
  const Scene scene = tests::small_scene();  // the block is 0.1 x 0.2 x 0.3
  const auto inside = [&](const Vector3d& size, bool whole, const Pose& X_WO) {
    return holds_one(scene, resting(X_WO), {InsideVolume{Pose{}, size, whole}, When::kAtEnd, false});
  };
  EXPECT_TRUE(inside({0.101, 0.201, 0.301}, true, Pose{}));
  EXPECT_FALSE(inside({0.101, 0.199, 0.301}, true, Pose{}));
  EXPECT_TRUE(inside({0.101, 0.199, 0.301}, false, Pose{}));
  const Pose turned{geometry::exp_rotation({0.0, 0.0, 1.5707963267948966}), Vector3d::Zero()};
  EXPECT_FALSE(inside({0.101, 0.201, 0.301}, true, turned));
  EXPECT_TRUE(inside({0.201, 0.101, 0.301}, true, turned));
}

TEST(Outcome, RestingOnNeedsAContactFromAboveThatStillLasts) {
  const Scene scene = tests::small_scene();
  const auto rests = [&](const ContactInterval& contact) {
    return holds_one(scene, resting(Pose{}, {contact}), {RestingOn{"table"}, When::kAtEnd, false});
  };
  EXPECT_TRUE(rests({0, 2, 0.2, 1.0, 0.1, 0.9}));
  EXPECT_FALSE(rests({0, 2, 0.2, 0.8, 0.1, 0.9})) << "over before the end";
  EXPECT_FALSE(rests({0, 2, 0.2, 1.0, 0.1, 0.1})) << "leans against it";
  EXPECT_FALSE(rests({0, 2, 0.2, 1.0, 0.1, -0.9})) << "hangs below it";
  EXPECT_FALSE(rests({0, 3, 0.2, 1.0, 0.1, 0.9})) << "another support";
  // On another object: numbered before the block, the ball would be `first`.
  EXPECT_TRUE(
      holds_one(scene, resting(Pose{}, {{0, 1, 0.2, 1.0, 0.1, 0.9}}), {RestingOn{"ball"}, When::kAtEnd, false}));
  Trajectory moving = resting(Pose{}, {{0, 2, 0.2, 1.0, 0.1, 0.9}});
  moving.states[1].objects[0].V_WO.linear = {0.1, 0.0, 0.0};
  EXPECT_FALSE(holds_one(scene, moving, {RestingOn{"table"}, When::kAtEnd, false}));
}

TEST(Outcome, EachPredicateIsTrueOfAHandMadeRunWhenItShouldBe) {
  const Scene scene = tests::small_scene();
  // The block slides from the table into the bin a metre on, tips over its long edge on the way, and stops.
  Trajectory run;
  const double half_turn = 1.5707963267948966;
  const std::vector<Pose> poses = {Pose::from_translation({0.0, 0.0, 0.3}),
                                   {geometry::exp_rotation({0.0, 0.5 * half_turn, 0.0}), {0.5, 0.0, 0.5}},
                                   {geometry::exp_rotation({0.0, half_turn, 0.0}), {1.0, 0.0, 0.1}}};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    WorldState state;
    state.time = 0.5 * static_cast<double>(i);
    state.objects.resize(2);
    state.objects[0].X_WO = poses[i];
    if (i == 1) state.objects[0].V_WO = {{0.0, 3.0, 0.0}, {1.0, 0.0, 0.0}};
    run.states.push_back(state);
  }
  run.contacts = {{0, 2, 0.0, 0.2, 0.1, 1.0}, {0, 3, 0.8, 1.0, 0.4, 0.9}};
  run.final_contacts = {{0, 3}};
  struct Expected {
    Predicate predicate;
    bool at_end, ever, always;
  };
  const Vector3d x = Vector3d::UnitX(), z = Vector3d::UnitZ();
  const std::vector<Expected> all = {
      {InsideVolume{Pose::from_translation({1.0, 0.0, 0.2}), {0.3, 0.3, 0.4}, false}, true, true, false},
      {InsideVolume{Pose::from_translation({0.5, 0.0, 0.5}), {0.1, 0.1, 0.1}, false}, false, true, false},
      {BelowHeight{0.2}, true, true, false},
      {BelowHeight{0.6}, true, true, true},
      {UprightWithin{z, 0.3}, false, true, false},
      {UprightWithin{-x, 0.01}, true, true, false},  // -x of the block points up after a quarter turn about y
      {UprightWithin{z, 2.0}, true, true, true},
      {FaceUp{-x}, true, true, false},
      {FaceUp{z}, false, true, false},
      {MovedMoreThan{0.9}, true, true, false},
      {MovedMoreThan{1.2}, false, false, false},
      {TurnedMoreThan{1.5}, true, true, false},
      {TurnedMoreThan{1.6}, false, false, false},
      {StillMoving{}, false, true, false},
      {Touched{"table"}, true, true, true},
      {Touched{"bin"}, true, true, true},
      {Touched{"ball"}, false, false, false},
      {RestingOn{"bin"}, true, true, false},
      {RestingOn{"table"}, false, true, false},
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Expected& expected = all[i];
    EXPECT_EQ(holds_one(scene, run, {expected.predicate, When::kAtEnd, false}), expected.at_end) << i;
    EXPECT_EQ(holds_one(scene, run, {expected.predicate, When::kEver, false}), expected.ever) << i;
    EXPECT_EQ(holds_one(scene, run, {expected.predicate, When::kAlways, false}), expected.always) << i;
    EXPECT_EQ(holds_one(scene, run, {expected.predicate, When::kAtEnd, true}), !expected.at_end) << i;
  }
}

}  // namespace
}  // namespace prescene::belief
