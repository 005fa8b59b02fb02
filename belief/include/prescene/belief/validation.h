// SPDX-License-Identifier: Apache-2.0
// The ranges that values of the belief have to lie in, and the checks that validate(ObjectModel) and validate(Scene)
// are made of. Each message says what is wrong and what to write instead; the caller puts the place before it.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/object_model.h"

namespace prescene::belief {

struct Outcome;

/// Closed range of a quantity. A hard end is physical, normals have to be cut there; the others only catch slips.
struct ScalarRange {
  double low;
  double high;
  const char* remedy;
  bool hard_low = false;
  bool hard_high = false;
};

inline constexpr ScalarRange kMassRange{1e-9, 1e6, "give a mass in kg, from 1e-9 to 1e6", true};
inline constexpr ScalarRange kLengthRange{-1e4, 1e4, "give metres between -1e4 and 1e4"};
inline constexpr ScalarRange kSpeedRange{-1e4, 1e4, "give m/s or rad/s between -1e4 and 1e4"};
inline constexpr ScalarRange kFrictionRange{
    0.0, 1e3, "give a Coulomb coefficient of at least 0 (steel on ice 0.03, rubber 1)", true};
inline constexpr ScalarRange kRestitutionRange{0.0, 1.0, "give a coefficient between 0 (no bounce) and 1", true, true};

/// m from W's origin, of things of a household: see world_radius() in scene_size.h.
inline constexpr double kWorldRadius = 20.0;
/// An object that rests on one lighter by more than this factor is not held up: what one step of the contact solver's
/// iterations passes on through the light one is too little.
inline constexpr double kGreatestMassRatio = 100.0;

core::Status check_name(const std::string& name);
/// All draws of the distribution are finite and within the range, its parameters are well formed.
core::Status check_scalar(const ScalarDistribution& distribution, const ScalarRange& range);
core::Status check_vector(const Vector3Distribution& distribution, const ScalarRange& range);
/// Finite, unit quaternion (within 1e-6).
core::Status check_pose(const Pose& pose);
/// Finite values, unit quaternions, a covariance that is symmetric and positive semidefinite, samples not empty.
core::Status check_pose(const PoseDistribution& distribution);
/// At least one; sizes positive and finite; meshes there and not empty.
core::Status check_shapes(const std::vector<CollisionShape>& shapes);
/// Half the smallest extent, along its own axes, of the thinnest of the shapes, m: no edge can be rounder. Infinite
/// where there is none.
double thinnest_half(const std::vector<CollisionShape>& shapes);
core::Status check_contact(const ContactProperties& contact);
core::Status check_color(const Color& color);
/// Whenever `later` holds, `earlier` does, as far as their lists of conditions show it.
bool is_implied(const Outcome& earlier, const Outcome& later);

}  // namespace prescene::belief
