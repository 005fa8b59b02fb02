// SPDX-License-Identifier: Apache-2.0
// Two bodies of spheres: SphereContactFinder::spheres_spheres of Bullet's stepper in lanes. The contacts of what is
// near each other (sphere_descent-inl.h), and of these the nearest.
#if defined(PRESCENE_SIMULATION_SPHERE_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SPHERE_PAIRS_INL_H_
#undef PRESCENE_SIMULATION_SPHERE_PAIRS_INL_H_
#else
#define PRESCENE_SIMULATION_SPHERE_PAIRS_INL_H_
#endif

#include <bit>
#include <cmath>

#include "lane_math-inl.h"
#include "lane_spheres.h"
#include "sphere_descent-inl.h"
#include "sphere_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// Meets what was found, and keeps of each sphere and patch the contact with the least gap.
class SphereMeeting : private SphereDescent {
 public:
  SphereMeeting(const SphereQuery& query, SphereScratch& scratch)
      : SphereDescent(query, scratch), found_(scratch.found) {}

  void meet() {
    found_.clear();
    pairs_.begin(a_, b_);
    descend();
    look_at_nearest();
    look_at_edges();
    keep_best();
  }

 private:
  // What is looked at, a vector at a time: spheres and the patches below them.
  struct Batch {
    SphereLanes::PatchRows sphere{}, patch{};
    SphereLanes::Row sign{};
    std::array<SpherePairs::Two, kNodeWidth> ids{};
    std::size_t count = 0;
  };
  static void copy_lane(const SphereLanes::PatchRows& from, std::size_t i, SphereLanes::PatchRows& to, std::size_t k,
                        bool whole) {
    for (std::size_t j = 0; j < 3; ++j) {
      to.centre[j][k] = from.centre[j][i];
      to.point[j][k] = from.point[j][i];
      to.normal[j][k] = from.normal[j][i];
    }
    to.radius[k] = from.radius[i];
    to.reach[k] = from.reach[i];
    if (!whole) return;
    for (std::size_t j = 0; j < 3; ++j) {
      to.bend[j][k] = from.bend[j][i];
      to.tangent[j][k] = from.bent ? from.tangent[j][i] : Real(0);
      to.bitangent[j][k] = from.bent ? from.bitangent[j][i] : Real(0);
      for (std::size_t l = 0; l < 2; ++l) to.out[l][j][k] = from.limited ? from.out[l][j][i] : Real(0);
    }
    for (std::size_t l = 0; l < 2; ++l) to.distance[l][k] = from.distance[l][i];
    to.bent = to.bent || from.bent;
    to.limited = to.limited || from.limited;
  }

  void look_at(std::int32_t id_a, std::int32_t id_b, Batch& batch) {
    const auto width = static_cast<std::size_t>(kNodeWidth);
    const std::size_t ia = static_cast<std::size_t>(id_a), ib = static_cast<std::size_t>(id_b);
    const SphereLanes::PatchRows &of_a = a_.patches[ia / width], &of_b = placed(id_b / kNodeWidth);
    const bool a_edge = of_a.reach[ia % width] == Real(0), b_edge = of_b.reach[ib % width] == Real(0);
    const bool sphere_of_a = a_edge || (a_is_finer_ && !b_edge);
    const std::size_t k = batch.count++;
    copy_lane(of_a, ia % width, sphere_of_a ? batch.sphere : batch.patch, k, !sphere_of_a);
    copy_lane(of_b, ib % width, sphere_of_a ? batch.patch : batch.sphere, k, sphere_of_a);
    batch.sign[k] = sphere_of_a ? Real(1) : Real(-1);
    batch.ids[k] = {id_a, id_b};
    if (batch.count == width) meet_batch(batch);
  }

  void meet_batch(Batch& batch) {
    const D d;
    const V zero = set<V>(0.0);
    for (std::size_t at = 0; at < batch.count; at += hn::Lanes(d)) {
      const std::size_t filled = std::min(batch.count - at, hn::Lanes(d));
      M wanted = lanes_in((1U << filled) - 1U);
      const PatchLanes sphere(batch.sphere, at), patch(batch.patch, at);
      const V sign = load(batch.sign, at);
      Vec3<V> p = sphere.centre - patch.normal * sphere.radius;
      const Vec3<V> shift = shift_of(p, patch.normal, dot(patch.normal, p - patch.point), sign);
      M over;
      PatchHeight height = height_of(patch, p + shift, over);
      wanted = hn::And(wanted, over);
      p = sphere.centre - height.normal * sphere.radius;
      wanted = hn::And(wanted, stands_for(sphere, p));
      height = height_of(patch, p + shift, over);
      wanted = hn::And(wanted, hn::And(over, hn::Le(height.gap, range_)));
      if (hn::AllFalse(d, wanted)) continue;
      ContactLanes c{p - height.normal * (set<V>(0.5) * height.gap), height.normal * sign, height.gap, zero};
      const M of_a = hn::Gt(sign, zero);
      const Vec3<V> spin = select(of_a, one_lane(query_.own_spin), one_lane(query_.other_spin));
      const Vec3<V> center = select(of_a, one_lane(query_.center), one_lane(query_.other_center));
      turn(c, dot(height.normal, towards_center(spin, sphere.centre - center)), dt_);
      wanted = hn::And(wanted, hn::Le(c.gap, range_));
      offer(c, wanted, batch, at);
    }
    batch.count = 0;
    batch.patch.bent = batch.patch.limited = false;
  }

