// SPDX-License-Identifier: Apache-2.0
// The scenes with hollow things: no run gains energy, nothing ends in anything, and what is said to hang or to stay
// inside does by its own geometry.
#include <gtest/gtest.h>

#include <algorithm>

#include "prescene/service/load_scene.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "recorded_scenario.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

using geometry::Vector3d;

struct Runs {
  std::shared_ptr<const belief::Scene> scene;
  std::unique_ptr<simulation::Simulator> simulator;
  std::vector<belief::Trajectory> all;
  core::ThreadPool pool{2};
};

/// In both steppers.
class HollowThings : public testing::TestWithParam<bool> {
 protected:
  static void run_scenario(const std::string& name, int count, Runs* runs);
};
INSTANTIATE_TEST_SUITE_P(Steppers, HollowThings, testing::Bool(),
                         [](const auto& lockstep) { return lockstep.param ? "lockstep" : "bullet"; });

void HollowThings::run_scenario(const std::string& name, int count, Runs* runs) {
  runs->scene = scenario(name);
  ASSERT_NE(runs->scene, nullptr);
  simulation::ShapeStore shapes;
  auto made = GetParam() ? simulation::make_lockstep_simulator(*runs->scene, shapes, {})
                         : simulation::make_bullet_simulator(*runs->scene, shapes, {});
  ASSERT_TRUE(made.ok()) << made.status().message();
  runs->simulator = *std::move(made);
  const simulation::StartDistribution starts = simulation::start_of(runs->scene);
  const simulation::StartSampler sampler(starts.components[0], 7);
  std::vector<belief::WorldState> states;
  for (int i = 0; i < count; ++i) states.push_back(sampler.draw(static_cast<std::uint32_t>(i)));
  runs->all.resize(states.size());
  simulation::RunRequest request;
  request.stop.duration = runs->scene->duration;
  request.sample_interval = 1.0 / 60.0;
  runs->simulator->run(states, request, core::RandomStream(1, core::Purpose::kTest), 0, runs->pool, runs->all);
}

/// Of all objects together, J.
double energy(const belief::Scene& scene, const belief::WorldState& state) {
  double sum = 0.0;
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const belief::ObjectState& object = state.objects[i];
    const geometry::Matrix3d R = object.X_WO.rotation.toRotationMatrix();
    const Vector3d w = R.transpose() * object.V_WO.angular;
    const Vector3d arm = R * object.physical.center_of_mass;
    const Vector3d v = object.V_WO.linear + object.V_WO.angular.cross(arm);
    sum +=
        object.physical.mass * (0.5 * v.squaredNorm() + 0.5 * w.dot(scene.model_of(scene.objects[i]).unit_inertia * w) -
                                scene.gravity_W.dot(object.X_WO.translation + arm));
  }
  return sum;
}

/// How deep things are in each other, as the first step from there finds it, m.
double overlap(const Runs& runs, const belief::WorldState& state) {
  std::vector<belief::Trajectory> one(1);
  simulation::RunRequest request;
  request.stop.duration = 1.0 / 240.0;
  core::ThreadPool pool(1);
  runs.simulator->run({&state, 1}, request, core::RandomStream(1, core::Purpose::kTest), 0, pool, one);
  return one[0].deepest_overlap;
}

void expect_sound(const Runs& runs) {
  for (std::size_t i = 0; i < runs.all.size(); ++i) {
    const belief::Trajectory& run = runs.all[i];
    ASSERT_NE(run.end, belief::TrajectoryEnd::kDiverged) << i;
    // What starts in each other is parted, which lifts it.
    const double start = energy(*runs.scene, run.start());
    const double tolerance = 2e-3 + (run.deepest_overlap > 0.0 ? 4.0 * run.deepest_overlap : 0.0);
    for (const belief::WorldState& state : run.states)
      ASSERT_LT(energy(*runs.scene, state), start + tolerance) << "run " << i << " at " << state.time;
    EXPECT_LT(overlap(runs, run.final()), 2e-3) << i;
  }
}

struct Rod {
  Vector3d from, to;
  double radius;
};
double gap(const Rod& a, const Rod& b) {
  constexpr int kPlaces = 400;
  double nearest = 1e9;
  for (int i = 0; i <= kPlaces; ++i) {
    const Vector3d p = a.from + (a.to - a.from) * i / kPlaces;
    const Vector3d along = b.to - b.from;
    const double t = std::clamp((p - b.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (p - b.from - t * along).norm());
  }
  return nearest - a.radius - b.radius;
}

std::vector<Rod> rods(const std::vector<belief::CollisionShape>& shapes, const geometry::Pose& X_WO) {
  std::vector<Rod> found;
  for (const belief::CollisionShape& shape : shapes) {
    const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape);
    const auto* capsule = primitive ? std::get_if<geometry::Capsule>(&primitive->primitive) : nullptr;
    if (!capsule) continue;
    const geometry::Pose X = X_WO * primitive->X_OS;
    found.push_back({X * Vector3d(0.0, 0.0, -0.5 * capsule->length), X * Vector3d(0.0, 0.0, 0.5 * capsule->length),
                     capsule->radius});
  }
  return found;
}

