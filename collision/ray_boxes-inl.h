// SPDX-License-Identifier: Apache-2.0
// Rays against the boxes of a TriangleTree's children: one ray against sixteen boxes, or sixteen rays against one.
// Included once for each instruction set.
//
// No box is left out that a ray meets as ray_triangle.h means it. The origin is moved along the ray to where it is
// nearest to the mesh's origin, in double precision, so that all lengths are about the mesh's radius R. Then rounding
// moves a point of the ray, relative to a node's box, by less than 80 u R (u = 2^-24): 1 u R for the origin, 5 u R for
// its difference to the node's, 20 u R for turning origin and direction into the node's frame, 2 u R for making steep
// directions finite, and 50 u R for the planes' places on the ray. Boxes are made larger by 128 u R, and by what double
// precision does to origins far away.
#if defined(PRESCENE_COLLISION_RAY_BOXES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_RAY_BOXES_INL_H_
#undef PRESCENE_COLLISION_RAY_BOXES_INL_H_
#else
#define PRESCENE_COLLISION_RAY_BOXES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "prescene/collision/ray_triangle.h"
#include "prescene/collision/triangle_tree.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A ray in the mesh's frame, its largest coordinate of direction being 1 or -1; from `s_min` to `s_max` metres along
/// that.
struct BoxRay {
  float origin[3];
  float direction[3];
  float slack;  ///< See above, m.
  float s_min;
  float s_max;
  double moved;  ///< By which `origin` is further along the ray than the ray's own, m.
};

/// A place on the ray in the units of BoxRay, or a little further.
HWY_INLINE float at_most(const BoxRay& ray, double s) {
  const auto limit = static_cast<double>(ray.s_max);
  return static_cast<float>(std::min(s - ray.moved, limit)) + ray.slack;
}

/// False for a ray that passes by the sphere about the mesh, or ends before it.
inline bool make_box_ray(const ShearedRay& ray, float radius, BoxRay* box) {
  constexpr double kRounding = 128.0 / 16777216.0;
  constexpr double kFar = 16.0 * std::numeric_limits<double>::epsilon();
  std::array<double, 3> o;
  std::array<double, 3> d;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(ray.order[k]);
    o[axis] = ray.origin[k];
    d[axis] = k < 2 ? ray.sign * ray.shear[k] : ray.sign;
  }
  const double far = std::max({std::abs(o[0]), std::abs(o[1]), std::abs(o[2])});
  const double slack = kRounding * static_cast<double>(radius) + kFar * far + 1e-36;
  const double reach = static_cast<double>(radius) + slack;
  const double moved = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  double squared = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double at = o[k] + moved * d[k];
    squared += at * at;
    box->origin[k] = static_cast<float>(at);
    box->direction[k] = static_cast<float>(d[k]);
  }
  if (squared > reach * reach) return false;
  const double from = std::max(ray.s_min - moved - slack, -2.0 * reach);
  const double to = std::min(ray.s_max - moved + slack, 2.0 * reach);
  if (from > to) return false;
  box->slack = static_cast<float>(slack);
  box->s_min = static_cast<float>(from) - box->slack;
  box->s_max = static_cast<float>(to) + box->slack;
  box->moved = moved;
  return true;
}

// Directions this flat against a plane count as this steep.
inline constexpr float kFlattest = 1.0F / 16777216.0F;

/// Where a ray passes the planes of boxes along the three axes of a node: byte * per_step + first, metres.
struct NodeRay {
  HWY_ALIGN float per_step[4];
  HWY_ALIGN float first_near[4];  ///< Where it comes in, before the slack.
  HWY_ALIGN float first_far[4];   ///< Where it goes out, after the slack.
  HWY_ALIGN float direction[4];   ///< In the node's frame.
};

HWY_INLINE void make_node_ray(const TriangleTreeNode& node, const BoxRay& ray, NodeRay* out) {
  const hn::CappedTag<float, 4> d;
  for (std::size_t lane = 0; lane < 4; lane += hn::Lanes(d)) {
    const auto x = hn::LoadU(d, node.axes_x + lane);
    const auto y = hn::LoadU(d, node.axes_y + lane);
    const auto z = hn::LoadU(d, node.axes_z + lane);
    const auto turned = [&](float a, float b, float c) HWY_ATTR {
      return hn::MulAdd(z, hn::Set(d, c), hn::MulAdd(y, hn::Set(d, b), hn::Mul(x, hn::Set(d, a))));
    };
    const auto origin =
        turned(ray.origin[0] - node.origin[0], ray.origin[1] - node.origin[1], ray.origin[2] - node.origin[2]);
    const auto exact = turned(ray.direction[0], ray.direction[1], ray.direction[2]);
    const auto direction = hn::CopySign(hn::Max(hn::Abs(exact), hn::Set(d, kFlattest)), exact);
    const auto inverse = hn::Div(hn::Set(d, 1.0F), direction);
    const auto step = hn::Mul(hn::LoadU(d, node.half_extent + lane), hn::Set(d, half_step(2.0F)));
    const auto first = hn::Neg(hn::Mul(hn::Add(step, origin), inverse));
    const auto pad = hn::Mul(hn::Set(d, ray.slack), hn::Abs(inverse));
    hn::Store(hn::Mul(step, inverse), d, out->per_step + lane);
    hn::Store(hn::Sub(first, pad), d, out->first_near + lane);
    hn::Store(hn::Add(first, pad), d, out->first_far + lane);
    hn::Store(direction, d, out->direction + lane);
  }
}

