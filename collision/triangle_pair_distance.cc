// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_pair_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace prescene::collision {
namespace {

template <class Real>
using Vector = Eigen::Matrix<Real, 3, 1>;

template <class Real>
using Corners = std::array<Vector<Real>, 3>;

/// How a point of a and a point of b were found: p_A + between = p_B.
template <class Real>
struct Candidate {
  Real squared = std::numeric_limits<Real>::infinity();
  Vector<Real> p_A = Vector<Real>::Zero();
  Vector<Real> between = Vector<Real>::Zero();

  void keep_nearer(const Vector<Real>& point_of_a, const Vector<Real>& to_b) {
    const Real s = to_b.dot(to_b);
    if (s < squared) *this = {s, point_of_a, to_b};
  }
};

template <class Real>
Real inverse_or_zero(Real value) {
  return value > Real(0) ? Real(1) / value : Real(0);
}

template <class Real>
Real clamped(Real value) {
  return std::min(std::max(value, Real(0)), Real(1));
}

// Parameters come from triple products: near-parallel edges lose no more digits of the distance than others, which is
// not so with the products of lengths and cosines of the textbook.
template <class Real>
void edge_to_edge(const Vector<Real>& p, const Vector<Real>& u, const Vector<Real>& q, const Vector<Real>& v,
                  Candidate<Real>& best) {
  const Vector<Real> r = q - p;
  const Vector<Real> n = u.cross(v);
  Real s = clamped(r.cross(v).dot(n) * inverse_or_zero(n.dot(n)));
  const Real t = clamped((s * u - r).dot(v) * inverse_or_zero(v.dot(v)));
  const Vector<Real> to_q = r + t * v;
  s = clamped(to_q.dot(u) * inverse_or_zero(u.dot(u)));
  best.keep_nearer(p + s * u, to_q - s * u);
}

/// From the face with the corner `o` and the edges u and v to the point `p`, if p is above or below it; the second
/// solution for the rest takes away what a narrow face made of the first one's rounding.
template <class Real>
struct FootPoint {
  bool inside;
  Vector<Real> on_face;  ///< From o.
  Vector<Real> rest;
};

template <class Real>
FootPoint<Real> foot_point(const Vector<Real>& u, const Vector<Real>& v, const Vector<Real>& w) {
  const Vector<Real> n = u.cross(v);
  const Real inverse = inverse_or_zero(n.dot(n));
  Real s = w.cross(v).dot(n) * inverse;
  Real t = u.cross(w).dot(n) * inverse;
  Vector<Real> rest = (w - s * u) - t * v;
  const Real ds = rest.cross(v).dot(n) * inverse;
  const Real dt = u.cross(rest).dot(n) * inverse;
  s += ds;
  t += dt;
  rest = (rest - ds * u) - dt * v;
  return {inverse > Real(0) && s >= Real(0) && t >= Real(0) && s + t <= Real(1), s * u + t * v, rest};
}

template <class Real>
Candidate<Real> nearest_features(const Corners<Real>& a, const Corners<Real>& b) {
  Candidate<Real> best;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      edge_to_edge<Real>(a[i], a[(i + 1) % 3] - a[i], b[k], b[(k + 1) % 3] - b[k], best);
    }
  }
  for (const Vector<Real>& p : b) {
    const FootPoint<Real> foot = foot_point<Real>(a[1] - a[0], a[2] - a[0], p - a[0]);
    if (foot.inside) best.keep_nearer(a[0] + foot.on_face, foot.rest);
  }
  for (const Vector<Real>& p : a) {
    const FootPoint<Real> foot = foot_point<Real>(b[1] - b[0], b[2] - b[0], p - b[0]);
    if (foot.inside) best.keep_nearer(p, -foot.rest);
  }
  return best;
}

Corners<double> widened(const Triangle& t) { return {t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()}; }

// A point where an edge of `edges` passes through `face`, if any does.
void keep_crossing(const Corners<double>& edges, const Corners<double>& face, Candidate<double>& best) {
  const Vector<double> u = face[1] - face[0];
  const Vector<double> v = face[2] - face[0];
  const Vector<double> n = u.cross(v);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector<double>& p = edges[i];
    const Vector<double>& q = edges[(i + 1) % 3];
    const double from = n.dot(p - face[0]);
    const double to = n.dot(q - face[0]);
    if ((from < 0.0) == (to < 0.0) || from == to) continue;
    const Vector<double> crossing = p + from / (from - to) * (q - p);
    const FootPoint<double> foot = foot_point<double>(u, v, crossing - face[0]);
    if (foot.inside) best.keep_nearer(crossing, foot.rest);
  }
}

}  // namespace

TriangleDistance triangle_pair_distance(const Triangle& a, const Triangle& b) {
  if (!triangles_intersect(a, b)) return disjoint_pair_distance(a, b);
  const Corners<double> corners_a = widened(a);
  const Corners<double> corners_b = widened(b);
  Candidate<double> best = nearest_features(corners_a, corners_b);
  keep_crossing(corners_a, corners_b, best);
  keep_crossing(corners_b, corners_a, best);
  const Vector<double> common = best.p_A + 0.5 * best.between;
  return {0.0, common, common};
}

TriangleDistance disjoint_pair_distance(const Triangle& a, const Triangle& b) {
  const Candidate<double> best = nearest_features(widened(a), widened(b));
  const double distance = std::max(std::sqrt(best.squared), std::numeric_limits<double>::min());
  return {distance, best.p_A, best.p_A + best.between};
}

float single_triangle_pair_distance(const TriangleCoordinates& a, const TriangleCoordinates& b) {
  if (test_triangle_pair(a, b) != PairVerdict()) return 0.0F;
  float extent = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax({a[axis], a[axis + 3], a[axis + 6], b[axis], b[axis + 3], b[axis + 6]});
    extent = std::max(extent, high - low);
  }
  const int exponent = extent > 0.0F ? std::max(std::ilogb(extent), -127) : -127;
  Corners<float> scaled_a;
  Corners<float> scaled_b;
  for (std::size_t i = 0; i < 3; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
      scaled_a[i][axis] = std::ldexp(a[at], -exponent);
      scaled_b[i][axis] = std::ldexp(b[at], -exponent);
    }
  }
  return std::ldexp(std::sqrt(nearest_features(scaled_a, scaled_b).squared), exponent);
}

}  // namespace prescene::collision
