// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "prescene/collision/spheres/continuous_sphere_queries.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/core/text.h"
#include "surface_search.h"
#include "swept_sphere.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

core::Status refuse(std::string_view name, const std::string& what) {
  return core::invalid_input("height field '" + std::string(name) + "': " + what);
}

core::Status check(const HeightField::Grid& grid, std::string_view name) {
  constexpr std::int64_t kMostPoints = std::int64_t{1} << 28U;
  const std::int64_t points = std::int64_t{grid.columns} * grid.rows;
  if (grid.columns < 2 || grid.rows < 2 || points > kMostPoints) {
    return refuse(name, std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                            " points; give at least 2 x 2 and at most 2^28");
  }
  if (grid.heights.size() != static_cast<std::size_t>(points)) {
    return refuse(name, std::to_string(grid.heights.size()) + " heights for " + std::to_string(grid.columns) + " x " +
                            std::to_string(grid.rows) + " points; give one each");
  }
  for (const double spacing : {grid.spacing_x, grid.spacing_y}) {
    if (!(spacing > 0.0) || !std::isfinite(spacing))
      return refuse(name, "a spacing of " + core::rounded_text(spacing) + " m; it is positive");
  }
  for (std::size_t i = 0; i < grid.heights.size(); ++i) {
    if (!(std::abs(grid.heights[i]) <= kLargestCoordinate)) {
      const auto columns = static_cast<std::size_t>(grid.columns);
      return refuse(name, "the height of point (" + std::to_string(i % columns) + ", " + std::to_string(i / columns) +
                              ") is not finite or beyond 1e9 m; fill gaps first");
    }
  }
  return core::ok_status();
}

}  // namespace

core::Result<HeightField> HeightField::make(Grid grid, std::string_view name) {
  PRESCENE_RETURN_IF_ERROR(check(grid, name));
  HeightField field;
  field.grid_ = std::move(grid);
  const Grid& g = field.grid_;
  Level cells{g.columns - 1, g.rows - 1, {}};
  const auto height = [&](int column, int row) {
    return g.heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(g.columns) +
                     static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      const auto [low, high] = std::minmax(
          {height(column, row), height(column + 1, row), height(column, row + 1), height(column + 1, row + 1)});
      cells.ranges.push_back({low, high});
    }
  }
  field.levels_.push_back(std::move(cells));
  while (field.levels_.back().ranges.size() > 1) {
    const Level& fine = field.levels_.back();
    Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
    for (int row = 0; row < coarse.rows; ++row) {
      for (int column = 0; column < coarse.columns; ++column) {
        Range range{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
        for (int r = 2 * row; r < std::min(2 * row + 2, fine.rows); ++r) {
          for (int c = 2 * column; c < std::min(2 * column + 2, fine.columns); ++c) {
            const Range& part = fine.ranges[static_cast<std::size_t>(r) * static_cast<std::size_t>(fine.columns) +
                                            static_cast<std::size_t>(c)];
            range = {std::min(range.low, part.low), std::max(range.high, part.high)};
          }
        }
        coarse.ranges.push_back(range);
      }
    }
    field.levels_.push_back(std::move(coarse));
  }
  return field;
}

Vector3d HeightField::point(int column, int row) const {
  const std::size_t i =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(grid_.columns) + static_cast<std::size_t>(column);
  return {column * grid_.spacing_x, row * grid_.spacing_y, static_cast<double>(grid_.heights[i])};
}

std::optional<double> HeightField::height(double x, double y) const {
  const double u = x / grid_.spacing_x;
  const double v = y / grid_.spacing_y;
  if (!(u >= 0.0 && u <= grid_.columns - 1.0 && v >= 0.0 && v <= grid_.rows - 1.0)) return std::nullopt;
  const int column = std::min(static_cast<int>(u), grid_.columns - 2);
  const int row = std::min(static_cast<int>(v), grid_.rows - 2);
  const double s = u - column;
  const double t = v - row;
  const double corner = point(column, row).z();
  const double opposite = point(column + 1, row + 1).z();
  if (s >= t) {
    const double right = point(column + 1, row).z();
    return corner + s * (right - corner) + t * (opposite - right);
  }
  const double left = point(column, row + 1).z();
  return corner + t * (left - corner) + s * (opposite - left);
}

// About the surface over a square of cells.
Eigen::AlignedBox3d HeightField::box(std::size_t level, int column, int row) const {
  const Level& cells = levels_[level];
  const Range& range = cells.ranges[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells.columns) +
                                    static_cast<std::size_t>(column)];
  const double size = std::exp2(static_cast<double>(level));
  return {Vector3d(column * size * grid_.spacing_x, row * size * grid_.spacing_y, static_cast<double>(range.low)),
          Vector3d(std::min((column + 1) * size, grid_.columns - 1.0) * grid_.spacing_x,
                   std::min((row + 1) * size, grid_.rows - 1.0) * grid_.spacing_y, static_cast<double>(range.high))};
}

