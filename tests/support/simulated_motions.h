// SPDX-License-Identifier: Apache-2.0
// Tosses and slides of a box with known properties, as a tracker would record them.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/random.h"
#include "prescene/simulation/simulator.h"

namespace prescene::tests {

struct BoxTruth {
  double friction = 0.22;
  double impact_friction = 0.16;
  double restitution = 0.3;
  double inertia_size = 0.0;  ///< Natural logarithm of the factor.
  double edge_radius = 0.002;
  geometry::Vector3d center_of_mass = geometry::Vector3d::Zero();
};
/// A cube of 10 cm and 0.4 kg, object 0, and a board whose upper face is z = 0 and whose friction and restitution
/// are 1.
belief::Scene box_scene(const BoxTruth& truth);
/// The same scene as a file.
std::string box_scene_yaml(const BoxTruth& truth);

struct SimulatedMotion {
  std::vector<double> times;
  std::vector<geometry::Pose> X_WO;
  double first_contact = 0.0;  ///< s
};
struct TrackerNoise {
  double position = 2e-4;  ///< m
  double rotation = 2e-3;  ///< rad
};
/// Frames at 120 Hz of boxes thrown from 25 to 35 cm, spinning.
std::vector<SimulatedMotion> simulated_tosses(const belief::Scene& scene, const simulation::Simulator& simulator,
                                              int count, core::RandomStream stream, core::ThreadPool& pool,
                                              const TrackerNoise& noise = {});
/// Of what is dropped from 15 to 30 cm with a spin of up to 20 rad/s about each axis.
std::vector<SimulatedMotion> simulated_spins(const belief::Scene& scene, const simulation::Simulator& simulator,
                                             int count, core::RandomStream stream, core::ThreadPool& pool,
                                             const TrackerNoise& noise = {});
/// Of boxes that lie flat on the board and slide at 0.8 to 1.2 m/s.
std::vector<SimulatedMotion> simulated_slides(const belief::Scene& scene, const simulation::Simulator& simulator,
                                              int count, core::RandomStream stream, core::ThreadPool& pool,
                                              const TrackerNoise& noise = {});

/// tosses.csv of a data set: columns toss, t, x, y, z, qw, qx, qy, qz.
std::string motion_table(const std::vector<SimulatedMotion>& motions);

}  // namespace prescene::tests
