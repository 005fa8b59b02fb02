// SPDX-License-Identifier: Apache-2.0
#include "surface_search.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

Vector3d nearest_on_segment(const Vector3d& p, const Vector3d& from, const Vector3d& to) {
  const Vector3d along = to - from;
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp(along.dot(p - from) / length, 0.0, 1.0) : 0.0;
  return from + t * along;
}

// Whether the origin lies left of the edge a -> b seen along z: the opposite for b -> a, also where it lies on the
// edge.
bool left_of(const Vector3d& a, const Vector3d& b) {
  const bool turned = std::tuple(b.x(), b.y(), b.z()) < std::tuple(a.x(), a.y(), a.z());
  const Vector3d& first = turned ? b : a;
  const Vector3d& second = turned ? a : b;
  const bool left = first.x() * second.y() >= first.y() * second.x();
  return left != turned;
}

}  // namespace

Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (squared > 0.0 && normal.dot((b - a).cross(p - a)) >= 0.0 && normal.dot((c - b).cross(p - b)) >= 0.0 &&
      normal.dot((a - c).cross(p - c)) >= 0.0) {
    return p - normal * (normal.dot(p - a) / squared);
  }
  Vector3d nearest = nearest_on_segment(p, a, b);
  for (const Vector3d& point : {nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)}) {
    if ((point - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = point;
  }
  return nearest;
}

SurfaceSearch::SurfaceSearch(std::span<const Vector3f> vertices, std::span<const TriangleIndices> triangles) {
  PRESCENE_CHECK(!triangles.empty());
  std::vector<Box> boxes(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t v : triangles[i]) box.extend(vertices[v]);
    boxes[i] = {{box.min().x(), box.min().y(), box.min().z()}, {box.max().x(), box.max().y(), box.max().z()}};
    root_box_.extend(box.cast<double>());
  }
  while (first_leaf_ * kLeafSize < triangles.size()) first_leaf_ *= 2;
  boxes_.resize(2 * first_leaf_);
  leaf_begin_.assign(first_leaf_ + 1, 0);
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  build(boxes, order, 1, 0, order.size());
  corners_.reserve(order.size());
  for (const std::uint32_t i : order) {
    const TriangleIndices& t = triangles[i];
    corners_.push_back(
        {vertices[t[0]].cast<double>(), vertices[t[1]].cast<double>(), vertices[t[2]].cast<double>(), i});
  }
}

void SurfaceSearch::build(std::span<const Box> boxes, std::vector<std::uint32_t>& order, std::size_t node,
                          std::size_t begin, std::size_t end) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Box bound{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (std::size_t i = begin; i < end; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bound.low[axis] = std::min(bound.low[axis], boxes[order[i]].low[axis]);
      bound.high[axis] = std::max(bound.high[axis], boxes[order[i]].high[axis]);
    }
  }
  boxes_[node] = bound;
  if (is_leaf(node)) {
    leaf_begin_[node - first_leaf_] = static_cast<std::uint32_t>(begin);
    leaf_begin_[node - first_leaf_ + 1] = static_cast<std::uint32_t>(end);
    return;
  }
  std::size_t axis = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    if (bound.high[i] - bound.low[i] > bound.high[axis] - bound.low[axis]) axis = i;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t x, std::uint32_t y) {
    return std::pair(boxes[x].low[axis] + boxes[x].high[axis], x) <
           std::pair(boxes[y].low[axis] + boxes[y].high[axis], y);
  });
  build(boxes, order, 2 * node, begin, middle);
  build(boxes, order, 2 * node + 1, middle, end);
}

