// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/exact_triangles.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

#include "prescene/collision/orientation.h"

namespace prescene::collision {
namespace {

struct Segment {
  Vector3f p;
  Vector3f q;
};

/// Signs of three points against something.
using Signs = std::array<int, 3>;

bool all_on_one_side(const Signs& s) { return s[0] != 0 && s[0] == s[1] && s[1] == s[2]; }
bool all_zero(const Signs& s) { return s[0] == 0 && s[1] == 0 && s[2] == 0; }
bool has_opposite(const Signs& s) { return std::min({s[0], s[1], s[2]}) < 0 && std::max({s[0], s[1], s[2]}) > 0; }

Signs sides(const Triangle& plane, const Triangle& points) {
  return {orientation(plane[0], plane[1], plane[2], points[0]), orientation(plane[0], plane[1], plane[2], points[1]),
          orientation(plane[0], plane[1], plane[2], points[2])};
}

bool boxes_apart(const Triangle& a, const Triangle& b) {
  const auto low = [](const Triangle& t) { return Vector3f(t[0].cwiseMin(t[1]).cwiseMin(t[2])); };
  const auto high = [](const Triangle& t) { return Vector3f(t[0].cwiseMax(t[1]).cwiseMax(t[2])); };
  return (low(a).array() > high(b).array()).any() || (low(b).array() > high(a).array()).any();
}

// The line through p and q meets the plane of t in one point, which is in t unless it is outside of one edge and
// inside of another.
bool line_meets(const Vector3f& p, const Vector3f& q, const Triangle& t) {
  return !has_opposite({orientation(p, q, t[0], t[1]), orientation(p, q, t[1], t[2]), orientation(p, q, t[2], t[0])});
}

// Of triangles that do not lie in one plane. An edge that lies in the other plane needs no look: where it meets the
// other triangle, one of its ends is inside, and that end's other edge leaves the plane, or an edge of the other
// triangle crosses it.
bool an_edge_meets(const Triangle& a, const Signs& side_of_b, const Triangle& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const bool crosses = side_of_b[i] * side_of_b[j] <= 0 && (side_of_b[i] != 0 || side_of_b[j] != 0);
    if (crosses && line_meets(a[i], a[j], b)) return true;
  }
  return false;
}

// Corners in a line: the first and the last in lexicographic order are the ends of what they span.
Segment ends(const Triangle& degenerate) {
  const auto before = [](const Vector3f& a, const Vector3f& b) {
    return std::make_tuple(a.x(), a.y(), a.z()) < std::make_tuple(b.x(), b.y(), b.z());
  };
  const auto [first, last] = std::minmax_element(degenerate.begin(), degenerate.end(), before);
  return {*first, *last};
}

// Seen along the axis.
bool segments_meet_along(int axis, const Segment& a, const Segment& b) {
  const int a_p = orientation_along(axis, b.p, b.q, a.p);
  const int a_q = orientation_along(axis, b.p, b.q, a.q);
  const int b_p = orientation_along(axis, a.p, a.q, b.p);
  const int b_q = orientation_along(axis, a.p, a.q, b.q);
  if (a_p != 0 || a_q != 0 || b_p != 0 || b_q != 0) return a_p * a_q <= 0 && b_p * b_q <= 0;
  for (const int i : {(axis + 1) % 3, (axis + 2) % 3}) {  // In a line: it is enough that the boxes overlap.
    if (std::max(a.p[i], a.q[i]) < std::min(b.p[i], b.q[i]) || std::max(b.p[i], b.q[i]) < std::min(a.p[i], a.q[i]))
      return false;
  }
  return true;
}

// Segments in one plane meet when they are seen to meet along all three axes: along at least one of them the plane (or
// the line, when all is in a line) is not seen from its edge.
bool segments_meet(const Segment& a, const Segment& b) {
  if (orientation(a.p, a.q, b.p, b.q) != 0) return false;
  return segments_meet_along(0, a, b) && segments_meet_along(1, a, b) && segments_meet_along(2, a, b);
}

// An axis along which the triangle, which has an area, is not seen from its edge.
int open_axis(const Triangle& t) {
  for (const int axis : {2, 0}) {
    if (orientation_along(axis, t[0], t[1], t[2]) != 0) return axis;
  }
  return 1;
}

bool contains_along(int axis, const Triangle& t, const Vector3f& p) {
  return !has_opposite({orientation_along(axis, t[0], t[1], p), orientation_along(axis, t[1], t[2], p),
                        orientation_along(axis, t[2], t[0], p)});
}

// In the plane of t.
bool segment_meets_along(int axis, const Segment& s, const Triangle& t) {
  return contains_along(axis, t, s.p) || segments_meet_along(axis, s, {t[0], t[1]}) ||
         segments_meet_along(axis, s, {t[1], t[2]}) || segments_meet_along(axis, s, {t[2], t[0]});
}

bool coplanar_triangles_intersect(const Triangle& a, const Triangle& b) {
  const int axis = open_axis(b);
  return segment_meets_along(axis, {a[0], a[1]}, b) || segment_meets_along(axis, {a[1], a[2]}, b) ||
         segment_meets_along(axis, {a[2], a[0]}, b) || contains_along(axis, a, b[0]);
}

}  // namespace

bool is_degenerate(const Triangle& t) {
  return orientation_along(2, t[0], t[1], t[2]) == 0 && orientation_along(0, t[0], t[1], t[2]) == 0 &&
         orientation_along(1, t[0], t[1], t[2]) == 0;
}

bool segment_meets_triangle(const Vector3f& p, const Vector3f& q, const Triangle& triangle) {
  const int p_side = orientation(triangle[0], triangle[1], triangle[2], p);
  const int q_side = orientation(triangle[0], triangle[1], triangle[2], q);
  if (p_side * q_side > 0) return false;
  if (p_side != 0 || q_side != 0) return line_meets(p, q, triangle);
  if (is_degenerate(triangle)) return segments_meet({p, q}, ends(triangle));
  return segment_meets_along(open_axis(triangle), {p, q}, triangle);
}

bool triangles_intersect(const Triangle& a, const Triangle& b) {
  if (boxes_apart(a, b)) return false;
  const Signs a_sides = sides(b, a);
  if (all_on_one_side(a_sides)) return false;
  const Signs b_sides = sides(a, b);
  if (all_on_one_side(b_sides)) return false;
  if (!all_zero(a_sides) && !all_zero(b_sides)) return an_edge_meets(a, a_sides, b) || an_edge_meets(b, b_sides, a);
  // They lie in one plane, or one of them has none.
  if (is_degenerate(a)) {
    const Segment s = ends(a);
    return segment_meets_triangle(s.p, s.q, b);
  }
  if (is_degenerate(b)) {
    const Segment s = ends(b);
    return segment_meets_triangle(s.p, s.q, a);
  }
  return coplanar_triangles_intersect(a, b);
}

}  // namespace prescene::collision
