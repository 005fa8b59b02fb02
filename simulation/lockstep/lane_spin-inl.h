// SPDX-License-Identifier: Apache-2.0
// Torque-free rotation (prescene/simulation/rules/free_spin.h), in lanes.
#if defined(PRESCENE_SIMULATION_LANE_SPIN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_LANE_SPIN_INL_H_
#undef PRESCENE_SIMULATION_LANE_SPIN_INL_H_
#else
#define PRESCENE_SIMULATION_LANE_SPIN_INL_H_
#endif

#include "lane_math-inl.h"
#include "lane_state.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

template <class V>
struct Spin {
  Quat<V> q;
  Vec3<V> w_P;  ///< rad/s, in the body's axes.
};

template <class V>
HWY_INLINE Vec3<V> set3(const Eigen::Vector3d& p) {
  return set3<V>(p.x(), p.y(), p.z());
}

/// After a share of a step without torque.
template <class V>
HWY_INLINE Spin<V> spun(const LaneBody& body, const Spin<V>& spin, V share) {
  const Vec3<V> moments = set3<V>(body.unit_moments);
  const Vec3<V> inverse = set3<V>(1.0 / body.unit_moments[0], 1.0 / body.unit_moments[1], 1.0 / body.unit_moments[2]);
  const Vec3<V> about_least = set3<V>(body.spin_rates.about_least) * share;
  const Vec3<V> about_most = set3<V>(body.spin_rates.about_most) * share;
  Vec3<V> momentum = times(moments, spin.w_P);
  Quat<V> q = spin.q;
  for (const Vec3<V>* about : {&about_least, &about_most, &about_least}) {
    const Quat<V> turn = exp_rotation(times(*about, momentum));
    q = q * turn;
    momentum = rotated(conjugate(turn), momentum);
  }
  return {turned(q, rotated(q, momentum) * (set<V>(body.spin_rates.about_momentum) * share)), times(inverse, momentum)};
}

/// Turned by a rotation vector in the body's axes, without a change of its energy: the spin turns along, but for where
/// the body looks the same about an axis.
template <class V>
HWY_INLINE Spin<V> turned(const LaneBody& body, const Spin<V>& spin, const Vec3<V>& turn_P) {
  const Vec3<V> with_spin = times(set3<V>(body.uneven_axes), turn_P);
  const Quat<V> alone = exp_rotation(turn_P - with_spin);
  // In axes that are turned along, the spin stays; about the others they are turned away from it.
  return {normalized(spin.q * exp_rotation(with_spin) * alone), rotated(conjugate(alone), spin.w_P)};
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