SurfaceSearch::Nearest SurfaceSearch::nearest(const Vector3d& q, double bound) const {
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  Nearest best;
  best.squared_distance = bound;
  std::array<Entry, kMaxDepth> stack;
  std::size_t size = 0;
  stack[size++] = {1, squared_distance(boxes_[1], q)};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= best.squared_distance) continue;
    if (is_leaf(entry.node)) {
      const std::size_t i = entry.node - first_leaf_;
      for (std::uint32_t k = leaf_begin_[i]; k < leaf_begin_[i + 1]; ++k) {
        const Corners& t = corners_[k];
        const Vector3d point = nearest_on_triangle(q, t.a, t.b, t.c);
        const double squared = (point - q).squaredNorm();
        if (squared < best.squared_distance) best = {squared, t.triangle, point};
      }
      continue;
    }
    Entry near{2 * entry.node, squared_distance(boxes_[2 * entry.node], q)};
    Entry far{2 * entry.node + 1, squared_distance(boxes_[2 * entry.node + 1], q)};
    if (far.squared < near.squared) std::swap(near, far);
    if (far.squared < best.squared_distance) stack[size++] = far;
    if (near.squared < best.squared_distance) stack[size++] = near;
  }
  return best;
}

bool SurfaceSearch::is_within(const Vector3d& q, double bound) const {
  return descend([&](const Box& box) { return squared_distance(box, q) < bound; },
                 [&](const Corners& t) { return (nearest_on_triangle(q, t.a, t.b, t.c) - q).squaredNorm() < bound; });
}

double SurfaceSearch::first_contact(const SweptSphere& sphere) const {
  struct Entry {
    std::uint32_t node;
    double time;
  };
  double first = SweptSphere::kNever;
  std::array<Entry, kMaxDepth> stack;
  std::size_t size = 0;
  stack[size++] = {1, sphere.enters(aligned(boxes_[1]))};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.time >= first) continue;
    if (is_leaf(entry.node)) {
      const std::size_t i = entry.node - first_leaf_;
      for (std::uint32_t k = leaf_begin_[i]; k < leaf_begin_[i + 1]; ++k)
        first = std::min(first, sphere.meets_triangle(corners_[k].a, corners_[k].b, corners_[k].c));
      continue;
    }
    Entry near{2 * entry.node, sphere.enters(aligned(boxes_[2 * entry.node]))};
    Entry far{2 * entry.node + 1, sphere.enters(aligned(boxes_[2 * entry.node + 1]))};
    if (far.time < near.time) std::swap(near, far);
    if (far.time < first) stack[size++] = far;
    if (near.time < first) stack[size++] = near;
  }
  return first;
}

double SurfaceSearch::reach_along(const Vector3d& direction, const Vector3d& centre, double radius) const {
  double reach = -std::numeric_limits<double>::infinity();
  const double squared = radius * radius;
  descend(
      [&](const Box& box) {
        const Eigen::AlignedBox3d b = aligned(box);
        return direction.dot(b.center()) + 0.5 * direction.cwiseAbs().dot(b.sizes()) > reach &&
               squared_distance(box, centre) <= squared;
      },
      [&](const Corners& t) {
        const double of_this = std::max({direction.dot(t.a), direction.dot(t.b), direction.dot(t.c)});
        if (of_this > reach && (nearest_on_triangle(centre, t.a, t.b, t.c) - centre).squaredNorm() <= squared)
          reach = of_this;
        return false;
      });
  return reach;
}

int SurfaceSearch::winding(const Vector3d& q) const {
  // Signed crossings of the ray from q along +z.
  int winding = 0;
  descend(
      [&](const Box& box) {
        return static_cast<double>(box.low[0]) <= q.x() && q.x() <= static_cast<double>(box.high[0]) &&
               static_cast<double>(box.low[1]) <= q.y() && q.y() <= static_cast<double>(box.high[1]) &&
               q.z() <= static_cast<double>(box.high[2]);
      },
      [&](const Corners& t) {
        const Vector3d a = t.a - q;
        const Vector3d b = t.b - q;
        const Vector3d c = t.c - q;
        const bool left = left_of(a, b);
        if (left_of(b, c) != left || left_of(c, a) != left) return false;
        // The plane's height above q has the sign of the volume that q spans with the triangle.
        const double volume = a.dot((b - a).cross(c - a));
        const bool above = left ? volume > 0.0 : volume < 0.0;
        if (above) winding += left ? 1 : -1;
        return false;
      });
  return winding;
}

}  // namespace prescene::collision
