// SPDX-License-Identifier: Apache-2.0
// Finds where a mesh of spheres (collision/spheres/surface_spheres.h) touches or will touch another shape within a
// step. The trees find the spheres that are near enough; each then stands for its part of the surface:
//   - a sphere against the other's surface, at the sphere's lowest point, with the other's normal;
//   - the other's nearest point against the sphere's patch of surface, with the patch's normal.
// Both are places of the bodies, so a gap is never reported smaller than it is, and the smallest of all is the bodies'.
// What is found is a function of poses and velocities alone.
#pragma once

#include <memory>
#include <vector>

#include "contact_finder.h"
#include "near_faces.h"
#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/simulation/rules/sphere_rules.h"

namespace prescene::simulation {

/// How a body moves in a step before its contacts act, W.
struct BodyMotion {
  Vector3d center = Vector3d::Zero();    ///< What the velocity is of.
  Vector3d velocity = Vector3d::Zero();  ///< m/s
  Vector3d spin = Vector3d::Zero();      ///< rad/s

  Vector3d at(const Vector3d& p) const { return velocity + spin.cross(p - center); }
  /// Acceleration of a point of the body by its turning.
  Vector3d towards_center(const Vector3d& p) const { return spin.cross(spin.cross(p - center)); }
};

/// One body's share of a query.
struct MovingFrame {
  Frame X;
  BodyMotion motion;
};

/// Scratch memory: one a thread. All functions append the contacts of A against B that are at most `range` (m) apart,
/// at most kMostSphereContacts (prescene/simulation/rules/sphere_rules.h).
class SphereContactFinder {
 public:
  SphereContactFinder();
  ~SphereContactFinder();

  void spheres_convex(const collision::SurfaceSpheres& a, const MovingFrame& A, const ConvexCore& b,
                      const MovingFrame& B, double range, double dt, std::vector<ContactPoint>& contacts);
  void spheres_surface(const collision::SurfaceSpheres& a, const MovingFrame& A, const SurfaceShape& b,
                       const MovingFrame& B, double range, double dt, std::vector<ContactPoint>& contacts);
  void spheres_spheres(const collision::SurfaceSpheres& a, const MovingFrame& A, const collision::SurfaceSpheres& b,
                       const MovingFrame& B, double range, double dt, std::vector<ContactPoint>& contacts);

  /// A node of a tree and its level, 1 for the root.
  struct OnTheWay {
    std::uint32_t node = 0, level = 0;
  };

 private:
  struct Found {
    ContactPoint point;
    double at_end = 0.0;  // the gap at the end of the step if nothing were in the way, m
    double spread = 0.0;
  };
  struct Flat {
    Eigen::Vector2d place;
    std::size_t index = 0;
    double outside = 0.0;  // of what is taken, m
  };
  void add(const ContactPoint& point, const MovingFrame& A, const MovingFrame& B, double dt);
  void reduce(const Frame& X_WA, std::vector<ContactPoint>& contacts);
  /// Takes a few of those that bear on one plane with the first, so that they stand on as much of it as all together;
  /// returns how many.
  std::size_t take_support_polygon(std::size_t first, double bearing, std::vector<ContactPoint>& contacts);
  void take(std::size_t index, std::vector<ContactPoint>& contacts);
  struct Pairs;

  std::vector<OnTheWay> stack_;
  std::vector<Found> found_;
  std::vector<Flat> flat_;
  collision::SphereScratch scratch_;
  std::unique_ptr<Pairs> pairs_;
  NearFaces faces_;
};

}  // namespace prescene::simulation
