// SPDX-License-Identifier: Apache-2.0
// How soon boxes of two nodes can touch when one node moves: sixteen at a time. Included once for each instruction set.
//
// Along an axis n that stays where it is in A, a point of B that has the velocity v and the swirl s now moves by at
// most (n . v) t + 1/2 |n x spin / |spin|| |spin| |s| t^2 in the time t: its acceleration is spin x s, whose length
// stays. So a gap g along n is closed no sooner than the t at which r t + 1/2 a t^2 = g, with r and a the largest of
// B's box. Boxes do not touch before the latest such time of all axes at hand: those of the two nodes' frames.
#include "pair_traversal-inl.h"
#include "prescene/collision/rigid_motion.h"

#if defined(PRESCENE_COLLISION_MOVING_BOXES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_MOVING_BOXES_INL_H_
#undef PRESCENE_COLLISION_MOVING_BOXES_INL_H_
#else
#define PRESCENE_COLLISION_MOVING_BOXES_INL_H_
#endif

#include <Eigen/Geometry>

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// How fast boxes of B's node move along six axes: those of A's node and those of B's. Lengths are in `scale` to the
/// metre, so that their squares do not vanish in single precision.
struct BoxRates {
  float scale;
  HWY_ALIGN float up[6][16];    ///< Most along the axis, a unit of time.
  HWY_ALIGN float down[6][16];  ///< Most against it.
  HWY_ALIGN float twice_acceleration[6][16];
};

/// Axis k of a node, in the mesh's frame.
inline Eigen::Vector3d node_axis(const TriangleTreeNode& node, int k) {
  return {static_cast<double>(node.axes_x[k]), static_cast<double>(node.axes_y[k]),
          static_cast<double>(node.axes_z[k])};
}

// Of the numbers that rates are made of, in single precision.
inline constexpr double kRateRounding = 64.0 / 16777216.0;

/// `boxes` are those of node b, which is at X_AB, with velocities as in `field`. Returns about the largest of its
/// speeds, m. rates->scale is given.
inline float make_box_rates(const MotionField& field, const geometry::Pose& X_AB, const TriangleTreeNode& a,
                            const TriangleTreeNode& b, const ChildBoxes& boxes, BoxRates* rates) {
  using Eigen::Vector3d;
  const Floats16 d;
  const Eigen::Matrix3d R_AB = X_AB.rotation.toRotationMatrix();
  const Vector3d origin = X_AB * Vector3d(static_cast<double>(b.origin[0]), static_cast<double>(b.origin[1]),
                                          static_cast<double>(b.origin[2]));
  Vector3d axes_b[3];
  for (int m = 0; m < 3; ++m) axes_b[m] = R_AB * node_axis(b, m);
  const double spin = field.spin.norm();
  const Vector3d swirl = field.swirl(origin);
  const double reach = static_cast<double>(b.diagonal);
  const double speed = field.steady.norm() + swirl.norm() + spin * reach;
  const auto scale = static_cast<double>(rates->scale);
  const V16 slack = hn::Set(d, static_cast<float>(scale * kRateRounding * speed));
  float base[6];
  float bend[6];
  float along[6][3];
  for (int axis = 0; axis < 6; ++axis) {
    const Vector3d n = axis < 3 ? node_axis(a, axis) : axes_b[axis - 3];
    const Vector3d across = n.cross(field.spin);  // n . (spin x p) = (n x spin) . p
    base[axis] = static_cast<float>(scale * n.dot(field.steady + swirl));
    bend[axis] = static_cast<float>(2.0 * across.norm());
    for (int m = 0; m < 3; ++m) along[axis][m] = static_cast<float>(across.dot(axes_b[m]));
  }
  const auto spin_f = static_cast<float>(spin);
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 centre[3];
    V16 half[3];
    for (int m = 0; m < 3; ++m) {
      centre[m] = hn::Mul(hn::Load(d, boxes.centre[m] + lane), hn::Set(d, rates->scale));
      half[m] = hn::Mul(hn::Load(d, boxes.half[m] + lane), hn::Set(d, rates->scale));
    }
    V16 square = hn::Zero(d);
    V16 size = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      V16 s = hn::Set(d, static_cast<float>(scale * swirl[k]));
      for (int m = 0; m < 3; ++m) {
        const double turned = field.spin.cross(axes_b[m])[k];
        s = hn::MulAdd(centre[m], hn::Set(d, static_cast<float>(turned)), s);
      }
      square = hn::MulAdd(s, s, square);
      size = hn::MulAdd(half[k], half[k], size);
    }
    const V16 swirl_most = hn::Add(hn::MulAdd(hn::Sqrt(size), hn::Set(d, spin_f), hn::Sqrt(square)), slack);
    for (int axis = 0; axis < 6; ++axis) {
      V16 rate = hn::Set(d, base[axis]);
      V16 spread = slack;
      for (int m = 0; m < 3; ++m) {
        rate = hn::MulAdd(centre[m], hn::Set(d, along[axis][m]), rate);
        spread = hn::MulAdd(half[m], hn::Set(d, std::abs(along[axis][m])), spread);
      }
      hn::Store(hn::Add(spread, rate), d, rates->up[axis] + lane);
      hn::Store(hn::Sub(spread, rate), d, rates->down[axis] + lane);
      hn::Store(hn::Mul(swirl_most, hn::Set(d, bend[axis] * (1.0F + 1e-5F))), d,
                rates->twice_acceleration[axis] + lane);
    }
  }
  return static_cast<float>(speed);
}