// Of the vertical sides, or nothing where p lies above them.
std::optional<StaticShape::Nearest> HeightField::nearest_of_sides(const Vector3d& p_BQ) const {
  const double end_x = (grid_.columns - 1) * grid_.spacing_x;
  const double end_y = (grid_.rows - 1) * grid_.spacing_y;
  const Vector3d clamped(std::clamp(p_BQ.x(), 0.0, end_x), std::clamp(p_BQ.y(), 0.0, end_y), p_BQ.z());
  const std::optional<double> ground = height(clamped.x(), clamped.y());
  if (!ground || p_BQ.z() > *ground) return std::nullopt;
  const double distance = (p_BQ - clamped).norm();
  if (distance > 0.0) return Nearest{distance, (p_BQ - clamped) / distance};
  const std::array<Nearest, 4> sides = {
      Nearest{-p_BQ.x(), -Vector3d::UnitX()}, Nearest{p_BQ.x() - end_x, Vector3d::UnitX()},
      Nearest{-p_BQ.y(), -Vector3d::UnitY()}, Nearest{p_BQ.y() - end_y, Vector3d::UnitY()}};
  return *std::max_element(sides.begin(), sides.end(),
                           [](const Nearest& a, const Nearest& b) { return a.distance < b.distance; });
}

std::optional<StaticShape::Nearest> HeightField::nearest(const Vector3d& p_BQ, double below) const {
  const std::optional<double> ground = height(p_BQ.x(), p_BQ.y());
  const bool inside = ground && p_BQ.z() < *ground;
  if (!inside && below <= 0.0) return std::nullopt;
  std::optional<Nearest> nearest = nearest_of_sides(p_BQ);
  double bound = inside ? std::numeric_limits<double>::infinity() : below * below;
  if (nearest) bound = std::min(bound, nearest->distance * nearest->distance);
  Vector3d best = Vector3d::Zero();
  Vector3d facing = Vector3d::UnitZ();
  bool found = false;
  const auto look = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const Vector3d point = nearest_on_triangle(p_BQ, a, b, c);
    const double squared = (point - p_BQ).squaredNorm();
    if (squared >= bound) return;
    bound = squared;
    best = point;
    facing = (b - a).cross(c - a).normalized();
    found = true;
  };
  struct Square {
    std::size_t level;
    int column;
    int row;
    double squared;
  };
  std::array<Square, 128> stack;  // Three wait on each of at most 28 levels.
  std::size_t size = 0;
  stack[size++] = {levels_.size() - 1, 0, 0, box(levels_.size() - 1, 0, 0).squaredExteriorDistance(p_BQ)};
  while (size > 0) {
    const Square square = stack[--size];
    if (square.squared >= bound) continue;
    if (square.level == 0) {
      const Vector3d corner = point(square.column, square.row);
      const Vector3d opposite = point(square.column + 1, square.row + 1);
      look(corner, point(square.column + 1, square.row), opposite);
      look(corner, opposite, point(square.column, square.row + 1));
      continue;
    }
    const Level& fine = levels_[square.level - 1];
    const std::size_t before = size;
    for (int r = 2 * square.row; r < std::min(2 * square.row + 2, fine.rows); ++r) {
      for (int c = 2 * square.column; c < std::min(2 * square.column + 2, fine.columns); ++c) {
        const double squared = box(square.level - 1, c, r).squaredExteriorDistance(p_BQ);
        if (squared < bound) stack[size++] = {square.level - 1, c, r, squared};
      }
    }
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(before), stack.begin() + static_cast<std::ptrdiff_t>(size),
              [](const Square& a, const Square& b) { return a.squared > b.squared; });
  }
  if (found) {
    const double distance = std::sqrt(bound);
    const Vector3d out = inside ? Vector3d(best - p_BQ) : Vector3d(p_BQ - best);
    nearest = Nearest{inside ? -distance : distance, distance > 0.0 ? Vector3d(out / distance) : facing};
  }
  if (!nearest || nearest->distance >= below) return std::nullopt;
  return nearest;
}

double HeightField::first_of_sides(const Vector3d& from, const Vector3d& to, double radius) const {
  const Vector3d move = to - from;
  const Eigen::Vector2d end((grid_.columns - 1) * grid_.spacing_x, (grid_.rows - 1) * grid_.spacing_y);
  double first = SweptSphere::kNever;
  for (int axis = 0; axis < 2; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const double at = sign < 0.0 ? 0.0 : end[axis];
      const double gap = sign * (from[axis] - at) - radius;
      const double gap_at_end = sign * (to[axis] - at) - radius;
      if (!(gap > 0.0 && gap_at_end <= 0.0)) continue;
      const double t = gap / (gap - gap_at_end);
      Vector3d p = from + t * move;
      p[axis] = at;
      const std::optional<double> ground = height(p.x(), p.y());
      if (ground && p.z() <= *ground) first = std::min(first, t);
    }
  }
  // The edges between them.
  for (const auto& [column, row] : {std::pair(0, 0), std::pair(grid_.columns - 1, 0), std::pair(0, grid_.rows - 1),
                                    std::pair(grid_.columns - 1, grid_.rows - 1)}) {
    const Vector3d corner = point(column, row);
    const auto across = [&](const Vector3d& p) { return Vector3d(p.x() - corner.x(), p.y() - corner.y(), 0.0); };
    const auto t = swept_spheres_contact(across(from), across(to), radius);
    if (t && from.z() + *t * move.z() <= corner.z()) first = std::min(first, *t);
  }
  return first;
}

