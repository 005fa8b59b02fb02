// SPDX-License-Identifier: Apache-2.0
// Degrees, which people read and write; everything else is in radians.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace prescene::geometry {

/// Radians in a degree.
inline constexpr double kDegree = std::numbers::pi / 180.0;
/// Degrees in a radian.
inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

/// The number of degrees that times kDegree is exactly `radians`, where there is one; else the nearest. For writing
/// angles that are read back as the same bits.
inline double exact_degrees(double radians) {
  const double degrees = radians / kDegree;
  for (const double near : {std::nextafter(degrees, -1e300), std::nextafter(degrees, 1e300)})
    if (kDegree * degrees != radians && kDegree * near == radians) return near;
  return degrees;
}

/// Roll about x, then pitch about y, then yaw about z, each about the fixed axes (the convention of URDF), in degrees.
inline Eigen::Quaterniond rotation_from_euler_deg(const Eigen::Vector3d& roll_pitch_yaw) {
  const Eigen::Vector3d angles = kDegree * roll_pitch_yaw;
  return Eigen::Quaterniond(Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()));
}

}  // namespace prescene::geometry
