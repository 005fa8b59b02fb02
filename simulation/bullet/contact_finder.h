// SPDX-License-Identifier: Apache-2.0
// Finds where two shapes touch or will touch within a step: nearest points by Bullet's GJK and EPA, then the whole
// touching region by clipping the facing features against each other. Nothing is remembered from call to call, so the
// contacts are a function of the poses alone.
#pragma once

#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "convex_core.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/check.h"
#include "prescene/simulation/shape_store.h"

namespace prescene::simulation {

/// A pose with its rotation as a matrix, for transforming many points.
struct Frame {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero();

  Frame() = default;
  Frame(const Matrix3d& rotation, const Vector3d& translation) : R(rotation), p(translation) {}
  explicit Frame(const Pose& X) : R(X.rotation.toRotationMatrix()), p(X.translation) {}
  Vector3d operator*(const Vector3d& q) const { return R * q + p; }
  Frame operator*(const Frame& other) const { return {R * other.R, R * other.p + p}; }
  Vector3d inverse_times(const Vector3d& q) const { return R.transpose() * (q - p); }
};

struct ContactPoint {
  Vector3d position;  ///< Midway between the two surfaces, W.
  Vector3d normal;    ///< Unit, from B to A, W.
  double gap = 0.0;   ///< Distance of the surfaces along the normal, m; negative when they overlap.
  /// m/s; by how much the turning of the bodies slows the closing of the gap within the step. `gap` has its share.
  double turning = 0.0;
};

/// A triangle mesh in Bullet's bounding volume tree. Fixed or kinematic bodies only.
class SurfaceShape {
 public:
  /// `for_spheres`: something in the scene collides as spheres, which needs tree().
  SurfaceShape(std::shared_ptr<const StaticMesh> mesh, bool for_spheres);
  const StaticMesh& mesh() const { return *mesh_; }
  /// Indices of the triangles whose boxes overlap a box in the mesh's frame.
  void overlapping(const Vector3d& low, const Vector3d& high, std::vector<int>& triangles) const;

  /// The same triangles for queries of nearest points.
  const collision::TriangleTree& tree() const {
    PRESCENE_CHECK(nearest_.has_value());
    return *nearest_;
  }
  /// What the surface is like about one of its points.
  struct Place {
    Vector3d normal;        ///< Of the triangle.
    bool on_ridge = false;  ///< On an edge that may be felt: a border, or a ridge of the surface.
  };
  Place place_of(std::uint32_t triangle, const Vector3d& point) const;

 private:
  std::shared_ptr<const StaticMesh> mesh_;
  std::vector<btScalar> vertices_;
  std::vector<int> indices_;
  std::unique_ptr<btTriangleIndexVertexArray> array_;
  std::unique_ptr<btBvhTriangleMeshShape> tree_;
  std::optional<collision::TriangleTree> nearest_;
};

/// Scratch memory of contact finding: one a thread.
class ContactFinder {
 public:
  ContactFinder();

  /// Appends the contact points of A against B that are at most `range` (m) apart, at most kMaxPoints.
  void convex_convex(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB, double range,
                     std::vector<ContactPoint>& contacts);
  void convex_surface(const ConvexCore& a, const Frame& X_WA, const SurfaceShape& b, const Frame& X_WB, double range,
                      std::vector<ContactPoint>& contacts);

  static constexpr int kMaxPoints = 8;          ///< Of a pair of convex shapes.
  static constexpr int kMaxSurfacePoints = 16;  ///< Of a convex shape on a surface.

 private:
  struct Nearest {
    Vector3d on_a, on_b;  // of the cores, W
    Vector3d normal;
    double gap = 0.0;
  };
  bool nearest(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB, double range,
               Nearest& result) const;
  /// Clips the facing features along `normal` and appends the points within range.
  void clip_features(const ConvexCore& a, const Frame& X_WA, const ConvexCore& b, const Frame& X_WB,
                     const Vector3d& normal, double range, std::vector<ContactPoint>& contacts);
  /// Clips `feature` to a polygon's sides along `axis`; the result is one of the two buffers.
  const Feature& clip_to_polygon(const Vector3d& axis, const Feature& polygon, const Feature& feature);
  /// Appends at most `limit` of found_, the deepest and then those that spread widest.
  void append_spread(std::size_t limit, std::vector<ContactPoint>& contacts);

  std::unique_ptr<ConvexCore> triangle_;
  Feature feature_a_, feature_b_;
  std::array<Feature, 2> buffers_;
  std::vector<ContactPoint> found_, surface_points_;
  std::vector<int> triangles_;
  std::vector<double> spread_;
};

}  // namespace prescene::simulation