std::optional<double> HeightField::swept_sphere_contact(const Vector3d& from, const Vector3d& to, double radius) const {
  if (nearest(from, std::nextafter(radius, 2.0 * radius))) return 0.0;
  const SweptSphere sphere(from, to, radius);
  double first = first_of_sides(from, to, radius);
  struct Square {
    std::size_t level;
    int column;
    int row;
    double time;
  };
  std::array<Square, 128> stack;  // As in nearest().
  std::size_t size = 0;
  stack[size++] = {levels_.size() - 1, 0, 0, sphere.enters(box(levels_.size() - 1, 0, 0))};
  while (size > 0) {
    const Square square = stack[--size];
    if (square.time >= first) continue;
    if (square.level == 0) {
      const Vector3d corner = point(square.column, square.row);
      const Vector3d opposite = point(square.column + 1, square.row + 1);
      first = std::min({first, sphere.meets_triangle(corner, point(square.column + 1, square.row), opposite),
                        sphere.meets_triangle(corner, opposite, point(square.column, square.row + 1))});
      continue;
    }
    const Level& fine = levels_[square.level - 1];
    const std::size_t before = size;
    for (int r = 2 * square.row; r < std::min(2 * square.row + 2, fine.rows); ++r) {
      for (int c = 2 * square.column; c < std::min(2 * square.column + 2, fine.columns); ++c) {
        const double time = sphere.enters(box(square.level - 1, c, r));
        if (time < first) stack[size++] = {square.level - 1, c, r, time};
      }
    }
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(before), stack.begin() + static_cast<std::ptrdiff_t>(size),
              [](const Square& a, const Square& b) { return a.time > b.time; });
  }
  return first <= 1.0 ? std::optional(first) : std::nullopt;
}

double HeightField::reach_along(const Vector3d& direction, const Vector3d& centre, double radius) const {
  const double limit = direction.dot(centre) + radius;
  double reach = -std::numeric_limits<double>::infinity();
  const auto take = [&](const Eigen::AlignedBox3d& part) {
    if (!part.isEmpty())
      reach = std::max(reach, direction.dot(part.center()) + 0.5 * direction.cwiseAbs().dot(part.sizes()));
  };
  // The sides, as far as they are near.
  const Eigen::AlignedBox3d near(centre - Vector3d::Constant(radius), centre + Vector3d::Constant(radius));
  const auto high = static_cast<double>(levels_.back().ranges[0].high);
  const Vector3d end((grid_.columns - 1) * grid_.spacing_x, (grid_.rows - 1) * grid_.spacing_y, high);
  const Vector3d bottom(0.0, 0.0, std::min(high, near.min().z()));
  for (int axis = 0; axis < 2; ++axis) {
    Eigen::AlignedBox3d side(bottom, end);
    side.max()[axis] = 0.0;
    take(side.intersection(near));
    side.min()[axis] = side.max()[axis] = end[axis];
    take(side.intersection(near));
  }
  struct Square {
    std::size_t level;
    int column;
    int row;
  };
  std::array<Square, 128> stack;  // As in nearest().
  std::size_t size = 0;
  stack[size++] = {levels_.size() - 1, 0, 0};
  while (size > 0) {
    const Square square = stack[--size];
    const Eigen::AlignedBox3d about = box(square.level, square.column, square.row);
    if (about.squaredExteriorDistance(centre) > radius * radius ||
        direction.dot(about.center()) + 0.5 * direction.cwiseAbs().dot(about.sizes()) <= reach)
      continue;
    if (square.level == 0) {
      for (const auto& [c, r] : {std::pair(0, 0), std::pair(1, 0), std::pair(0, 1), std::pair(1, 1)})
        reach = std::max(reach, direction.dot(point(square.column + c, square.row + r)));
      continue;
    }
    const Level& fine = levels_[square.level - 1];
    for (int r = 2 * square.row; r < std::min(2 * square.row + 2, fine.rows); ++r) {
      for (int c = 2 * square.column; c < std::min(2 * square.column + 2, fine.columns); ++c)
        stack[size++] = {square.level - 1, c, r};
    }
  }
  return std::min(reach, limit);
}

}  // namespace prescene::collision
