// SPDX-License-Identifier: Apache-2.0
// What is sure of the way that each object of an instance still has: how high it may get, whether it stays on its face,
// whether it has fallen past everything.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/simulation/outcomes/certifier.h"
#include "prescene/simulation/outcomes/face_trap.h"

namespace prescene::simulation {

/// Rooms for what steppers do that bounds on energy don't know of. The values are of things of household size.
struct Rooms {
  double rise = 5e-4;          ///< m: overlap that is pushed out lifts bodies by less.
  double barrier = 2.5e-4;     ///< m below a barrier that still counts as over it.
  double slide = 3e-3;         ///< m: sliding to a stop may go on by this much more than friction says.
  double tipped = 5e-3;        ///< m beyond the side of a thing from which a convex body does not come back.
  double sunk = 2e-3;          ///< m: resting bodies sink less deep into what they lie on.
  double beside = 0.01;        ///< m around a body within which things count as beside it.
  double air = 0.03;           ///< m around a volume in which ways into it and out of it are looked for, at least.
  double ball = 1e-3;          ///< m that surfaces come into the ball of SpillLevels: by sinking in, and by facets.
  double center = 2e-3;        ///< m: play of an uncertain centre of mass.
  double settle_time = 0.5;    ///< s: what stands on its face is at rest by then.
  double collapse_time = 0.5;  ///< s: after it landed and bounced, a body has come down from its corner by then.

  /// For instances that are simulated as similar ones (Simulator::length_scale()).
  static Rooms of(double length_scale);
};

/// What of an object does not change from instance to instance.
struct CertifiedObject {
  ConvexPolytope hull;                 ///< Of the whole body, in O.
  ConvexPolytope bearing;              ///< What of the hull is sure to hold planes off, in O.
  std::vector<ConvexPolytope> shapes;  ///< In O.
  Vector3d center_of_mass = Vector3d::Zero();
  double rise = 0.0;          ///< How far the body may leave the hull, m.
  double center_play = 0.0;   ///< How far an instance's centre of mass may be from that, m.
  double inner_radius = 0.0;  ///< Of a ball about any such centre that the body holds, m; 0 = none known.
  double outer_radius = 0.0;  ///< Of a ball about any such centre that holds the body, m.
  double edge_radius = 0.0;   ///< m
  bool convex = false;        ///< All of one convex shape.
  bool rolls = false;         ///< Some faces meet at hardly any edge.
  double rolling_arm = 0.0;   ///< m
};

/// One object of one instance.
struct SureMotion {
  Vector3d center = Vector3d::Zero();  ///< Of mass, W.
  Vector3d velocity = Vector3d::Zero();
  Vector3d angular_velocity = Vector3d::Zero();
  double weight = 0.0;   ///< N
  double kinetic = 0.0;  ///< J
  double spin = 0.0;     ///< J, of these in turning
  double highest = 0.0;  ///< z that the centre of mass can't exceed, m.
  geometry::Box box;     ///< Of the hull as it is now, W.
  /// It stays on its lowest face, on a plane.
  std::optional<Trap> trap;
  double plane = 0.0;       ///< z of the plane below it.
  int base = -1;            ///< Body whose plane it is, numbered as in ContactInterval.
  double inside = 0.0;      ///< Distance from below the centre of mass to where that plane ends, m.
  double hop = 0.0;         ///< How far the centre of mass may still fly sideways, m.
  double slide_time = 0.0;  ///< It has slid to a stop on that plane by then, s.
  double reach = 0.0;       ///< How far it may still go sideways altogether, m.
  /// z that the centre of mass can't get below: it stays on its face, or rolls to a stop on the plane.
  std::optional<double> lowest;
  /// It has fallen past what is higher than this, and will not come up again: it lands here, or leaves the world below.
  std::optional<double> landing;
};

class MotionCertifier {
 public:
  /// Null where the scene is not understood. `world_radius` is that of the instances' StopRule, m.
  static std::unique_ptr<const MotionCertifier> make(const belief::Scene& scene, const CertifierOptions& options,
                                                     double world_radius);

  const std::vector<CertifiedObject>& objects() const { return objects_; }
  const Rooms& rooms() const { return rooms_; }
  /// Into `motions`; false where something is held, not as the scene says, or may leave the world.
  bool assess(const belief::WorldState& state, double seconds_left, std::vector<SureMotion>& motions) const;
  /// Nothing but `motions[object].base` is near enough to be touched while it stays there.
  bool alone_on_base(const std::vector<SureMotion>& motions, std::size_t object) const;
  /// The largest radius of a support's edges, m.
  double support_edge_radius() const { return support_edge_radius_; }
  /// All of the support is above `height`.
  bool support_above(int support, double height) const;

 private:
  struct FixedFace {
    LevelFace face;
    int support = 0;
  };
  struct FixedShape {
    geometry::Box box;
    int support = 0;
  };

  void stand(const belief::WorldState& state, std::vector<SureMotion>& motions) const;
  void bound_heights(const belief::WorldState& state, double seconds_left, std::vector<SureMotion>& motions) const;
  /// The least of the support below an object and of those beside it.
  double friction_about(const SureMotion& motion) const;
  void let_roll(const belief::WorldState& state, std::vector<SureMotion>& motions) const;
  /// z that the centres of mass of the objects without a trap do not get below before they could give what they have
  /// won by falling to another object, m.
  std::vector<double> lowest_centers(const belief::WorldState& state, double seconds_left,
                                     const std::vector<SureMotion>& motions) const;
  bool stays_in_world(const SureMotion& motion, const CertifiedObject& known) const;
  std::optional<double> landing_of(const std::vector<SureMotion>& motions, std::size_t object, double restitution,
                                   double seconds_left) const;

  Rooms rooms_;
  bool shorten_arms_ = true;
  double world_radius_ = 0.0;
  double gravity_ = 0.0;
  std::vector<CertifiedObject> objects_;
  std::vector<geometry::Matrix3d> unit_inertias_;
  std::vector<FixedFace> faces_;  // highest first
  std::vector<FixedShape> shapes_;
  std::vector<double> support_friction_;
  std::vector<double> support_rolling_arm_;
  double support_edge_radius_ = 0.0;
  double least_support_friction_ = std::numeric_limits<double>::infinity();
  bool robot_ = false;
};

}  // namespace prescene::simulation
