// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/point_queries.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "point_queries.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "pair_traversal-inl.h"
#include "ray_boxes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

// Nothing here is fused, so that every instruction set gives the same bits.

/// Squared distances of a point from the boxes of a node's children, a little less than they are. Returns which are
/// less than `limit`.
///
/// The point is put into the node's frame in double precision; then rounding moves it and the boxes by less than 6 u of
/// its coordinates and the node's size (u = 2^-24), and the axes' lengths and angles are off by 4 u. 16 u are allowed
/// for.
HWY_INLINE std::uint32_t distances_from_boxes(const TriangleTreeNode& node, const double (&p)[3], float limit,
                                              float* squared) {
  constexpr float kRounding = 16.0F / 16777216.0F;
  const double from_origin[3] = {p[0] - static_cast<double>(node.origin[0]), p[1] - static_cast<double>(node.origin[1]),
                                 p[2] - static_cast<double>(node.origin[2])};
  float at[3];
  for (int k = 0; k < 3; ++k) {
    at[k] = static_cast<float>(static_cast<double>(node.axes_x[k]) * from_origin[0] +
                               static_cast<double>(node.axes_y[k]) * from_origin[1] +
                               static_cast<double>(node.axes_z[k]) * from_origin[2]);
  }
  const float slack = kRounding * (std::abs(at[0]) + std::abs(at[1]) + std::abs(at[2]) + node.diagonal);
  const Floats16 d;
  const hn::RebindToSigned<Floats16> di;
  const hn::Rebind<std::uint8_t, Floats16> d8;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 sum = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      const V16 step = hn::Set(d, half_step(2.0F * node.half_extent[k]));
      const V16 x = hn::Set(d, at[k]);
      const auto low = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, node.low[k] + lane)));
      const auto high = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, node.high[k] + lane)));
      const V16 one = hn::Set(d, 1.0F);
      const V16 below = hn::Sub(hn::Mul(hn::Sub(low, one), step), x);
      const V16 above = hn::Sub(x, hn::Mul(hn::Sub(high, one), step));
      const V16 outside = hn::Max(hn::Sub(hn::Max(below, above), hn::Set(d, slack)), hn::Zero(d));
      sum = hn::Add(hn::Mul(outside, outside), sum);
    }
    const V16 least = hn::Mul(sum, hn::Set(d, 1.0F - kRounding));
    hn::Store(least, d, squared + lane);
    bits |= bits_of_mask(d, hn::Lt(least, hn::Set(d, limit))) << lane;
  }
  return bits & node.child_mask();
}

using Doubles4 = hn::CappedTag<double, 4>;
using V4 = hn::Vec<Doubles4>;