  void offer(const ContactLanes& c, M wanted, const Batch& batch, std::size_t at) {
    found_.reserve(kNodeWidth);
    append(c, gap_at_end(query_, c, dt_), wanted, found_);
    for (std::uint32_t bits = bits_of(D(), wanted); bits != 0; bits &= bits - 1)
      pairs_.contacts.push_back(batch.ids[at + static_cast<std::size_t>(std::countr_zero(bits))]);
  }

  void look_at_nearest() {
    Batch batch;
    for (const std::int32_t rows : pairs_.touched_a) {
      const SpherePairs::Best& best = pairs_.best_a[static_cast<std::size_t>(rows)];
      for (int i = 0; i < kNodeWidth; ++i) {
        const Real partner = best.partner[static_cast<std::size_t>(i)];
        if (partner >= 0) look_at(rows * kNodeWidth + i, static_cast<std::int32_t>(partner), batch);
      }
    }
    for (const std::int32_t rows : pairs_.touched_b) {
      const SpherePairs::Best& best = pairs_.best_b[static_cast<std::size_t>(rows)];
      for (int i = 0; i < kNodeWidth; ++i) {
        const Real partner = best.partner[static_cast<std::size_t>(i)];
        if (partner < 0) continue;
        const auto id_a = static_cast<std::size_t>(partner);
        const std::int32_t id_b = rows * kNodeWidth + i;
        const Real back = pairs_.best_a[id_a / kNodeWidth].partner[id_a % kNodeWidth];
        if (back != static_cast<Real>(id_b)) look_at(static_cast<std::int32_t>(id_a), id_b, batch);
      }
    }
    meet_batch(batch);
  }

  void look_at_edges() {
    const D d;
    HWY_ALIGN SphereLanes::Row a[4], b[4];
    Batch batch;
    for (std::size_t begin = 0; begin < pairs_.edges.size(); begin += hn::Lanes(d)) {
      const std::size_t filled = std::min(hn::Lanes(d), pairs_.edges.size() - begin);
      for (std::size_t k = 0; k < hn::Lanes(d); ++k) {
        const SpherePairs::Two& two = pairs_.edges[begin + std::min(k, filled - 1)];
        batch.ids[k] = two;
        const SphereLanes::PatchRows& of_a = a_.patches[static_cast<std::size_t>(two.a / kNodeWidth)];
        const SphereLanes::PatchRows& of_b = placed(two.b / kNodeWidth);
        const auto i = static_cast<std::size_t>(two.a % kNodeWidth), j = static_cast<std::size_t>(two.b % kNodeWidth);
        for (std::size_t r = 0; r < 3; ++r) {
          a[r][k] = of_a.centre[r][i];
          b[r][k] = of_b.centre[r][j];
        }
        a[3][k] = of_a.radius[i];
        b[3][k] = of_b.radius[j];
      }
      const Vec3<V> centre{load(a[0], 0), load(a[1], 0), load(a[2], 0)};
      const Vec3<V> between = centre - Vec3<V>{load(b[0], 0), load(b[1], 0), load(b[2], 0)};
      const V distance = length(between), radius = load(a[3], 0);
      const M proper = hn::Gt(distance, set<V>(0.0));
      const Vec3<V> normal = between * (set<V>(1.0) / select(proper, distance, set<V>(1.0)));
      const V gap = distance - radius - load(b[3], 0);
      const ContactLanes c{centre - normal * (radius + set<V>(0.5) * gap), normal, gap, set<V>(0.0)};
      const M wanted = hn::And(hn::And(proper, hn::Le(gap, range_)), lanes_in((1U << filled) - 1U));
      if (!hn::AllFalse(d, wanted)) offer(c, wanted, batch, 0);
    }
  }

  /// Of each sphere and patch the contact with the least gap.
  void keep_best() {
    const auto count = static_cast<std::size_t>(found_.size());
    if (count == 0) return;
    const Real* gap = found_.row(FoundContacts::kGap);
    for (auto* all : {&pairs_.best_a, &pairs_.best_b}) {
      const auto& touched = all == &pairs_.best_a ? pairs_.touched_a : pairs_.touched_b;
      for (const std::int32_t rows : touched) (*all)[static_cast<std::size_t>(rows)].partner.fill(Real(-1));
    }
    const auto partner_of = [&](std::vector<SpherePairs::Best>& all, std::int32_t id) -> Real& {
      return all[static_cast<std::size_t>(id / kNodeWidth)].partner[static_cast<std::size_t>(id % kNodeWidth)];
    };
    for (std::size_t i = 0; i < count; ++i) {
      const SpherePairs::Two& two = pairs_.contacts[i];
      for (Real* known : {&partner_of(pairs_.best_a, two.a), &partner_of(pairs_.best_b, two.b)}) {
        const bool nearer =
            *known < 0 || gap[i] < gap[static_cast<std::size_t>(*known)] - static_cast<Real>(kSameSphereGap);
        if (nearer) *known = static_cast<Real>(i);
      }
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const SpherePairs::Two& two = pairs_.contacts[i];
      const auto mine = static_cast<Real>(i);
      if (partner_of(pairs_.best_a, two.a) != mine && partner_of(pairs_.best_b, two.b) != mine) continue;
      for (int r = FoundContacts::kX; r <= FoundContacts::kAtEnd; ++r) {
        Real* row = found_.row(static_cast<FoundContacts::Row>(r));
        row[kept] = row[i];
      }
      ++kept;
    }
    found_.grow(static_cast<int>(kept) - static_cast<int>(count));
  }

  FoundContacts& found_;
};

inline void meet_spheres_lanes(const SphereQuery* query, SphereScratch* scratch) {
  SphereMeeting(*query, *scratch).meet();
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
