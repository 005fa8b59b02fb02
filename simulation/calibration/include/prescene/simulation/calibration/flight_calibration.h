// SPDX-License-Identifier: Apache-2.0
// What free flights alone show of a thrown object, without any contact: where its centre of mass is (the tracked frame
// wobbles about the parabola that the centre flies on), how its moments of inertia compare (how its spin wanders), and
// gravity in the tracker's units, which gives the scale of its lengths and the tilt of its ground.
//
//   std::vector<std::span<const TimedPose>> flights;                // of each toss the frames before it first touches
//   PRESCENE_TRY(const FlightCalibration found, calibrate_flights(flights, prior));
//   ... found.center_of_mass, found.standard_error(FlightParameter::kCenterOfMassX)
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"
#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::simulation {

/// What is believed before any flight is seen: independent Gaussians.
struct FlightPrior {
  geometry::Vector3d center_of_mass = geometry::Vector3d::Zero();  ///< p_OoOcm, m
  double center_of_mass_deviation = 0.05;                          ///< m, each coordinate, > 0
  geometry::Vector3d gravity_W{0.0, 0.0, -9.81};                   ///< m/s^2
  double gravity_deviation = 1.0;                                  ///< m/s^2, each coordinate, > 0
  /// About the centre of mass, along O's axes, for 1 kg, m^2; positive definite. Its size does not matter.
  geometry::Matrix3d unit_inertia = geometry::Matrix3d::Identity();
  double inertia_deviation = 0.3;  ///< Of the natural logarithms of InertiaStretch, > 0.
};

/// The parameters' places in FlightCalibration::covariance.
enum class FlightParameter {
  kCenterOfMassX,
  kCenterOfMassY,
  kCenterOfMassZ,
  kGravityX,
  kGravityY,
  kGravityZ,
  kInertiaX,  ///< ln s_x
  kInertiaY,  ///< ln s_y; ln s_z is minus the sum of both.
};
inline constexpr int kFlightParameters = 8;

struct FlightCalibration {
  geometry::Vector3d center_of_mass = geometry::Vector3d::Zero();  ///< p_OoOcm, m
  geometry::Vector3d gravity_W = geometry::Vector3d::Zero();       ///< m/s^2, in the tracker's metres.
  /// The unit inertia is S J S with the prior's J and S = diag(sqrt(s_x), sqrt(s_y), sqrt(s_z)), s_x s_y s_z = 1.
  geometry::Vector3d inertia_stretch = geometry::Vector3d::Ones();
  /// Of the parameters' errors, in the order of FlightParameter: flights are independent, the frames of one need not be
  /// [Liang & Zeger 1986]; the prior's part is added.
  Eigen::Matrix<double, kFlightParameters, kFlightParameters> covariance;
  /// Standard deviation after the flights over that before; 1: they say nothing about it, and it is the prior's.
  Eigen::Matrix<double, kFlightParameters, 1> left_of_prior;
  double position_noise = 0.0;  ///< Of a frame's coordinate, m, robust against outliers.
  double rotation_noise = 0.0;  ///< rad, likewise.
  int flights = 0;              ///< That were used.
  int frames = 0;

  double standard_error(FlightParameter parameter) const {
    const auto i = static_cast<Eigen::Index>(parameter);
    return std::sqrt(covariance(i, i));
  }
  /// The object's inertia as the flights have it, for 1 kg; its size is the prior's.
  geometry::Matrix3d unit_inertia(const FlightPrior& prior) const;
};

/// Flights of fewer than kLeastFlightFrames frames are left out. Each flight has a state of its own (12 numbers), all
/// share the parameters: weighted least squares over poses, with Huber's weights for frames that are far off. Fails
/// with kInvalidInput for fewer than three flights, times that do not ascend, poses that are not finite, more than a
/// quarter turn between frames, or a prior that is not as said.
inline constexpr int kLeastFlightFrames = 5;
core::Result<FlightCalibration> calibrate_flights(std::span<const std::span<const TimedPose>> flights,
                                                  const FlightPrior& prior);

}  // namespace prescene::simulation
