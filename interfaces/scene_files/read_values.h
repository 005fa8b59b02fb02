// SPDX-License-Identifier: Apache-2.0
// Readers of the values that scenes are made of: vectors, rotations, poses and distributions. Each reports what is
// wrong and then returns something harmless; the scene is used only when nothing was reported.
#pragma once

#include "prescene/belief/distribution.h"
#include "prescene/belief/object_model.h"
#include "prescene/interfaces/scene_files/binder.h"

namespace prescene::interfaces {

inline constexpr NumberRange kPosition{-1000.0, 1000.0, "give metres between -1000 and 1000", "m"};
/// Edges and radii of what may move.
inline constexpr NumberRange kObjectSize{1e-5, 20.0, "give metres, more than 0 and at most 20", "m"};
/// Edges of supports.
inline constexpr NumberRange kSupportSize{1e-5, 1000.0, "give metres, more than 0 and at most 1000", "m"};
inline constexpr NumberRange kMass{1e-6, 1e5, "give kg, more than 0 and at most 1e5", "kg"};
/// Of all there is: gases to metals.
inline constexpr NumberRange kDensity{0.1, 25000.0, "give kg/m^3 (water 1000, wood 600, steel 7850)"};
inline constexpr NumberRange kTime{0.0, 1e5, "give seconds between 0 and 1e5", "s"};
inline constexpr NumberRange kDuration{1e-4, 3600.0, "give seconds, more than 0 and at most 3600", "s"};
inline constexpr NumberRange kStep{1e-5, 0.02, "give 'auto' or seconds between 0.00001 and 0.02", "s"};
inline constexpr NumberRange kAngleDeg{-36000.0, 36000.0, "give degrees", "deg"};
inline constexpr NumberRange kSpeed{-1000.0, 1000.0, "give m/s between -1000 and 1000"};
inline constexpr NumberRange kTurnRate{-1000.0, 1000.0, "give rad/s between -1000 and 1000", "rad"};
inline constexpr NumberRange kFriction{0.0, 100.0,
                                       "give a Coulomb coefficient of at least 0 (ice 0.05, wood 0.4, rubber 1)"};
inline constexpr NumberRange kRestitution{0.0, 1.0, "give a coefficient between 0 (no bounce) and 1"};

/// A number, or {normal: [mean, sd], min, max}, {uniform: [low, high]}, {samples: [...]}. Where an end of the range is
/// an end in nature (`cut_low`, `cut_high`), a normal is cut there by itself.
belief::ScalarDistribution read_scalar(const LocatedValue& value, Problems& problems, const NumberRange& range,
                                       bool cut_low = false, bool cut_high = false);
/// [x, y, z], each a number or distribution; or {uniform: {from: [..], to: [..]}}.
belief::Vector3Distribution read_vector_distribution(const LocatedValue& value, Problems& problems,
                                                     const NumberRange& range);
/// [x, y, z] in numbers.
geometry::Vector3d read_vector(const LocatedValue& value, Problems& problems, const NumberRange& range);
/// x, -x, y, ... or a vector of any length, which is made a unit vector.
geometry::Vector3d read_axis(const LocatedValue& value, Problems& problems);
/// {quaternion_wxyz: [w, x, y, z]}, {quaternion_xyzw: [x, y, z, w]}, {euler_deg: [roll, pitch, yaw]}, {axis_angle_deg:
/// [x, y, z, angle]}. A quaternion has length 1 within what rounding by hand does.
geometry::Quaterniond read_rotation(const LocatedValue& value, Problems& problems);
/// {position, rotation} in numbers; both may be absent.
geometry::Pose read_pose(const LocatedValue& value, Problems& problems);
/// The same from the keys of a map that has others, too.
geometry::Pose read_pose_keys(Binder& binder);
/// {position, rotation, normal: {...}}, {samples: [...]}: see docs/reference/scene_files.md.
belief::PoseDistribution read_pose_distribution(const LocatedValue& value, Problems& problems);
/// [r, g, b] between 0 and 1, or "#rrggbb".
belief::Color read_color(const LocatedValue& value, Problems& problems);

}  // namespace prescene::interfaces