TEST_P(HollowThings, AMugHangsOnItsHandleOrFallsToTheFloor) {
  Runs runs;
  ASSERT_NO_FATAL_FAILURE(run_scenario("mug_on_hook", 192, &runs));
  expect_sound(runs);
  const auto variables = simulation::variables_of(runs.scene, runs.scene->outcomes, runs.scene->exclusive_outcomes);
  int hanging = 0;
  for (std::size_t i = 0; i < runs.all.size(); ++i) {
    const belief::Trajectory& run = runs.all[i];
    if (variables[0].classify(run) != 0) {
      EXPECT_LT(run.final().objects[0].X_WO.translation.z(), -0.5) << i;
      continue;
    }
    ++hanging;
    const geometry::Pose& X_WM = run.final().objects[0].X_WO;
    const Rod peg = rods(runs.scene->supports[2].collision, runs.scene->supports[2].X_WS).at(0);
    double nearest = 1e9;
    for (const Rod& rod : rods(runs.scene->models[0].collision, X_WM)) nearest = std::min(nearest, gap(rod, peg));
    EXPECT_NEAR(nearest, 0.0, 1e-3) << i;
    // The peg's axis crosses the handle's plane between cup and handle.
    const Vector3d from = X_WM.inverse() * peg.from;
    const Vector3d to = X_WM.inverse() * peg.to;
    ASSERT_LT(from.y() * to.y(), 0.0) << i;
    const Vector3d at = from + (to - from) * from.y() / (from.y() - to.y());
    EXPECT_GT(at.x(), 0.04) << i;
    EXPECT_LT(at.x(), 0.0675) << i;
    EXPECT_GT(at.z(), 0.0) << i;
    EXPECT_LT(at.z(), 0.07) << i;
    // The centre of mass has come below the peg.
    EXPECT_LT((X_WM * run.final().objects[0].physical.center_of_mass).z(), peg.from.z()) << i;
  }
  EXPECT_GT(hanging, 96);
  EXPECT_LT(hanging, 180);
}

TEST_P(HollowThings, ASpoonStaysInTheMugTipsItOrMisses) {
  Runs runs;
  ASSERT_NO_FATAL_FAILURE(run_scenario("spoon_in_mug", 32, &runs));
  expect_sound(runs);
  const auto variables = simulation::variables_of(runs.scene, runs.scene->outcomes, runs.scene->exclusive_outcomes);
  std::vector<int> counts(4, 0);
  for (std::size_t i = 0; i < runs.all.size(); ++i) {
    const belief::WorldState& end = runs.all[i].final();
    const int found = variables[0].classify(runs.all[i]);
    ++counts[static_cast<std::size_t>(found)];
    const Vector3d bowl_M = end.objects[0].X_WO.inverse() * (end.objects[1].X_WO * Vector3d(0.0, 0.0, 0.019));
    const Vector3d tip_M = end.objects[0].X_WO.inverse() * (end.objects[1].X_WO * Vector3d(0.0, 0.0, 0.169));
    const bool bowl_inside = bowl_M.head<2>().norm() < 0.037 && bowl_M.z() > 0.0 && bowl_M.z() < 0.1;
    const bool tip_inside = tip_M.head<2>().norm() < 0.037 && tip_M.z() > 0.0 && tip_M.z() < 0.1;
    if (found == 0) {
      EXPECT_TRUE(bowl_inside || tip_inside) << i;
      EXPECT_NEAR(end.objects[0].X_WO.translation.z(), 0.0, 1e-3) << i;  // stands on the table
    }
    if (found == 2) {
      EXPECT_FALSE(bowl_inside) << i;
      EXPECT_LT((end.objects[1].X_WO * Vector3d(0.0, 0.0, 0.1)).z(), 0.1) << i;
    }
    // Wherever it is, it is above the table.
    for (const Rod& rod : rods(runs.scene->models[1].collision, end.objects[1].X_WO))
      EXPECT_GT(std::min(rod.from.z(), rod.to.z()) - rod.radius, -1e-3) << i;
  }
  for (const int which : {0, 1, 2}) EXPECT_GT(counts[static_cast<std::size_t>(which)], 2) << which;
}

}  // namespace
}  // namespace prescene::tests