struct Vec4 {
  V4 x, y, z;
};
HWY_INLINE Vec4 minus(const Vec4& a, const Vec4& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE V4 dot(const Vec4& a, const Vec4& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
HWY_INLINE Vec4 cross(const Vec4& a, const Vec4& b) {
  const auto difference = [](V4 w, V4 x, V4 y, V4 z) HWY_ATTR { return hn::Sub(hn::Mul(w, x), hn::Mul(y, z)); };
  return {difference(a.y, b.z, a.z, b.y), difference(a.z, b.x, a.x, b.z), difference(a.x, b.y, a.y, b.x)};
}
HWY_INLINE Vec4 along(const Vec4& from, V4 t, const Vec4& v) {
  return {hn::Add(hn::Mul(t, v.x), from.x), hn::Add(hn::Mul(t, v.y), from.y), hn::Add(hn::Mul(t, v.z), from.z)};
}
HWY_INLINE Vec4 blend(hn::Mask<Doubles4> mask, const Vec4& a, const Vec4& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}

/// The places on the four triangles of a block that are nearest to a point, and their squared distances.
struct NearestOnBlock {
  HWY_ALIGN double squared[4];
  HWY_ALIGN double point[3][4];
};

/// As in [Ericson 2005, section 5.1.5], but that a triangle without area is the segment or point that is left of it.
HWY_INLINE void nearest_on_block(const TriangleBlock& block, const double (&p)[3], NearestOnBlock* nearest) {
  const Doubles4 d;
  const hn::Rebind<float, Doubles4> df;
  const V4 zero = hn::Zero(d);
  const V4 one = hn::Set(d, 1.0);
  const Vec4 q = {hn::Set(d, p[0]), hn::Set(d, p[1]), hn::Set(d, p[2])};
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    const auto load = [&](std::size_t corner, std::size_t axis)
                          HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, block.corners[corner][axis] + lane)); };
    const Vec4 corners[3] = {{load(0, 0), load(0, 1), load(0, 2)},
                             {load(1, 0), load(1, 1), load(1, 2)},
                             {load(2, 0), load(2, 1), load(2, 2)}};
    const Vec4 edges[3] = {minus(corners[1], corners[0]), minus(corners[2], corners[1]), minus(corners[0], corners[2])};
    const Vec4 to_q[3] = {minus(q, corners[0]), minus(q, corners[1]), minus(q, corners[2])};
    const Vec4 normal = cross(edges[2], edges[0]);
    const V4 area = dot(normal, normal);
    auto inside = hn::Gt(area, zero);
    V4 best = zero;
    Vec4 place = q;
    for (int i = 0; i < 3; ++i) {
      inside = hn::And(inside, hn::Ge(dot(normal, cross(edges[i], to_q[i])), zero));
      const V4 length = dot(edges[i], edges[i]);
      const V4 share = hn::Div(dot(edges[i], to_q[i]), hn::IfThenElse(hn::Gt(length, zero), length, one));
      const Vec4 on_edge = along(corners[i], hn::Min(hn::Max(share, zero), one), edges[i]);
      const Vec4 off = minus(on_edge, q);
      const V4 squared = dot(off, off);
      const auto nearer = i == 0 ? hn::Ge(squared, zero) : hn::Lt(squared, best);
      best = hn::IfThenElse(nearer, squared, best);
      place = blend(nearer, on_edge, place);
    }
    const V4 down = hn::Div(dot(normal, to_q[0]), hn::IfThenElse(inside, area, one));
    const Vec4 on_face = along(q, hn::Neg(down), normal);
    const Vec4 off = minus(on_face, q);
    place = blend(inside, on_face, place);
    hn::Store(hn::IfThenElse(inside, dot(off, off), best), d, nearest->squared + lane);
    hn::Store(place.x, d, nearest->point[0] + lane);
    hn::Store(place.y, d, nearest->point[1] + lane);
    hn::Store(place.z, d, nearest->point[2] + lane);
  }
}

/// Looks for what is nearer than `squared`.
struct PointSearch {
  const TriangleTree& tree;
  double p[3];
  double squared;
  float limit;  ///< Not less than `squared`.
  bool any_will_do;
  std::uint32_t triangle = kNoTriangle;
  double point[3] = {0, 0, 0};

  PointSearch(const TriangleTree& of_tree, const Eigen::Vector3d& of_point, double below, bool any)
      : tree(of_tree), p{of_point.x(), of_point.y(), of_point.z()}, any_will_do(any) {
    lower_to(below * below);
  }

  void lower_to(double less) {
    squared = less;
    limit = static_cast<float>(std::min(less, static_cast<double>(std::numeric_limits<float>::max())));
    limit = std::max(limit * (1.0F + std::numeric_limits<float>::epsilon()), std::numeric_limits<float>::min());
  }

  /// Returns whether the search has ended.
  HWY_INLINE bool measure(std::uint32_t block) {
    NearestOnBlock nearest;
    nearest_on_block(tree.blocks()[block], p, &nearest);
    for (std::size_t i = 0; i < 4; ++i) {
      // A leaf with fewer triangles repeats its last, which is not nearer than itself.
      if (!(nearest.squared[i] < squared)) continue;
      lower_to(nearest.squared[i]);
      triangle = tree.references()[block][i];
      for (std::size_t k = 0; k < 3; ++k) point[k] = nearest.point[k][i];
    }
    return (any_will_do && triangle != kNoTriangle) || squared == 0.0;
  }

  bool visit(std::uint32_t index) {
    const TriangleTreeNode& node = tree.nodes()[index];
    HWY_ALIGN float distances[16];
    std::uint8_t order[16];
    std::size_t count = 0;
    for (std::uint32_t bits = distances_from_boxes(node, p, limit, distances); bits != 0; bits &= bits - 1) {
      const auto child = static_cast<std::uint8_t>(std::countr_zero(bits));
      std::size_t at = count++;
      for (; at > 0 && distances[order[at - 1]] > distances[child]; --at) order[at] = order[at - 1];
      order[at] = child;
    }
    for (std::size_t i = 0; i < count && distances[order[i]] < limit; ++i) {
      const std::uint32_t child = order[i];
      const bool is_leaf = (node.leaf_mask() >> child & 1U) != 0;
      if (is_leaf ? measure(child_block(node, child)) : visit(child_node(node, child))) return true;
    }
    return false;
  }
};

