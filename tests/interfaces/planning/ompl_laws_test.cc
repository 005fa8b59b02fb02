// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/ompl.h"

#include <gmock/gmock.h>
#include <ompl/base/DiscreteMotionValidator.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <array>
#include <thread>

#include "prescene/core/random.h"
#include "prescene/interfaces/planning/scene_obstacles.h"
#include "tests/interfaces/planning/test_arm.h"
#include "tests/support/brute_force.h"

namespace prescene::interfaces::ompl_laws_test {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;

PlanningShape box_shape(double x, double y, double z) {
  core::ThreadPool pool(1);
  auto shape = PlanningShape::of_primitive(geometry::BoxShape{{x, y, z}}, "box", pool);
  PRESCENE_CHECK(shape.ok());
  return *std::move(shape);
}

/// A body among obstacles, 2 m of space about the origin.
struct BodyProblem {
  BodyProblem(PlanningShape body, std::vector<Obstacle> obstacles, const MotionCheckOptions& options = {}) {
    ompl::msg::noOutputHandler();
    auto made =
        MotionChecker::make(std::make_shared<const RigidBody>("body", std::move(body)), std::move(obstacles), options);
    PRESCENE_CHECK(made.ok());
    checker = *std::move(made);
    ob::RealVectorBounds bounds(3);
    bounds.setLow(-1.0);
    bounds.setHigh(1.0);
    space->setBounds(bounds);
    si = std::make_shared<ob::SpaceInformation>(space);
    auto used = use_collisions(si, checker);
    PRESCENE_CHECK(used.ok());
    collisions = *std::move(used);
    si->setup();
  }
  ob::ScopedState<ob::SE3StateSpace> state(const Vector3d& p, const Vector3d& turn = Vector3d::Zero()) const {
    ob::ScopedState<ob::SE3StateSpace> state(space);
    const auto r = geometry::exp_rotation(turn);
    state->setXYZ(p.x(), p.y(), p.z());
    state->rotation().x = r.x();
    state->rotation().y = r.y();
    state->rotation().z = r.z();
    state->rotation().w = r.w();
    return state;
  }
  std::shared_ptr<ob::SE3StateSpace> space = std::make_shared<ob::SE3StateSpace>();
  ob::SpaceInformationPtr si;
  std::shared_ptr<const MotionChecker> checker;
  std::shared_ptr<OmplCollisions> collisions;
};

/// A wall across the space with a window of 30 cm.
std::vector<Obstacle> wall_with_a_window() {
  const double half = 0.575;
  return {{"left", box_shape(0.001, 0.85, 2.0), Pose::from_translation({0.0, -half, 0.0})},
          {"right", box_shape(0.001, 0.85, 2.0), Pose::from_translation({0.0, half, 0.0})},
          {"below", box_shape(0.001, 2.0, 0.85), Pose::from_translation({0.0, 0.0, -half})},
          {"above", box_shape(0.001, 2.0, 0.85), Pose::from_translation({0.0, 0.0, half})}};
}

std::shared_ptr<og::PathGeometric> plan(const ob::SpaceInformationPtr& si, const ob::State* from, const ob::State* to) {
  auto problem = std::make_shared<ob::ProblemDefinition>(si);
  problem->setStartAndGoalStates(ob::ScopedState<>(si->getStateSpace(), from),
                                 ob::ScopedState<>(si->getStateSpace(), to));
  og::RRTConnect planner(si);
  planner.setProblemDefinition(problem);
  planner.setup();
  ob::IterationTerminationCondition iterations(200'000);
  planner.solve(ob::PlannerTerminationCondition(iterations));
  if (!problem->hasExactSolution()) return nullptr;
  return std::dynamic_pointer_cast<og::PathGeometric>(problem->getSolutionPath());
}

TEST(OmplLaws, BodysPathIsFreeInDenseSamplesByBruteForce) {
  const BodyProblem problem(box_shape(0.2, 0.1, 0.25), wall_with_a_window());
  const auto from = problem.state({-0.6, -0.5, 0.1}), to = problem.state({0.6, 0.5, -0.2}, {0.0, 0.0, 1.5});
  const auto path = plan(problem.si, from.get(), to.get());
  ASSERT_NE(path, nullptr);
  ASSERT_GE(path->getStateCount(), 3U);  // The straight way is blocked.
  const auto& body = problem.checker->mover().shapes().front().shape;
  ob::State* state = problem.si->allocState();
  for (std::size_t i = 1; i < path->getStateCount(); ++i) {
    for (int sample = 0; sample <= 2000; ++sample) {
      problem.space->interpolate(path->getState(i - 1), path->getState(i), sample / 2000.0, state);
      const auto* pose = state->as<ob::SE3StateSpace::StateType>();
      const auto& r = pose->rotation();
      const Pose X_WB{geometry::Quaterniond(r.w, r.x, r.y, r.z), {pose->getX(), pose->getY(), pose->getZ()}};
      for (const Obstacle& obstacle : problem.checker->obstacles())
        ASSERT_FALSE(tests::collide_by_brute_force(obstacle.shape.triangles()->mesh(), body.triangles()->mesh(),
                                                   *collision::relative_transform(obstacle.X_WO, X_WB)));
    }
  }
  problem.si->freeState(state);
  EXPECT_EQ(problem.collisions->counts().undecided_motions, 0U);
  EXPECT_GT(problem.collisions->counts().motions, problem.collisions->counts().blocked_motions);
}

TEST(OmplLaws, ArmsPathIsFreeInDenseSamples) {
  ompl::msg::noOutputHandler();
  const tests::TestArm made;
  core::ThreadPool pool(1);
  auto obstacles = scene_obstacles(made.scene, made.arm->bodies(), pool);
  ASSERT_TRUE(obstacles.ok());
  const auto checker = MotionChecker::make(made.arm, *std::move(obstacles), {.margin = 0.002}, made.arm->home());
  ASSERT_TRUE(checker.ok());
  const auto space = arm_space(*made.arm);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  ASSERT_TRUE(use_collisions(si, *checker).ok());
  si->setup();
  // From below the plate to beside it, higher up.
  ob::ScopedState<ob::RealVectorStateSpace> from(space), to(space);
  const std::array<double, 4> q_from = {0.9, -0.3, 0.3, 0.0}, q_to = {-0.5, -1.2, 0.0, 0.03};
  std::copy(q_from.begin(), q_from.end(), from->values);
  std::copy(q_to.begin(), q_to.end(), to->values);
  ASSERT_TRUE(si->isValid(from.get()));
  ASSERT_TRUE(si->isValid(to.get()));
  ASSERT_FALSE(si->checkMotion(from.get(), to.get()));
  const auto path = plan(si, from.get(), to.get());
  ASSERT_NE(path, nullptr);
  std::vector<double> q(4);
  std::vector<Pose> poses(made.arm->shapes().size()), work;
  for (std::size_t i = 1; i < path->getStateCount(); ++i) {
    const auto* a = path->getState(i - 1)->as<ob::RealVectorStateSpace::StateType>();
    const auto* b = path->getState(i)->as<ob::RealVectorStateSpace::StateType>();
    for (int sample = 0; sample <= 500; ++sample) {
      made.arm->between({a->values, 4}, {b->values, 4}, sample / 500.0, q);
      made.arm->place(q, poses, &work);
      for (std::size_t s = 1; s < poses.size(); ++s)
        for (const Obstacle& obstacle : (*checker)->obstacles())
          ASSERT_FALSE(tests::collide_by_brute_force(obstacle.shape.triangles()->mesh(),
                                                     made.arm->shapes()[s].shape.triangles()->mesh(),
                                                     *collision::relative_transform(obstacle.X_WO, poses[s])));
    }
  }
}

TEST(OmplLaws, SamplesGoThroughAThinPlateAndOursDoNot) {
  const BodyProblem problem(box_shape(0.004, 0.004, 0.004), {{"plate", box_shape(0.0005, 2.2, 2.2), Pose::identity()}});
  const ob::DiscreteMotionValidator sampled(problem.si);  // At OMPL's default resolution.
  int through = 0;
  for (int i = 0; i < 50; ++i) {
    const auto from = problem.state({-0.3 - 0.003 * i, 0.1, 0.0}), to = problem.state({0.4 + 0.002 * i, -0.1, 0.2});
    ASSERT_TRUE(problem.si->isValid(from.get()) && problem.si->isValid(to.get()));
    through += sampled.checkMotion(from.get(), to.get());
    ASSERT_FALSE(problem.si->checkMotion(from.get(), to.get())) << i;
  }
  EXPECT_GT(through, 10);
}

TEST(OmplLaws, TheLastValidStateIsValidAndBeforeThePlate) {
  const BodyProblem problem(box_shape(0.1, 0.2, 0.3), {{"plate", box_shape(0.001, 1.0, 1.0), Pose::identity()}});
  ob::State* last = problem.si->allocState();
  core::RandomStream random(31, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    const auto coordinate = [&] { return random.uniform(-0.3, 0.3); };
    const Vector3d from_turn{random.normal(), random.normal(), 0.1};
    const auto from = problem.state({-0.6, coordinate(), coordinate()}, from_turn);
    const Vector3d to_turn{0.0, random.normal(), random.normal()};
    const auto to = problem.state({0.6, coordinate(), coordinate()}, to_turn);
    std::pair<ob::State*, double> last_valid(last, -1.0);
    ASSERT_FALSE(problem.si->checkMotion(from.get(), to.get(), last_valid));
    ASSERT_GT(last_valid.second, 0.1);
    ASSERT_LT(last_valid.second, 0.6);
    ASSERT_TRUE(problem.si->isValid(last));
    ASSERT_TRUE(problem.si->checkMotion(from.get(), last));
    // Where it is near the plate: the first contact is just after.
    ASSERT_LT(problem.si->getStateValidityChecker()->clearance(last), 0.002);
    // Free motions leave it as it is.
    last_valid.second = -1.0;
    ASSERT_TRUE(problem.si->checkMotion(from.get(), last, last_valid));
    ASSERT_EQ(last_valid.second, -1.0);
  }
  problem.si->freeState(last);
}

TEST(OmplLaws, StatesOutsideOfTheBoundsAreNotValid) {
  const BodyProblem problem(box_shape(0.1, 0.1, 0.1), {});
  EXPECT_TRUE(problem.si->isValid(problem.state({0.9, 0.0, 0.0}).get()));
  EXPECT_FALSE(problem.si->isValid(problem.state({1.1, 0.0, 0.0}).get()));
  EXPECT_FALSE(problem.si->checkMotion(problem.state({0.9, 0.0, 0.0}).get(), problem.state({1.1, 0.0, 0.0}).get()));
}

TEST(OmplLaws, ThreadsGetTheAnswersOfOne) {
  const BodyProblem problem(box_shape(0.2, 0.1, 0.25), wall_with_a_window(), {.margin = 0.01});
  core::RandomStream random(32, core::Purpose::kTest);
  std::vector<ob::ScopedState<ob::SE3StateSpace>> states;
  for (int i = 0; i < 200; ++i) {
    const auto coordinate = [&] { return random.uniform(-0.8, 0.8); };
    const Vector3d turn{random.normal(), random.normal(), random.normal()};
    states.push_back(problem.state({coordinate(), coordinate(), coordinate()}, turn));
  }
  const auto answers = [&] {
    std::vector<int> all;
    for (std::size_t i = 1; i < states.size(); ++i) {
      const bool is_valid = problem.si->isValid(states[i - 1].get());
      all.push_back(is_valid ? 1 + problem.si->checkMotion(states[i - 1].get(), states[i].get()) : 0);
    }
    return all;
  };
  const std::vector<int> expected = answers();
  std::array<std::vector<int>, 4> found;
  std::vector<std::thread> threads;
  for (auto& mine : found) threads.emplace_back([&] { mine = answers(); });
  for (std::thread& thread : threads) thread.join();
  for (const auto& mine : found) EXPECT_EQ(mine, expected);
}

TEST(OmplLaws, RefusesAMoverThatIsOfAnotherSpace) {
  const BodyProblem problem(box_shape(0.1, 0.1, 0.1), {});
  const ob::RealVectorStateSpace plane(2);
  EXPECT_THAT(OmplCollisions::make(plane, problem.checker).status().message(), HasSubstr("SE3StateSpace"));
  const tests::TestArm made;
  const auto checker = MotionChecker::make(made.arm, {}, {}, made.arm->home());
  EXPECT_THAT(OmplCollisions::make(*problem.space, *checker).status().message(), HasSubstr("4 dimensions"));
  EXPECT_THAT(OmplCollisions::make(*problem.space, nullptr).status().message(), HasSubstr("no checker"));
}

}  // namespace
}  // namespace prescene::interfaces::ompl_laws_test
