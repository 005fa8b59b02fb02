// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation take for granted.
#pragma once

#include <memory>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/core/status.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simplified_polytope.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation::given_simulation {

extern const belief::Scene scene;
extern core::ThreadPool pool;
extern const core::RandomStream stream;

namespace own_actions_h {
extern const std::unique_ptr<Simulator> simulator;
extern const std::vector<belief::WorldState> starts;
extern const RunRequest request;
extern std::vector<belief::Trajectory> runs;
}  // namespace own_actions_h

namespace shape_store_h {
extern const belief::MeshPtr mesh;
extern const Decomposer decomposer;
}  // namespace shape_store_h

namespace similarity_h {
extern std::unique_ptr<Simulator> simulator;
}  // namespace similarity_h

namespace simplified_polytope_h {
extern const ConvexPolytope hull;
}  // namespace simplified_polytope_h

namespace simulator_h {
core::Result<std::unique_ptr<Simulator>> make_simulator(const belief::Scene& scene);
extern const std::vector<belief::WorldState> starts;
extern const RunRequest request;
}  // namespace simulator_h

}  // namespace prescene::simulation::given_simulation
