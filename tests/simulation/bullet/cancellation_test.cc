// SPDX-License-Identifier: Apache-2.0
// Runs that are called off.
#include <gtest/gtest.h>

#include <chrono>

#include "prescene/simulation/bullet/bullet_simulator.h"
#include "tests/support/simple_scenes.h"

namespace prescene::tests {
namespace {

TEST(BulletCancellation, EndsARunWithinAStepOfAHeap) {
  // A thousand boxes in one place: half a million pairs touch, and a step takes many seconds.
  Scene scene;
  scene.supports.push_back(floor_support());
  scene.models.push_back(primitive_model("box", geometry::BoxShape{{0.1, 0.1, 0.1}}));
  for (int i = 0; i < 1000; ++i) {
    belief::SceneObject object;
    object.name = "box" + std::to_string(i);
    object.model = 0;
    scene.objects.push_back(object);
  }
  simulation::ShapeStore shapes;
  const auto simulator = simulation::make_bullet_simulator(scene, shapes);
  ASSERT_TRUE(simulator.ok()) << simulator.status().message();
  const belief::WorldState start = belief::mean_start(scene);
  simulation::RunRequest request;
  request.stop.duration = 2.0;
  const core::Cancellation never;
  const core::Cancellation soon(never, core::Cancellation::Clock::now() + std::chrono::milliseconds(50));
  core::ThreadPool pool(1);
  belief::Trajectory run;
  // What shows a step that goes on for minutes is the time that CTest gives a test.
  (*simulator)->run({&start, 1}, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, {&run, 1}, &soon);
  EXPECT_EQ(run.end, belief::TrajectoryEnd::kCancelled);
}

}  // namespace
}  // namespace prescene::tests
