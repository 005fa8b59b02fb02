// SPDX-License-Identifier: Apache-2.0
// Which of many contacts of a pair are kept: SphereContactFinder::reduce of Bullet's stepper in lanes. First corners of
// what the body stands on with its weight, then again and again the one farthest from all that were taken, a tier at a
// time.
#if defined(PRESCENE_SIMULATION_SPHERE_CHOICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_SIMULATION_SPHERE_CHOICE_INL_H_
#undef PRESCENE_SIMULATION_SPHERE_CHOICE_INL_H_
#else
#define PRESCENE_SIMULATION_SPHERE_CHOICE_INL_H_
#endif

#include <algorithm>
#include <array>
#include <bit>

#include "lane_math-inl.h"
#include "lane_spheres.h"
#include "prescene/geometry/polygon.h"
#include "sphere_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::simulation::HWY_NAMESPACE {

/// Scores that differ by less than this share are equal, and the first of them counts: in places that mirror each other
/// the larger score is noise.
constexpr double kSameScore = 1e-5;

class ContactChoice {
 public:
  ContactChoice(FoundContacts& found, ChosenContacts& chosen)
      : found_(found), chosen_(chosen), size_(static_cast<std::size_t>(found.size())) {
    // What the last vector has beyond them is never chosen.
    const std::size_t width = hn::Lanes(D());
    end_ = (size_ + width - 1) / width * width;
    std::fill(found.row(FoundContacts::kAtEnd) + size_, found.row(FoundContacts::kAtEnd) + end_, Real(1e30));
    for (int r = FoundContacts::kX; r < FoundContacts::kAtEnd; ++r) {
      Real* row = found.row(static_cast<FoundContacts::Row>(r));
      std::fill(row + size_, row + end_, Real(0));
    }
  }

  int choose() {
    V smallest = set<V>(1e30);
    for_each([&](std::size_t i) HWY_ATTR { smallest = hn::Min(smallest, at(FoundContacts::kAtEnd, i)); });
    const auto least = static_cast<double>(hn::GetLane(hn::MinOfLanes(D(), smallest)));
    const double bearing = least + kBearing;
    const int first = best(bearing, -1e30, 0.0, [&](std::size_t i) HWY_ATTR { return dot(first_way(), place(i)); });
    if (first < 0) return 0;  // not a number
    take_support_polygon(first, bearing);
    begin_spread();
    struct Tier {
      double at_end;
      std::size_t most;
    };
    const Tier tiers[] = {{bearing, kMostBearing},
                          {std::max(0.0, least + kNearlyBearing), kMostNearlyBearing},
                          {1e29, kMostSphereContacts}};
    for (const Tier& tier : tiers) {
      while (taken_ < tier.most) {
        const int farthest = best(tier.at_end, kSamePlace * kSamePlace, kSameScore,
                                  [&](std::size_t i) HWY_ATTR { return at(FoundContacts::kSpread, i); });
        if (farthest < 0) break;
        take(farthest);
        for_each([&](std::size_t i) HWY_ATTR {
          put(FoundContacts::kSpread, i, hn::Min(at(FoundContacts::kSpread, i), spread_of(i, farthest)));
        });
      }
    }
    return static_cast<int>(taken_);
  }

 private:
  HWY_INLINE V at(FoundContacts::Row row, std::size_t i) const { return hn::Load(D(), found_.row(row) + i); }
  HWY_INLINE void put(FoundContacts::Row row, std::size_t i, V value) const {
    hn::Store(value, D(), found_.row(row) + i);
  }
  HWY_INLINE Vec3<V> place(std::size_t i) const {
    return {at(FoundContacts::kX, i), at(FoundContacts::kY, i), at(FoundContacts::kZ, i)};
  }
  HWY_INLINE Vec3<V> normal(std::size_t i) const {
    return {at(FoundContacts::kNormalX, i), at(FoundContacts::kNormalY, i), at(FoundContacts::kNormalZ, i)};
  }
  std::array<Real, 3> one(FoundContacts::Row first, int i) const {
    const auto of = [&](int k) { return found_.row(static_cast<FoundContacts::Row>(first + k))[i]; };
    return {of(0), of(1), of(2)};
  }
  static HWY_INLINE Vec3<V> first_way() { return set3<V>(kFirstWay[0], kFirstWay[1], kFirstWay[2]); }
  template <class Step>
  HWY_INLINE void for_each(const Step& step) const {
    for (std::size_t i = 0; i < end_; i += hn::Lanes(D())) step(i);
  }

