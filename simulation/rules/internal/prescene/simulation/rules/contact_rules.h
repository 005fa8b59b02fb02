// SPDX-License-Identifier: Apache-2.0
// What holds at contacts in every stepper: how two surfaces make one pair, how far edges are rounded, and which
// features touch by more than a point.
#pragma once

#include <algorithm>
#include <variant>
#include <vector>

#include "prescene/belief/object_model.h"

namespace prescene::simulation {

/// Of one body's surface. Objects bring theirs with each instance's draw; these are of what is not drawn.
struct SurfaceCoefficients {
  double friction = 0.0;         ///< While a contact slides or sticks.
  double impact_friction = 0.0;  ///< While it closes faster than MechanicsOptions::impact_speed.
  double restitution = 0.0;
  double rolling_arm = 0.0;  ///< m.
};

/// The means of a support's or a robot body's distributions.
inline SurfaceCoefficients mean_coefficients(const belief::ContactProperties& contact) {
  SurfaceCoefficients mean;
  mean.friction = belief::mean(contact.friction);
  mean.impact_friction = contact.impact_friction ? belief::mean(*contact.impact_friction) : mean.friction;
  mean.restitution = belief::mean(contact.restitution);
  mean.rolling_arm = contact.rolling_friction;
  return mean;
}

/// Of the ball that stands for whatever pushes (belief::Push): it does not bounce.
inline constexpr SurfaceCoefficients kPusherSurface{0.5, 0.5, 0.0, 0.0};

/// Of a pair of surfaces. Frictions and restitution are products: a smooth surface makes every pair smooth, and against
/// a reference surface of 1 a coefficient is that of the pair. The rolling arm is the longer one. The lockstep stepper
/// does the same in vectors (simulation/lockstep/impulse_load-inl.h: load_row and load_motion), and certificates take
/// the product of the smaller frictions of both bodies as a bound (simulation/outcomes/certified_motion.cc): what
/// changes here changes there, too. tests/simulation/lockstep hold both steppers to the same laws.
inline SurfaceCoefficients pair_of(const SurfaceCoefficients& a, const SurfaceCoefficients& b) {
  return {a.friction * b.friction, a.impact_friction * b.impact_friction, a.restitution * b.restitution,
          std::max(a.rolling_arm, b.rolling_arm)};
}

/// Whether spheres stand for the surface of one of the shapes.
inline bool collides_as_spheres(const std::vector<belief::CollisionShape>& shapes) {
  return std::any_of(shapes.begin(), shapes.end(), [](const belief::CollisionShape& shape) {
    const auto* mesh = std::get_if<belief::MeshShape>(&shape);
    return mesh && mesh->use == belief::MeshUse::kSpheres;
  });
}

/// Radius of a shape's rounded edges, m, for a rounding wanted and the radius of the ball that its core must hold: the
/// core keeps at least half of the thickness, since finding normals at its corners needs a body, not a point.
inline double rounded_edge(double rounding, double thinnest) { return std::min(rounding, 0.5 * thinnest); }

/// Cosine: features whose plane is steeper than this against the contact normal are not clipped. Their points would be
/// far apart along it, and the nearest point says it all.
inline constexpr double kSteepestFeature = 0.2;
/// m: a nearest point this much closer than every clipped one is a contact of its own.
inline constexpr double kSameGap = 1e-7;
/// m: contacts are made this much before they are needed, so that resting bodies keep theirs when they breathe.
inline constexpr double kContactMargin = 5e-4;
/// m: a contact may take over the impulses of one of the step before if it is no further from that than its bodies move
/// in a step and this: which of two neighbouring spheres bears is noise, and 3000 of them lie up to 5 mm apart on a box
/// of 10 cm.
inline constexpr double kSameContact = 5e-3;
/// Sine of the angle up to which two edges count as parallel and touch along their common part.
inline constexpr double kParallelEdges = 0.05;
/// Tilt, rad, up to which a round cap counts as flat and its rim keeps its points: where it is lowest would be noise.
inline constexpr double kFlatCap = 1e-3;
/// m/s and rad/s: speeds beyond it are a simulation that blew up.
inline constexpr double kLargestSpeed = 1e4;

}  // namespace prescene::simulation
