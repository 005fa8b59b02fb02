// SPDX-License-Identifier: Apache-2.0
// Vectors of lanes: three-vectors, quaternions and rotations, for sources that are compiled for each target by
// foreach_target.h. Nothing is fused: a lane's bits are the same on every target.
#if defined(PRESCENE_SIMULATION_LANE_MATH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_LANE_MATH_INL_H_
#undef PRESCENE_SIMULATION_LANE_MATH_INL_H_
#else
#define PRESCENE_SIMULATION_LANE_MATH_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
using DOf = hn::DFromV<V>;
template <class V>
using MOf = hn::Mask<DOf<V>>;

template <class V>
HWY_INLINE V set(double value) {
  return hn::Set(DOf<V>(), static_cast<hn::TFromV<V>>(value));
}
template <class V>
HWY_INLINE V select(MOf<V> mask, V yes, V no) {
  return hn::IfThenElse(mask, yes, no);
}

/// Bit i: that of lane i.
template <class D>
HWY_INLINE std::uint32_t bits_of(D d, hn::Mask<D> mask) {
  static_assert(hn::MaxLanes(D()) <= 16);
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8;
}

template <class V>
struct Vec3 {
  V x, y, z;
};
template <class V>
HWY_INLINE Vec3<V> operator+(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
HWY_INLINE Vec3<V> operator-(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
HWY_INLINE Vec3<V> operator*(const Vec3<V>& a, V s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class V>
HWY_INLINE Vec3<V> times(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class V>
HWY_INLINE V dot(const Vec3<V>& a, const Vec3<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
HWY_INLINE Vec3<V> cross(const Vec3<V>& a, const Vec3<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
HWY_INLINE Vec3<V> neg(const Vec3<V>& a) {
  return {hn::Neg(a.x), hn::Neg(a.y), hn::Neg(a.z)};
}
template <class V>
HWY_INLINE Vec3<V> select(MOf<V> mask, const Vec3<V>& yes, const Vec3<V>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}
template <class V>
HWY_INLINE Vec3<V> set3(double x, double y, double z) {
  return {set<V>(x), set<V>(y), set<V>(z)};
}
template <class V>
HWY_INLINE Vec3<V> set3(const std::array<double, 3>& p) {
  return set3<V>(p[0], p[1], p[2]);
}
template <class V>
HWY_INLINE V length(const Vec3<V>& a) {
  return hn::Sqrt(dot(a, a));
}

/// Rows of a matrix.
template <class V>
struct Mat3 {
  Vec3<V> r0, r1, r2;
};
template <class V>
HWY_INLINE Vec3<V> operator*(const Mat3<V>& m, const Vec3<V>& a) {
  return {dot(m.r0, a), dot(m.r1, a), dot(m.r2, a)};
}
template <class V>
HWY_INLINE Vec3<V> transposed(const Mat3<V>& m, const Vec3<V>& a) {
  return m.r0 * a.x + m.r1 * a.y + m.r2 * a.z;
}
template <class V>
HWY_INLINE Mat3<V> transpose(const Mat3<V>& m) {
  return {{m.r0.x, m.r1.x, m.r2.x}, {m.r0.y, m.r1.y, m.r2.y}, {m.r0.z, m.r1.z, m.r2.z}};
}
/// a^T b.
template <class V>
HWY_INLINE Mat3<V> transposed_times(const Mat3<V>& a, const Mat3<V>& b) {
  const Mat3<V> t = transpose(a);
  return {transposed(b, t.r0), transposed(b, t.r1), transposed(b, t.r2)};
}
template <class V>
HWY_INLINE Mat3<V> operator*(const Mat3<V>& a, const Mat3<V>& b) {
  return {transposed(b, a.r0), transposed(b, a.r1), transposed(b, a.r2)};
}
template <class V>
HWY_INLINE Mat3<V> set_matrix(const std::array<double, 9>& m) {
  return {set3<V>(m[0], m[1], m[2]), set3<V>(m[3], m[4], m[5]), set3<V>(m[6], m[7], m[8])};
}
template <class V>
HWY_INLINE Mat3<V> abs(const Mat3<V>& m) {
  return {{hn::Abs(m.r0.x), hn::Abs(m.r0.y), hn::Abs(m.r0.z)},
          {hn::Abs(m.r1.x), hn::Abs(m.r1.y), hn::Abs(m.r1.z)},
          {hn::Abs(m.r2.x), hn::Abs(m.r2.y), hn::Abs(m.r2.z)}};
}

template <class V>
struct Quat {
  V w, x, y, z;
};
template <class V>
HWY_INLINE Quat<V> operator*(const Quat<V>& a, const Quat<V>& b) {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
template <class V>
HWY_INLINE Quat<V> normalized(const Quat<V>& q) {
  const V scale = set<V>(1.0) / hn::Sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}
template <class V>
HWY_INLINE Quat<V> select(MOf<V> mask, const Quat<V>& yes, const Quat<V>& no) {
  return {hn::IfThenElse(mask, yes.w, no.w), hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.z, no.z)};
}
template <class V>
HWY_INLINE Mat3<V> matrix_of(const Quat<V>& q) {
  const V one = set<V>(1.0);
  const V two = set<V>(2.0);
  const V xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const V xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const V wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  return {{one - two * (yy + zz), two * (xy - wz), two * (xz + wy)},
          {two * (xy + wz), one - two * (xx + zz), two * (yz - wx)},
          {two * (xz - wy), two * (yz + wx), one - two * (xx + yy)}};
}
template <class V>
HWY_INLINE Quat<V> conjugate(const Quat<V>& q) {
  return {q.w, hn::Neg(q.x), hn::Neg(q.y), hn::Neg(q.z)};
}
/// The vector turned by a unit quaternion.
template <class V>
HWY_INLINE Vec3<V> rotated(const Quat<V>& q, const Vec3<V>& v) {
  const Vec3<V> axis{q.x, q.y, q.z};
  const Vec3<V> twice = cross(axis, v) * set<V>(2.0);
  return v + twice * q.w + cross(axis, twice);
}
/// exp of a rotation vector. Series of sine and cosine of an eighth of the angle: exact to rounding up to 6 rad, more
/// than anything but a needle turns in a step; beyond, whole turns are taken off.
template <class V>
HWY_INLINE Quat<V> exp_rotation(const Vec3<V>& turn) {
  Vec3<V> h = turn * set<V>(0.125);
  V s = dot(h, h);
  const auto more = hn::Gt(s, set<V>(0.6));
  if (HWY_UNLIKELY(!hn::AllFalse(DOf<V>(), more))) {
    const V turns = hn::Sqrt(s) * set<V>(8.0 / (2.0 * std::numbers::pi));
    const V share = (turns - hn::Round(turns)) / select(more, turns, set<V>(1.0));
    h = select(more, h * share, h);
    s = dot(h, h);
  }
  const V cosine =
      set<V>(1.0) - s * (set<V>(1.0 / 2) - s * (set<V>(1.0 / 24) - s * (set<V>(1.0 / 720) - s * set<V>(1.0 / 40320))));
  const V sine = set<V>(1.0) -
                 s * (set<V>(1.0 / 6) - s * (set<V>(1.0 / 120) - s * (set<V>(1.0 / 5040) - s * set<V>(1.0 / 362880))));
  Quat<V> e{cosine, sine * h.x, sine * h.y, sine * h.z};
  e = e * e;
  return e * e;
}
/// exp of a rotation vector times q, normalised.
template <class V>
HWY_INLINE Quat<V> turned(const Quat<V>& q, const Vec3<V>& turn) {
  return normalized(exp_rotation(turn) * q);
}

/// Two unit vectors across a unit vector [Duff et al. 2017].
template <class V>
HWY_INLINE void basis(const Vec3<V>& n, Vec3<V>& t1, Vec3<V>& t2) {
  const V one = set<V>(1.0);
  const V sign = select(hn::Lt(n.z, set<V>(0.0)), set<V>(-1.0), one);
  const V a = hn::Neg(one / (sign + n.z));
  const V b = n.x * n.y * a;
  t1 = {one + sign * n.x * n.x * a, sign * b, hn::Neg(sign * n.x)};
  t2 = {b, sign + n.y * n.y * a, hn::Neg(n.y)};
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
