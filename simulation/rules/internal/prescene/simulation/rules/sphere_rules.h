// SPDX-License-Identifier: Apache-2.0
// What holds in every stepper for bodies of spheres (collision/spheres/surface_spheres.h): where a sphere's part of the
// surface ends, what turning does to a contact, and which of many contacts of a pair are kept. Bullet's stepper follows
// it in double precision (simulation/bullet/sphere_contacts.h), the lockstep stepper in vectors of single precision
// (simulation/lockstep/lane_spheres.h); their tests compare the two.
#pragma once

#include <cstddef>

namespace prescene::simulation {

/// A patch ends this far (m) beyond its edge, so that things flush with it find it.
inline constexpr double kPatchRoom = 1e-6;
/// Share of a patch's reach: places deeper below it are inside of the body only if they are inside of its sphere.
/// (Below a wall there may be the body's floor, and below that nothing.)
inline constexpr double kShallow = 0.25;
/// m: facets of round things overlap by this much when they roll.
inline constexpr double kRollingOverlap = 5e-5;
/// Patches whose normals agree by more than this cosine are of the same side of two bodies and don't meet.
inline constexpr double kSameSide = 0.2;
/// Gaps that differ by less (m) are equal: the first pair of them counts.
inline constexpr double kSameSphereGap = 1e-9;

/// Most contacts of a pair of shapes of which one is of spheres: those that bear first, spread wide, and so that each
/// direction of contact has its own.
inline constexpr std::size_t kMostSphereContacts = 12;
/// Points whose gaps at the end of the step are within the first (m) of the least bear; within the second they may.
inline constexpr double kBearing = 3e-5;
inline constexpr double kNearlyBearing = 2e-4;
inline constexpr std::size_t kMostBearing = 6;
inline constexpr std::size_t kMostNearlyBearing = 10;
/// Contacts bear on one plane when their normals differ by less than this (rad).
inline constexpr double kSameWay = 0.01;
/// Contacts nearer to each other than this (m) are one.
inline constexpr double kSamePlace = 3e-4;
/// What a change of direction (the difference of two normals) counts as in metres when contacts are spread.
inline constexpr double kTurnLength = 0.1;
/// m/s: what closes slower than this is not faster than what is apart by as much as it will be in a step. (Of slow
/// contacts the pose alone decides, or the sets of contacts of resting bodies change with each step's noise.)
inline constexpr double kSlow = 0.1;
/// In the frame of a body of spheres: of the contacts that bear, the outermost this way is taken first. (Which is the
/// deepest of them is noise. The direction is none of a box's edges.)
inline constexpr double kFirstWay[3] = {0.36, 0.48, 0.8};

}  // namespace prescene::simulation