/// Which children the ray may meet between s_min and s_max, and where it comes to their boxes.
HWY_INLINE std::uint32_t boxes_on_ray(const TriangleTreeNode& node, const BoxRay& ray, float s_max, float* near) {
  const Floats16 d;
  const hn::RebindToSigned<Floats16> di;
  const hn::Rebind<std::uint8_t, Floats16> d8;
  NodeRay at;
  make_node_ray(node, ray, &at);
  const std::uint8_t* nearer[3];
  const std::uint8_t* farther[3];
  for (int k = 0; k < 3; ++k) {
    const bool negative = std::signbit(at.direction[k]);
    nearer[k] = negative ? node.high[k] : node.low[k];
    farther[k] = negative ? node.low[k] : node.high[k];
  }
  std::uint32_t hits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    auto from = hn::Set(d, ray.s_min);
    auto to = hn::Set(d, s_max);
    for (int k = 0; k < 3; ++k) {
      const auto per_step = hn::Set(d, at.per_step[k]);
      const auto in = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, nearer[k] + lane)));
      const auto out = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, farther[k] + lane)));
      from = hn::Max(from, hn::MulAdd(in, per_step, hn::Set(d, at.first_near[k])));
      to = hn::Min(to, hn::MulAdd(out, per_step, hn::Set(d, at.first_far[k])));
    }
    hn::Store(from, d, near + lane);
    hits |= bits_of_mask(d, hn::Le(from, to)) << lane;
  }
  return hits & node.child_mask();
}

/// Sixteen rays side by side.
struct BoxRays {
  HWY_ALIGN float origin[3][16];
  HWY_ALIGN float direction[3][16];
  HWY_ALIGN float s_min[16];
  HWY_ALIGN float s_max[16];  ///< As far as is known: hits make it smaller.
  float slack;                ///< The largest of theirs.
};

/// Where sixteen rays pass the planes of a node's boxes.
struct NodeRays {
  HWY_ALIGN float per_step[3][16];
  HWY_ALIGN float first_low[3][16];
  HWY_ALIGN float first_high[3][16];
};

HWY_INLINE void make_node_rays(const TriangleTreeNode& node, const BoxRays& rays, NodeRays* out) {
  const Floats16 d;
  const float* axes[3] = {node.axes_x, node.axes_y, node.axes_z};
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 p[3];
    for (int c = 0; c < 3; ++c) p[c] = hn::Sub(hn::Load(d, rays.origin[c] + lane), hn::Set(d, node.origin[c]));
    const V16 q[3] = {hn::Load(d, rays.direction[0] + lane), hn::Load(d, rays.direction[1] + lane),
                      hn::Load(d, rays.direction[2] + lane)};
    for (int k = 0; k < 3; ++k) {
      const V16 x = hn::Set(d, axes[0][k]);
      const V16 y = hn::Set(d, axes[1][k]);
      const V16 z = hn::Set(d, axes[2][k]);
      const V16 origin = hn::MulAdd(z, p[2], hn::MulAdd(y, p[1], hn::Mul(x, p[0])));
      const V16 exact = hn::MulAdd(z, q[2], hn::MulAdd(y, q[1], hn::Mul(x, q[0])));
      const V16 direction = hn::CopySign(hn::Max(hn::Abs(exact), hn::Set(d, kFlattest)), exact);
      const V16 inverse = hn::Div(hn::Set(d, 1.0F), direction);
      const V16 step = hn::Set(d, half_step(2.0F) * node.half_extent[k]);
      const V16 first = hn::Neg(hn::Mul(hn::Add(step, origin), inverse));
      const V16 pad = hn::Mul(hn::Set(d, rays.slack), inverse);
      hn::Store(hn::Mul(step, inverse), d, out->per_step[k] + lane);
      hn::Store(hn::Sub(first, pad), d, out->first_low[k] + lane);
      hn::Store(hn::Add(first, pad), d, out->first_high[k] + lane);
    }
  }
}

/// Which rays may meet the box of a child, and where the first of those in `active` comes to it.
HWY_INLINE std::uint32_t rays_on_box(const TriangleTreeNode& node, std::uint32_t child, const BoxRays& rays,
                                     const NodeRays& at, std::uint32_t active, float* nearest) {
  const Floats16 d;
  std::uint32_t hits = 0;
  V16 first = hn::Set(d, std::numeric_limits<float>::infinity());
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 from = hn::Load(d, rays.s_min + lane);
    V16 to = hn::Load(d, rays.s_max + lane);
    for (int k = 0; k < 3; ++k) {
      const V16 per_step = hn::Load(d, at.per_step[k] + lane);
      const V16 low =
          hn::MulAdd(hn::Set(d, static_cast<float>(node.low[k][child])), per_step, hn::Load(d, at.first_low[k] + lane));
      const V16 high = hn::MulAdd(hn::Set(d, static_cast<float>(node.high[k][child])), per_step,
                                  hn::Load(d, at.first_high[k] + lane));
      from = hn::Max(from, hn::Min(low, high));
      to = hn::Min(to, hn::Max(low, high));
    }
    const auto meets = hn::And(hn::Le(from, to), mask_of_bits(d, active >> lane));
    first = hn::Min(first, hn::IfThenElse(meets, from, first));
    hits |= bits_of_mask(d, meets) << lane;
  }
  *nearest = hn::GetLane(hn::MinOfLanes(d, first));
  return hits;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