void find_nearest_point(const TriangleTree& tree, const Eigen::Vector3d& p, double below, bool any_will_do,
                        NearestPoint* nearest) {
  PointSearch search(tree, p, below, any_will_do);
  search.visit(0);
  nearest->triangle = search.triangle;
  nearest->distance = std::sqrt(search.squared);
  nearest->point = {search.point[0], search.point[1], search.point[2]};
}

/// Whether the origin lies left of the edge a -> b seen along z: the opposite for b -> a, also where it lies on the
/// edge.
inline bool left_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const bool turned = std::tuple(b.x(), b.y(), b.z()) < std::tuple(a.x(), a.y(), a.z());
  const Eigen::Vector3d& first = turned ? b : a;
  const Eigen::Vector3d& second = turned ? a : b;
  return (first.x() * second.y() >= first.y() * second.x()) != turned;
}

/// +1, -1 or 0: the sign of the crossing of a triangle, whose corners are given from the ray's origin, by a ray along
/// z.
inline int crossing(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const bool left = left_of(a, b);
  if (left_of(b, c) != left || left_of(c, a) != left) return 0;
  // The plane's height above the origin has the sign of the volume that it spans with the triangle.
  const double volume = a.dot((b - a).cross(c - a));
  const bool above = left ? volume > 0.0 : volume < 0.0;
  return above ? (left ? 1 : -1) : 0;
}

int count_crossings(const TriangleTree& tree, const Eigen::Vector3d& p, const BoxRay& ray, std::uint32_t index) {
  const TriangleTreeNode& node = tree.nodes()[index];
  HWY_ALIGN float near[16];
  int sum = 0;
  for (std::uint32_t hits = boxes_on_ray(node, ray, ray.s_max, near); hits != 0; hits &= hits - 1) {
    const auto child = static_cast<std::uint32_t>(std::countr_zero(hits));
    if ((node.leaf_mask() >> child & 1U) == 0) {
      sum += count_crossings(tree, p, ray, child_node(node, child));
      continue;
    }
    const std::uint32_t index_of_block = child_block(node, child);
    const TriangleBlock& block = tree.blocks()[index_of_block];
    for (std::size_t i = 0; i < 4 && tree.references()[index_of_block][i] != kNoTriangle; ++i) {
      const auto corner = [&](std::size_t k) {
        return Eigen::Vector3d(static_cast<double>(block.corners[k][0][i]) - p.x(),
                               static_cast<double>(block.corners[k][1][i]) - p.y(),
                               static_cast<double>(block.corners[k][2][i]) - p.z());
      };
      sum += crossing(corner(0), corner(1), corner(2));
    }
  }
  return sum;
}

int wind(const TriangleTree& tree, const Eigen::Vector3d& p) {
  Ray up;
  up.origin = p;
  up.direction = Eigen::Vector3d::UnitZ();
  const std::optional<ShearedRay> sheared = shear(up);
  BoxRay ray;
  if (!sheared || !make_box_ray(*sheared, tree.radius(), &ray)) return 0;
  return count_crossings(tree, p, ray, 0);
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(find_nearest_point);
HWY_EXPORT(wind);

std::optional<NearestPoint> nearest_point(const TriangleTree& tree, const Eigen::Vector3d& p, double below) {
  NearestPoint nearest;
  if (!(below > 0.0) || !p.allFinite()) return std::nullopt;
  HWY_DYNAMIC_DISPATCH(find_nearest_point)(tree, p, below, false, &nearest);
  if (nearest.triangle == kNoTriangle) return std::nullopt;
  return nearest;
}

bool is_within(const TriangleTree& tree, const Eigen::Vector3d& p, double below) {
  NearestPoint nearest;
  if (!(below > 0.0) || !p.allFinite()) return false;
  HWY_DYNAMIC_DISPATCH(find_nearest_point)(tree, p, below, true, &nearest);
  return nearest.triangle != kNoTriangle;
}

int winding_number(const TriangleTree& tree, const Eigen::Vector3d& p) { return HWY_DYNAMIC_DISPATCH(wind)(tree, p); }

}  // namespace prescene::collision
#endif
