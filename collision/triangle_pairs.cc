// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_pairs.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace prescene::collision {
namespace {

using FloatVector = std::array<float, 3>;
using ThreeCorners = std::array<FloatVector, 3>;

FloatVector difference(const FloatVector& to, const FloatVector& from) {
  return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

FloatVector cross(const FloatVector& u, const FloatVector& v) {
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

float dot(const FloatVector& u, const FloatVector& v) { return (u[0] * v[0] + u[1] * v[1]) + u[2] * v[2]; }

float largest(const FloatVector& u) { return std::max({std::abs(u[0]), std::abs(u[1]), std::abs(u[2])}); }

float determinant_error(float uv, float w) { return (kDeterminantError * uv + kUnderflowError) * w + kUnderflowError; }

struct Heights {
  std::array<float, 3> value;
  float error;

  bool apart() const {
    return std::min({value[0], value[1], value[2]}) > error || std::max({value[0], value[1], value[2]}) < -error;
  }
  bool sure() const { return std::min({std::abs(value[0]), std::abs(value[1]), std::abs(value[2])}) > error; }
};

Heights heights(const ThreeCorners& plane, const ThreeCorners& points) {
  const FloatVector u = difference(plane[1], plane[0]);
  const FloatVector v = difference(plane[2], plane[0]);
  const FloatVector normal = cross(u, v);
  Heights h{};
  float reach = 0.0F;
  for (std::size_t i = 0; i < 3; ++i) {
    const FloatVector w = difference(points[i], plane[0]);
    h.value[i] = dot(normal, w);
    reach = std::max(reach, largest(w));
  }
  h.error = determinant_error(largest(u) * largest(v), reach);
  return h;
}

bool boxes_overlap(const ThreeCorners& a, const ThreeCorners& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [a_low, a_high] = std::minmax({a[0][axis], a[1][axis], a[2][axis]});
    const auto [b_low, b_high] = std::minmax({b[0][axis], b[1][axis], b[2][axis]});
    if (a_low > b_high || b_low > a_high) return false;
  }
  return true;
}

// The index of the corner that is alone on its side.
std::size_t lone(const Heights& h) {
  const std::array<bool, 3> up = {h.value[0] > 0.0F, h.value[1] > 0.0F, h.value[2] > 0.0F};
  if (up[0] == up[1]) return 2;
  return up[0] == up[2] ? 1 : 0;
}

ThreeCorners corners(const TriangleCoordinates& t) {
  return {FloatVector{t[0], t[1], t[2]}, FloatVector{t[3], t[4], t[5]}, FloatVector{t[6], t[7], t[8]}};
}

}  // namespace

PairVerdict test_triangle_pair(const TriangleCoordinates& a_coordinates, const TriangleCoordinates& b_coordinates) {
  const ThreeCorners a = corners(a_coordinates);
  const ThreeCorners b = corners(b_coordinates);
  const Heights over_b = heights(b, a);
  const Heights over_a = heights(a, b);
  if (over_b.apart() || over_a.apart() || !boxes_overlap(a, b)) return {};
  if (!over_b.sure() || !over_a.sure()) return {.unsure = 1};

  const std::size_t i = lone(over_b);
  const std::size_t k = lone(over_a);
  const bool p_up = over_b.value[i] > 0.0F;
  const bool q_up = over_a.value[k] > 0.0F;
  const ThreeCorners p = {a[i], a[(i + 1) % 3], a[(i + 2) % 3]};
  ThreeCorners q = {b[k], b[(k + 1) % 3], b[(k + 2) % 3]};
  if (p_up != q_up) std::swap(q[1], q[2]);
  const FloatVector w = q_up ? difference(q[0], p[0]) : difference(p[0], q[0]);
  const FloatVector u1 = difference(p[1], p[0]);
  const FloatVector u2 = difference(p[2], p[0]);
  const FloatVector v1 = difference(q[1], q[0]);
  const FloatVector v2 = difference(q[2], q[0]);
  const float smaller = std::min(dot(cross(u1, v1), w), -dot(cross(u2, v2), w));
  const float error =
      determinant_error(std::max(largest(u1), largest(u2)) * std::max(largest(v1), largest(v2)), largest(w));
  if (smaller > error) return {.hit = 1};
  if (smaller < -error) return {};
  return {.unsure = 1};
}

}  // namespace prescene::collision
