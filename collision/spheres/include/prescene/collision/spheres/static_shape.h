// SPDX-License-Identifier: Apache-2.0
// What a packed body meets besides other packed bodies: half-spaces, primitives, surfaces of triangles that need not be
// closed, and height fields. Supports are rarely solids that spheres could fill.
//
//   PRESCENE_TRY(const HalfSpace table, HalfSpace::make({0, 0, 1}, 0.72));
//   PRESCENE_TRY(const TriangleSurface shelf, TriangleSurface::make(mesh, SurfaceSide::kBoth, pool));
//   const PenaltyWrench push = penalty_wrench(cup, shelf, X_CS, {}, scratch);     // static_shape_queries.h
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"
#include "prescene/geometry/primitives.h"

namespace prescene::collision {

/// A shape that knows its distance from a point. Immutable.
class StaticShape {
 public:
  struct Nearest {
    double distance = 0.0;  ///< m; negative inside of a solid.
    /// Of unit length, the direction in which the distance grows; where that is none (the middle of a sphere) or
    /// several (on a ridge), one of them. The nearest place of the surface is p - distance * normal.
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  };

  StaticShape() = default;
  StaticShape(const StaticShape&) = default;
  StaticShape(StaticShape&&) = default;
  StaticShape& operator=(const StaticShape&) = default;
  StaticShape& operator=(StaticShape&&) = default;
  virtual ~StaticShape() = default;

  /// Of a point in the shape's frame B, m, where its distance is less than `below`. No allocation.
  virtual std::optional<Nearest> nearest(const Eigen::Vector3d& p_BQ, double below) const = 0;
  /// Whether nearest() would answer.
  virtual bool is_within(const Eigen::Vector3d& p_BQ, double below) const { return nearest(p_BQ, below).has_value(); }
  /// First t in [0, 1] at which a sphere touches the shape while its centre moves straight from `from` to `to` (m, in
  /// B): 0 when it does at the start. Off by rounding in double precision, also for motions that graze. No allocation.
  virtual std::optional<double> swept_sphere_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                                     double radius) const = 0;
  /// Whether the shape is convex: then it lies behind the plane across the normal of each nearest place outside of it.
  virtual bool is_convex() const { return false; }
  /// Bound of how far the surface reaches: not less than direction . p for any of its points p within `radius` of
  /// `centre` (m, in B); `direction` is of unit length. No allocation.
  virtual double reach_along(const Eigen::Vector3d& direction, const Eigen::Vector3d& centre, double radius) const {
    return direction.dot(centre) + radius;
  }
  /// Whether the surface is flat about one of its places: all points within `radius` (m) of it on the plane across
  /// `normal` (of unit length) are within `slack` of the surface. May deny it where it is so. No allocation.
  virtual bool is_flat_about(const Eigen::Vector3d& /*place*/, const Eigen::Vector3d& /*normal*/, double /*radius*/,
                             double /*slack*/) const {
    return false;
  }
};

/// All points with normal . p <= offset.
class HalfSpace final : public StaticShape {
 public:
  /// The normal may have any length; the offset is along the normal of unit length, m. Fails with kInvalidInput when
  /// the normal is zero or a number is not finite.
  static core::Result<HalfSpace> make(const Eigen::Vector3d& normal, double offset);
  std::optional<Nearest> nearest(const Eigen::Vector3d& p_BQ, double below) const override;
  std::optional<double> swept_sphere_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             double radius) const override;
  bool is_convex() const override { return true; }
  const Eigen::Vector3d& normal() const { return normal_; }
  double offset() const { return offset_; }

 private:
  HalfSpace() = default;

  Eigen::Vector3d normal_ = Eigen::Vector3d::UnitZ();
  double offset_ = 0.0;
};