/// The t at which r t + (a / 2) t^2 = g, or a little before; 0 where g is not positive. `a2` is 2 a.
template <class D>
HWY_INLINE hn::Vec<D> closing_time(D d, hn::Vec<D> g, hn::Vec<D> r, hn::Vec<D> a2) {
  const auto root = hn::Sqrt(hn::MulAdd(a2, g, hn::Mul(r, r)));
  // r may cancel the root.
  const auto rounding = hn::Mul(hn::Add(root, hn::Abs(r)), hn::Set(d, 8.0F / 16777216.0F));
  const auto below = hn::Max(hn::Add(hn::Add(r, root), rounding), hn::Set(d, 1e-30F));
  const auto time = hn::Div(hn::Mul(g, hn::Set(d, 2.0F * (1.0F - 1e-5F))), below);
  return hn::IfThenElseZero(hn::Gt(g, hn::Zero(d)), time);
}

/// Before which times box `row` of a does not touch the boxes of b; returns for which these are at most `limit`.
HWY_INLINE std::uint32_t closing_times(const ChildBoxes& a, std::uint32_t row, const ChildBoxes& b,
                                       const BoxRates& rates, float limit, float* times) {
  const Floats16 d;
  const V16 zero = hn::Zero(d);
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    V16 latest = zero;
    for (int axis = 0; axis < 6; ++axis) {
      const int k = axis % 3;
      const bool of_a = axis < 3;
      const V16 centre = hn::Load(d, (of_a ? b.other_centre : b.centre)[k] + lane);
      const V16 half = hn::Load(d, (of_a ? b.other_half : b.half)[k] + lane);
      const V16 apart = hn::Sub(centre, hn::Set(d, (of_a ? a.centre : a.other_centre)[k][row]));
      const V16 gap = hn::Sub(hn::Abs(apart), hn::Add(half, hn::Set(d, (of_a ? a.half : a.other_half)[k][row])));
      const V16 g = hn::Mul(gap, hn::Set(d, rates.scale));
      const V16 rate =
          hn::IfThenElse(hn::Gt(apart, zero), hn::Load(d, rates.down[axis] + lane), hn::Load(d, rates.up[axis] + lane));
      latest = hn::Max(latest, closing_time(d, g, rate, hn::Load(d, rates.twice_acceleration[axis] + lane)));
    }
    hn::Store(latest, d, times + lane);
    bits |= bits_of_mask(d, hn::Le(latest, hn::Set(d, limit))) << lane;
  }
  return bits;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
