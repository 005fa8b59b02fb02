// SPDX-License-Identifier: Apache-2.0
// The model of the tossed cube and of what is uncertain about a toss.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "prescene/belief/scene.h"
#include "prescene/simulation/rules/mechanics_options.h"

namespace prescene::service {

/// Lengths in the data's metres, which are about 2 % short: half edge and gravity belong together.
struct CubeModel {
  double half_edge = 0.0513;
  double gravity = 9.61;             ///< m/s^2
  double edge_radius = 0.003;        ///< Rounding of edges and corners, m.
  double mass = 0.37;                ///< kg; only ratios matter on a fixed board.
  double center_of_mass_z = 0.0055;  ///< From the middle towards the +z face, m: the cube is loaded.
  double unit_inertia = 2.79e-3;     ///< About x and y, m^2.
  double unit_inertia_z_ratio = 0.95;
  double sliding_friction = 0.217;  ///< Of the pair cube and board.
  double impact_friction = 0.164;
  double restitution = 0.25;
  double impact_speed = 0.2;  ///< m/s, see simulation::BulletOptions.
  double step = 1e-3;         ///< s

  // One standard deviation of the start given the fit, larger than the tracker's noise: it stands for all that the
  // simulation does not know of a toss.
  double position_noise = 0.003;   ///< m, each coordinate
  double rotation_noise = 0.0157;  ///< rad
  double velocity_noise = 0.03;    ///< m/s
  double spin_noise = 0.15;        ///< rad/s
  double friction_noise = 0.0;     ///< Relative, of both frictions together.
  double restitution_noise = 0.0;  ///< m/s per m/s

  // Forecasts of a place.
  double kernel_scale = 1.2;    ///< Regions of 64 samples then hold the share that they promise.
  double kernel_floor = 0.003;  ///< m

  std::string provenance;  ///< Where the numbers come from.
};

/// Read off the recordings, most of it without simulating: where the calibration starts.
CubeModel measured_cube_model();
/// What the general calibration found on the tosses at even places of the list; see docs/studies/accuracy.md.
CubeModel shipped_cube_model();
/// The data set's own description and plain contact settings, for comparison.
CubeModel described_cube_model();

/// One key a field, in the order of the struct.
nlohmann::ordered_json to_json(const CubeModel& model);

/// The cube as object 0 above a board whose surface is z = 0.
belief::Scene make_cube_scene(const CubeModel& model);
simulation::MechanicsOptions make_cube_options(const CubeModel& model);

}  // namespace prescene::service