  /// The first with the highest score, of those with gaps of at most `at_end` and scores above `least`; -1: none.
  template <class Score>
  HWY_INLINE int best(double at_end, double least, double same, const Score& score) {
    V highest = set<V>(least);
    for_each([&](std::size_t i) HWY_ATTR {
      const V mine = select(hn::Le(at(FoundContacts::kAtEnd, i), set<V>(at_end)), score(i), set<V>(-1e30));
      put(FoundContacts::kScore, i, mine);
      highest = hn::Max(highest, mine);
    });
    const Real most = hn::GetLane(hn::MaxOfLanes(D(), highest));
    if (!(most > static_cast<Real>(least))) return -1;
    const V enough = one_lane(most - static_cast<Real>(same) * most);
    for (std::size_t i = 0; i < end_; i += hn::Lanes(D())) {
      const std::uint32_t bits = bits_of(D(), hn::Ge(at(FoundContacts::kScore, i), enough));
      if (bits != 0) return static_cast<int>(i) + std::countr_zero(bits);
    }
    return -1;
  }

  void take(int index) { chosen_[taken_++] = index; }

  /// Of what bears on one plane with the first, a few so that they stand on as much of it as all together.
  void take_support_polygon(int first, double bearing) {
    const std::array<Real, 3> n = one(FoundContacts::kNormalX, first), p = one(FoundContacts::kX, first);
    const Vec3<V> from = one_lane(p), facing = one_lane(n);
    Vec3<V> x_axis, y_axis;
    basis(facing, x_axis, y_axis);
    for_each([&](std::size_t i) HWY_ATTR {
      const Vec3<V> to = place(i) - from, bend = normal(i) - facing;
      const M flat = hn::Le(dot(bend, bend), set<V>(kSameWay * kSameWay));
      // Others are nowhere.
      put(FoundContacts::kU, i, select(flat, dot(x_axis, to), set<V>(0.0)));
      put(FoundContacts::kV, i, select(flat, dot(y_axis, to), set<V>(0.0)));
    });
    std::array<geometry::Vector2d, kMostBearing> places = {geometry::Vector2d::Zero()};
    std::array<geometry::Vector2d, 2 * kMostBearing> corners = {geometry::Vector2d::Zero()};
    std::size_t count = 1;
    take(first);
    for (; taken_ < kMostBearing;) {
      const int outermost = best(bearing, kSamePlace, kSameScore, [&](std::size_t i) HWY_ATTR {
        return outside(std::span(corners).first(count), at(FoundContacts::kU, i), at(FoundContacts::kV, i));
      });
      if (outermost < 0) break;
      places[taken_] = {static_cast<double>(found_.row(FoundContacts::kU)[outermost]),
                        static_cast<double>(found_.row(FoundContacts::kV)[outermost])};
      count = geometry::convex_polygon(std::span(places).first(taken_ + 1), corners);
      take(outermost);
    }
  }

  /// Distance from a convex polygon, 0 inside (geometry::distance_outside).
  static HWY_INLINE V outside(std::span<const geometry::Vector2d> corners, V u, V v) {
    const V zero = set<V>(0.0);
    if (corners.size() == 1) {
      const V x = u - set<V>(corners[0].x()), y = v - set<V>(corners[0].y());
      return hn::Sqrt(x * x + y * y);
    }
    V least = set<V>(1e30);
    M out = corners.size() == 2 ? hn::Eq(zero, zero) : hn::Lt(zero, zero);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const geometry::Vector2d& a = corners[k];
      const geometry::Vector2d along = corners[k + 1 < corners.size() ? k + 1 : 0] - a;
      const V ax = set<V>(along.x()), ay = set<V>(along.y());
      const V x = u - set<V>(a.x()), y = v - set<V>(a.y());
      out = hn::Or(out, hn::Lt(ax * y - ay * x, zero));
      const V share = hn::Min(hn::Max((ax * x + ay * y) * set<V>(1.0 / along.squaredNorm()), zero), set<V>(1.0));
      const V dx = x - ax * share, dy = y - ay * share;
      least = hn::Min(least, dx * dx + dy * dy);
    }
    return hn::IfThenElseZero(out, hn::Sqrt(least));
  }

  HWY_INLINE V spread_of(std::size_t i, int taken) const {
    const Vec3<V> apart = place(i) - one_lane(one(FoundContacts::kX, taken));
    const Vec3<V> bend = normal(i) - one_lane(one(FoundContacts::kNormalX, taken));
    return dot(apart, apart) + set<V>(kTurnLength * kTurnLength) * dot(bend, bend);
  }
  void begin_spread() {
    for_each([&](std::size_t i) HWY_ATTR {
      V spread = set<V>(1e30);
      for (std::size_t k = 0; k < taken_; ++k) spread = hn::Min(spread, spread_of(i, chosen_[k]));
      put(FoundContacts::kSpread, i, spread);
    });
  }

  FoundContacts& found_;
  ChosenContacts& chosen_;
  std::size_t size_, end_ = 0;
  std::size_t taken_ = 0;
};

inline int choose_contacts_lanes(FoundContacts* found, ChosenContacts* chosen) {
  return ContactChoice(*found, *chosen).choose();
}

}  // namespace prescene::simulation::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
