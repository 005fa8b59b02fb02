// SPDX-License-Identifier: Apache-2.0
#include "made_tosses.h"

#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/bullet/bullet_simulator.h"

namespace prescene::service::tests {

using geometry::Vector3d;

std::vector<CubeToss> made_tosses(const CubeModel& model, int count) {
  simulation::ShapeStore shapes;
  const belief::Scene scene = make_cube_scene(model);
  const auto simulator =
      *simulation::make_bullet_simulator(scene, shapes, simulation::BulletOptions{make_cube_options(model)});
  core::RandomStream stream(21, core::Purpose::kTest);
  std::vector<CubeToss> tosses;
  for (int i = 0; i < count; ++i) {
    const auto instance = simulator->make_instance({}, stream);
    belief::WorldState start = belief::mean_start(scene);
    start.objects[0].X_WO = {geometry::uniform_rotation(stream), {0.2, 0.1, 0.2}};
    start.objects[0].V_WO.linear = Vector3d(-1.0, -0.5, 0.2) + 0.2 * geometry::normal_vector(stream);
    start.objects[0].V_WO.angular = 3.0 * geometry::normal_vector(stream);
    instance->set_state(start);
    CubeToss toss;
    toss.number = 2 * i;
    for (int row = 0; row < 250; ++row) {
      const belief::WorldState state = instance->state();
      toss.frames.push_back({state.time, state.objects[0].X_WO});
      while (instance->state().time < (row + 1) / 148.0) instance->step();
    }
    tosses.push_back(toss);
  }
  return tosses;
}

}  // namespace prescene::service::tests
