// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/planning_problems.h"

#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "benchmarks/processor_time.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/interfaces/planning/ompl.h"
#include "prescene/interfaces/planning/scene_obstacles.h"
#include "tests/interfaces/planning/test_arm.h"
#include "tests/peers/mesh_collision.h"
#include "tests/support/collision_meshes.h"

namespace prescene::benchmarks {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using geometry::Pose;
using geometry::Vector3d;
using interfaces::MotionChecker;
using interfaces::Obstacle;
using interfaces::PlanningShape;

constexpr unsigned int kMostIterations = 100'000;

template <class Value>
Value checked(core::Result<Value> result) {
  PRESCENE_CHECK_MSG(result.ok(), result.status().message());
  return *std::move(result);
}

PlanningShape shape_of(const geometry::TriangleMesh& mesh, std::string_view name) {
  core::ThreadPool pool(1);
  return checked(PlanningShape::of_mesh(mesh, name, pool));
}

PlanningShape box(double x, double y, double z) {
  return shape_of(geometry::make_mesh(geometry::BoxShape{{x, y, z}}), "box");
}

PlanningProblem body_problem(std::string name, PlanningShape body, std::vector<Obstacle> obstacles, const Pose& start,
                             const Pose& goal) {
  const auto mover = std::make_shared<const interfaces::RigidBody>("body", std::move(body));
  const auto from = interfaces::RigidBody::configuration(start), to = interfaces::RigidBody::configuration(goal);
  return {std::move(name),
          checked(MotionChecker::make(mover, std::move(obstacles), {})),
          {from.begin(), from.end()},
          {to.begin(), to.end()}};
}

PlanningProblem window() {
  const double half = 0.575;  // of a window of 30 cm
  std::vector<Obstacle> wall = {{"left", box(0.002, 0.85, 2.0), Pose::from_translation({0.0, -half, 0.0})},
                                {"right", box(0.002, 0.85, 2.0), Pose::from_translation({0.0, half, 0.0})},
                                {"below", box(0.002, 2.0, 0.85), Pose::from_translation({0.0, 0.0, -half})},
                                {"above", box(0.002, 2.0, 0.85), Pose::from_translation({0.0, 0.0, half})}};
  return body_problem("box, window in a wall of 2 mm", box(0.2, 0.1, 0.25), std::move(wall),
                      Pose::from_translation({-0.6, -0.5, 0.1}), Pose::from_translation({0.6, 0.5, -0.2}));
}

PlanningProblem thicket() {
  const PlanningShape knot = shape_of(tests::make_knot(0.16, 5000), "knot");
  std::vector<Obstacle> knots;
  core::RandomStream random(5, core::Purpose::kEvaluation);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const double about_z = random.normal(), about_y = random.normal(), about_x = random.normal();
        const Vector3d turn(about_x, about_y, about_z);
        knots.push_back({"knot", knot, {geometry::exp_rotation(turn), 0.5 * Vector3d(x, y, z)}});
      }
    }
  }
  return body_problem("bumpy ball, 27 knots, 5,000 triangles each",
                      shape_of(tests::make_bumpy_sphere(0.07, 5000), "ball"), std::move(knots),
                      Pose::from_translation({-0.9, -0.9, -0.9}), Pose::from_translation({0.9, 0.9, 0.9}));
}

PlanningProblem arm() {
  const tests::TestArm made;
  core::ThreadPool pool(1);
  auto obstacles = checked(interfaces::scene_obstacles(made.scene, made.arm->bodies(), pool));
  return {"arm of four joints, plate of 1 mm",
          checked(MotionChecker::make(made.arm, std::move(obstacles), {}, made.arm->home())),
          {0.9, -0.3, 0.3, 0.0},
          {-0.5, -1.2, 0.0, 0.03}};
}

/// Wall time in checks. Checks within checks count once.
class CheckClock {
 public:
  template <class Check>
  auto timed(const Check& check) {
    if (running_) return check();
    running_ = true;
    const auto begin = std::chrono::steady_clock::now();
    const auto answer = check();
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    running_ = false;
    return answer;
  }
  double seconds() const { return seconds_; }

 private:
  bool running_ = false;
  double seconds_ = 0.0;
};

class TimedStates final : public ob::StateValidityChecker {
 public:
  TimedStates(const ob::SpaceInformationPtr& si, std::function<bool(const ob::State*)> check, CheckClock* clock)
      : StateValidityChecker(si), check_(std::move(check)), clock_(clock) {}
  bool isValid(const ob::State* state) const override {
    ++count_;
    return clock_->timed([&] { return si_->satisfiesBounds(state) && check_(state); });
  }
  std::int64_t count() const { return count_; }

 private:
  std::function<bool(const ob::State*)> check_;
  CheckClock* clock_;
  mutable std::int64_t count_ = 0;
};

class TimedMotions final : public ob::MotionValidator {
 public:
  TimedMotions(const ob::SpaceInformationPtr& si, ob::MotionValidatorPtr inner, CheckClock* clock)
      : MotionValidator(si), inner_(std::move(inner)), clock_(clock) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    ++count_;
    return clock_->timed([&] { return inner_->checkMotion(from, to); });
  }
  bool checkMotion(const ob::State* from, const ob::State* to, std::pair<ob::State*, double>& last) const override {
    ++count_;
    return clock_->timed([&] { return inner_->checkMotion(from, to, last); });
  }
  std::int64_t count() const { return count_; }

 private:
  ob::MotionValidatorPtr inner_;
  CheckClock* clock_;
  mutable std::int64_t count_ = 0;
};