/// The solid of a primitive.
class PrimitiveShape final : public StaticShape {
 public:
  /// Fails with kInvalidInput when a length is not positive and finite.
  static core::Result<PrimitiveShape> make(const geometry::Primitive& primitive);
  std::optional<Nearest> nearest(const Eigen::Vector3d& p_BQ, double below) const override;
  std::optional<double> swept_sphere_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             double radius) const override;
  bool is_convex() const override { return true; }

 private:
  explicit PrimitiveShape(const geometry::Primitive& primitive) : primitive_(primitive) {}
  Nearest nearest(const Eigen::Vector3d& p_BQ) const;

  geometry::Primitive primitive_;
};

enum class SurfaceSide {
  kBoth,   ///< A thin sheet: pushes to the side on which a sphere's centre is.
  kSolid,  ///< What the surface encloses belongs to the shape: it must be closed.
};

/// Triangles, and the tree over them that the queries of triangles use as well: it may be shared and come from a file.
class TriangleSurface final : public StaticShape {
 public:
  /// Fails with kInvalidInput, naming the mesh and a place, when it shall be solid and is open. The tree is there
  /// (checked).
  static core::Result<TriangleSurface> make(std::shared_ptr<const TriangleTree> tree, SurfaceSide side);
  /// The same with a tree of its own.
  static core::Result<TriangleSurface> make(std::shared_ptr<const Mesh> mesh, SurfaceSide side, core::ThreadPool& pool);
  std::optional<Nearest> nearest(const Eigen::Vector3d& p_BQ, double below) const override;
  bool is_within(const Eigen::Vector3d& p_BQ, double below) const override;
  std::optional<double> swept_sphere_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             double radius) const override;
  double reach_along(const Eigen::Vector3d& direction, const Eigen::Vector3d& centre, double radius) const override;
  bool is_flat_about(const Eigen::Vector3d& place, const Eigen::Vector3d& normal, double radius,
                     double slack) const override;
  const std::shared_ptr<const TriangleTree>& tree() const { return tree_; }

 private:
  TriangleSurface(std::shared_ptr<const TriangleTree> tree, SurfaceSide side);
  bool is_inside(const Eigen::Vector3d& p_BQ) const;

  std::shared_ptr<const TriangleTree> tree_;
  /// A bit for each edge of a triangle that does not go on in just one other that faces the same way.
  std::shared_ptr<const std::vector<std::uint8_t>> rims_;
  SurfaceSide side_;
};

/// Heights over a regular grid of points; the ground below them belongs to the shape as far as the grid goes. Each cell
/// is two triangles that meet on the diagonal from its first corner.
class HeightField final : public StaticShape {
 public:
  struct Grid {
    int columns = 0;             ///< Points along x, at least 2.
    int rows = 0;                ///< Points along y, at least 2.
    double spacing_x = 0.0;      ///< m.
    double spacing_y = 0.0;      ///< m.
    std::vector<float> heights;  ///< z in m, row by row: point (column, row) is heights[row * columns + column].
  };
  /// Point (0, 0) lies at the origin of the shape's frame. Fails with kInvalidInput, naming the field and the point,
  /// when there are fewer than 2 x 2 points or more than 2^28, not one height a point, or a number is not finite or a
  /// spacing not positive.
  static core::Result<HeightField> make(Grid grid, std::string_view name);
  std::optional<Nearest> nearest(const Eigen::Vector3d& p_BQ, double below) const override;
  std::optional<double> swept_sphere_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             double radius) const override;
  double reach_along(const Eigen::Vector3d& direction, const Eigen::Vector3d& centre, double radius) const override;
  /// Of the surface above a point of the ground, m; nothing outside of the grid.
  std::optional<double> height(double x, double y) const;

 private:
  struct Range {
    float low;
    float high;
  };
  // Ranges of heights of squares of cells, each level half as many in both directions as the one before.
  struct Level {
    int columns;
    int rows;
    std::vector<Range> ranges;
  };

  HeightField() = default;
  Eigen::Vector3d point(int column, int row) const;
  std::optional<Nearest> nearest_of_sides(const Eigen::Vector3d& p_BQ) const;
  double first_of_sides(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius) const;
  Eigen::AlignedBox3d box(std::size_t level, int column, int row) const;

  Grid grid_;
  std::vector<Level> levels_;  // The first is of the cells, the last is one square.
};

}  // namespace prescene::collision
