// SPDX-License-Identifier: Apache-2.0
// Uncertain starts, run here and by MuJoCo: outcome probabilities agree within sampling where nothing but mechanics
// decides. The benchmark `engines` compares all twenty scenes; docs/studies/uncertain_physics.md tells where they
// disagree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/peers/scene_mujoco.h"
#include "tests/support/engine_scenes.h"

namespace prescene::tests {
namespace {

#ifdef NDEBUG
constexpr int kStarts = 192;
#else
constexpr int kStarts = 24;
#endif

void expect_agreement(const std::string& name, double same_end) {
  const std::vector<EngineScene> scenes = engine_scenes();
  const auto found = std::find_if(scenes.begin(), scenes.end(), [&](const auto& one) { return one.name == name; });
  ASSERT_NE(found, scenes.end()) << name;
  const auto& scene = found->scene;
  const simulation::Variable variable = simulation::variables_of(scene, {}, scene->exclusive_outcomes)[0];
  const simulation::StartDistribution distribution = simulation::start_of(scene);
  const simulation::StartSampler sampler(distribution.components[0], 5);
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < kStarts; ++i) starts.push_back(sampler.draw(static_cast<std::uint32_t>(i)));

  simulation::ShapeStore shapes;
  const auto simulator = *simulation::make_bullet_simulator(*scene, shapes);
  simulation::RunRequest request;
  request.stop.duration = scene->duration;
  std::vector<belief::Trajectory> runs(starts.size());
  core::ThreadPool pool(2);
  simulator->run(starts, request, core::RandomStream(1, core::Purpose::kTest), 0, pool, runs);

  MujocoScene mujoco(*scene);
  std::vector<double> ours(variable.classes.size(), 0.0), theirs(ours);
  double same = 0.0;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const belief::Trajectory run = mujoco.run(starts[i], scene->duration);
    ASSERT_NE(run.end, belief::TrajectoryEnd::kDiverged) << name << " " << i;
    const int here = variable.classify(runs[i]), there = variable.classify(run);
    ours[static_cast<std::size_t>(here)] += 1.0 / kStarts;
    theirs[static_cast<std::size_t>(there)] += 1.0 / kStarts;
    same += here == there ? 1.0 / kStarts : 0.0;
  }
  const auto half = [](double p) { return 1.645 * std::sqrt(std::max(p * (1.0 - p), 0.25 / kStarts) / kStarts); };
  for (std::size_t c = 0; c < ours.size(); ++c)
    EXPECT_NEAR(ours[c], theirs[c], half(ours[c]) + half(theirs[c])) << name << ", " << variable.classes[c];
  EXPECT_GE(same, same_end - half(same_end)) << name;
  // Both classes happen, or agreement would say little.
  EXPECT_GT(std::count_if(ours.begin(), ours.end(), [](double p) { return p > 0.1; }), 1) << name;
}

TEST(MujocoAgreement, CylindersDroppedAnyWayRound) { expect_agreement("cylinder dropped any way round", 0.98); }
TEST(MujocoAgreement, MilkCartonsDroppedTilted) { expect_agreement("milk carton dropped tilted", 0.98); }
TEST(MujocoAgreement, AnglesLetGoTilted) { expect_agreement("angle of two boxes let go tilted", 0.98); }
TEST(MujocoAgreement, BoxesThatSlideToAStop) { expect_agreement("box slides to a stop", 0.95); }
TEST(MujocoAgreement, BallsThatSlideThenRoll) { expect_agreement("ball slides, then rolls", 0.95); }

TEST(MujocoAgreement, ABounceIsSetByItsDampingRatio) {
  // Undamped, all comes back. Bounces take some milliseconds in which gravity acts, so that e is met within 0.04.
  EXPECT_NEAR(damping_ratio_of(1.0), 0.0, 1e-6);
  EXPECT_GT(damping_ratio_of(0.1), damping_ratio_of(0.5));
  belief::Scene scene = *engine_scenes()[18].scene;
  scene.supports.pop_back();  // the fence
  belief::WorldState start = belief::mean_start(scene);
  start.objects[0].V_WO = {};
  start.objects[0].X_WO.translation.z() = 0.02 + 0.4;
  for (const double e : {0.5, 0.7, 0.9}) {
    start.objects[0].physical.restitution = e;
    // At the highest point after the bounce: sqrt(2 h / g) (1 + e).
    const double time = std::sqrt(2.0 * 0.4 / 9.81) * (1.0 + e);
    const double height = MujocoScene(scene).run(start, time).final().objects[0].X_WO.translation.z() - 0.02;
    EXPECT_NEAR(std::sqrt(height / 0.4), e, 0.04) << e;
  }
}

}  // namespace
}  // namespace prescene::tests
