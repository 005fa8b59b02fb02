// SPDX-License-Identifier: Apache-2.0
// A convex shape as a core and a radius: the shape is every point within `radius` of the core. Faces keep their true
// place (cores are made smaller by the radius), edges and corners are rounded by it. Bullet's GJK and EPA find the
// nearest points of two cores; as long as the cores are apart, the contact normal is exact and smooth.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>

#include <array>
#include <memory>
#include <vector>

#include "bullet_types.h"
#include "prescene/geometry/primitives.h"
#include "prescene/simulation/convex_polytope.h"

namespace prescene::simulation {

/// A face, edge or corner of a core, in the frame that the function says: one point, a segment, or a planar convex
/// polygon counter-clockwise seen from outside with its outward normal.
struct Feature {
  static constexpr int kMaxCorners = 32;  ///< Of a core's side; larger ones leave out corners evenly.
  /// A side that is clipped to another gains at most one point an edge.
  static constexpr int kMaxPoints = 2 * kMaxCorners;
  int count = 0;
  std::array<Vector3d, kMaxPoints> points;
  Vector3d normal = Vector3d::Zero();

  void clear() { count = 0; }
  void add(const Vector3d& p) {
    if (count < kMaxPoints) points[static_cast<std::size_t>(count++)] = p;
  }
  const Vector3d& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
  Vector3d& operator[](int i) { return points[static_cast<std::size_t>(i)]; }
};

/// Immutable after construction (a triangle's corners excepted); frame S is the shape's own.
class ConvexCore : public btConvexInternalShape {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// `rounding` (m, > 0): wanted radius of edges and corners; smaller where the shape is too thin for it.
  static std::unique_ptr<ConvexCore> from_primitive(const geometry::Primitive& primitive, double rounding);
  static std::unique_ptr<ConvexCore> from_polytope(const ConvexPolytope& polytope, double rounding);
  /// A bare triangle (radius 0), whose corners set_triangle() sets again and again.
  static std::unique_ptr<ConvexCore> triangle();
  void set_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c);

  double radius() const { return radius_; }
  /// A point inside.
  const Vector3d& center() const { return center_; }
  /// The whole shape's bounding box in S, radius included.
  const Vector3d& box_center() const { return box_center_; }
  const Vector3d& box_half_size() const { return box_half_size_; }
  /// The feature of the core that faces `direction` (unit, S): the best aligned face of a polytope, the cap or the side
  /// line of a cylinder or cone, the segment of a capsule, the point of a sphere.
  void facing(const Vector3d& direction, Feature& feature) const;
  /// Of a cylinder: the radius of its rims and z of the upper and the lower one. Else nothing.
  const Vector3d* rims() const { return kind_ == Kind::kCylinder ? &half_ : nullptr; }
  /// Where the core is nearest to a point.
  struct Nearest {
    double distance = 0.0;                ///< m; negative inside of the core.
    Vector3d normal = Vector3d::UnitZ();  ///< Unit: the direction in which the distance grows.
    bool flat = false;                    ///< That place is on a flat face, and not on its rim.
  };
  /// Of a point in S. Not of triangles (checked).
  Nearest nearest(const Vector3d& p) const;
  /// The same with only some faces of a polytope, those of faces_about() for a ball that holds the point. Of points
  /// that are farther away than `limit` (m) the distance is merely beyond it.
  Nearest nearest(const Vector3d& p, const std::vector<std::uint32_t>& faces, double limit) const;
  /// Faces of a polytope that decide nearest() for points in a ball: those that may be the highest below one of them,
  /// and those that one of them may be over; of `given`, which holds those of a ball about it. Ascending.
  void faces_about(const Vector3d& center, double ball, const std::vector<std::uint32_t>& given,
                   std::vector<std::uint32_t>& faces) const;
  std::size_t face_count() const { return polytope_.faces.size(); }  ///< 0 unless it is a polytope.

  // btConvexShape
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override;
  btVector3 localGetSupportingVertex(const btVector3& direction) const override {
    return localGetSupportingVertexWithoutMargin(direction);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices,
                                                         int count) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  void getAabb(const btTransform& transform, btVector3& low, btVector3& high) const override;
  const char* getName() const override { return "ConvexCore"; }

 private:
  enum class Kind { kPoint, kSegment, kBox, kPolytope, kCylinder, kCone, kTriangle };
  explicit ConvexCore(Kind kind);
  Vector3d support(const Vector3d& direction) const;
  void set_bounds(const Vector3d& low, const Vector3d& high);
  void cap(double z, const Vector3d& direction, Feature& feature) const;
  template <class FaceAt>
  Nearest nearest_of_polytope(const Vector3d& p, double limit, std::size_t count, const FaceAt& face_at) const;

  Kind kind_;
  double radius_ = 0.0;
  Vector3d center_ = Vector3d::Zero();
  Vector3d box_center_ = Vector3d::Zero();
  Vector3d box_half_size_ = Vector3d::Zero();
  Vector3d half_ = Vector3d::Zero();  // box: half edges; segment: z; cylinder and cone: (rim radius, top z, bottom z)
  ConvexPolytope polytope_;
  std::array<Vector3d, 3> triangle_;
};

}  // namespace prescene::simulation