/// The same pairs, asked of FCL; neither what is inside of a solid nor a margin.
class FclStates {
 public:
  explicit FclStates(const MotionChecker& checker) : checker_(checker) {
    const auto& shapes = checker.mover().shapes();
    const auto mesh = [](const PlanningShape& shape) { return shape.triangles()->shared_mesh(); };
    for (std::size_t s = 0; s < shapes.size(); ++s) {
      if (!checker.mover().moves(s)) continue;
      for (const Obstacle& obstacle : checker.obstacles())
        pairs_.push_back(
            {s, &obstacle.X_WO, 0,
             tests::make_fcl_pair(mesh(obstacle.shape), mesh(shapes[s].shape), tests::FclVolume::kObbRss)});
    }
    for (const auto& [a, b] : checker.mover().own_pairs()) {
      const auto& ignored = checker.ignored_pairs();
      if (std::find(ignored.begin(), ignored.end(), std::pair(shapes[a].name, shapes[b].name)) != ignored.end())
        continue;
      pairs_.push_back({a, nullptr, b,
                        tests::make_fcl_pair(mesh(shapes[b].shape), mesh(shapes[a].shape), tests::FclVolume::kObbRss)});
    }
    poses_.resize(shapes.size());
  }
  bool is_free(std::span<const double> q) {
    checker_.mover().place(q, poses_, &work_);
    return std::none_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
      const Pose& X_WO = pair.obstacle != nullptr ? *pair.obstacle : poses_[pair.other];
      const auto X = collision::relative_transform(X_WO, poses_[pair.shape]);
      return !X || pair.peer->collide(*X);
    });
  }

 private:
  struct Pair {
    std::size_t shape;
    const Pose* obstacle;  // Null: another shape.
    std::size_t other;
    std::unique_ptr<tests::MeshPairPeer> peer;
  };
  const MotionChecker& checker_;
  std::vector<Pair> pairs_;
  std::vector<Pose> poses_, work_;
};

ob::StateSpacePtr space_of(const MotionChecker& checker) {
  if (const auto* arm = dynamic_cast<const interfaces::Arm*>(&checker.mover())) return interfaces::arm_space(*arm);
  const auto space = std::make_shared<ob::SE3StateSpace>();
  ob::RealVectorBounds bounds(3);
  bounds.setLow(-1.0);
  bounds.setHigh(1.0);
  space->setBounds(bounds);
  return space;
}

/// Both ways; OMPL counts an SE(3) state's numbers as RigidBody does: position, then x, y, z and w.
void write(const ob::StateSpacePtr& space, std::span<const double> q, ob::State* state) {
  space->copyFromReals(state, {q.begin(), q.end()});
}

}  // namespace

std::vector<PlanningProblem> planning_problems() { return {window(), thicket(), arm()}; }

PlanningRun plan(const PlanningProblem& problem, Checking checking, std::uint32_t seed) {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(seed);
  const ob::StateSpacePtr space = space_of(*problem.checker);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  const auto collisions = checked(interfaces::OmplCollisions::make(*space, problem.checker));
  const auto exact = std::make_shared<interfaces::CollisionMotionValidator>(si, collisions);
  CheckClock clock;
  std::function<bool(const ob::State*)> is_free = [&](const ob::State* state) { return collisions->is_free(state); };
  std::optional<FclStates> fcl;
  std::vector<double> numbers;
  if (checking == Checking::kSampledFcl) {
    fcl.emplace(*problem.checker);
    is_free = [&](const ob::State* state) {
      space->copyToReals(numbers, state);
      return fcl->is_free(numbers);
    };
  }
  const auto states = std::make_shared<TimedStates>(si, is_free, &clock);
  si->setStateValidityChecker(states);
  std::shared_ptr<TimedMotions> motions;
  if (checking == Checking::kContinuous) {
    motions = std::make_shared<TimedMotions>(si, exact, &clock);
    si->setMotionValidator(motions);
  }
  si->setup();
  auto definition = std::make_shared<ob::ProblemDefinition>(si);
  ob::ScopedState<> start(space), goal(space);
  write(space, problem.start, start.get());
  write(space, problem.goal, goal.get());
  definition->setStartAndGoalStates(start, goal);
  og::RRTConnect planner(si);
  planner.setProblemDefinition(definition);
  planner.setup();
  ob::IterationTerminationCondition iterations(kMostIterations);
  PlanningRun run;
  const auto begin = std::chrono::steady_clock::now();
  const double cpu = processor_seconds();
  planner.solve(ob::PlannerTerminationCondition(iterations));
  run.seconds = processor_seconds() - cpu;
  run.share = clock.seconds() / std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.found = definition->hasExactSolution();
  run.states = states->count();
  run.motions = motions ? motions->count() : 0;
  if (!run.found) return run;
  const auto path = std::dynamic_pointer_cast<og::PathGeometric>(definition->getSolutionPath());
  for (unsigned int i = 1; i < path->getStateCount(); ++i)
    run.bad_motions += !exact->checkMotion(path->getState(i - 1), path->getState(i));
  return run;
}

}  // namespace prescene::benchmarks
