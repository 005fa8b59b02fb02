// SPDX-License-Identifier: Apache-2.0
// When two moving inner sphere trees touch first.
//
//   PRESCENE_TRY(const ScrewMotion motion, ScrewMotion::make(X_AB_start, X_AB_end));
//   SweepScratch scratch;
//   const std::optional<Impact> impact = time_of_impact(cup, table, motion, {}, scratch);
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "prescene/collision/screw_motion.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/transform.h"

namespace prescene::collision {

struct Impact {
  double time = 0.0;           ///< In [0, 1]: 0 at the start, 1 at the end of the motion.
  std::uint32_t sphere_a = 0;  ///< Indices in the packings.
  std::uint32_t sphere_b = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< Where they meet, in A, m.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< From A's sphere to B's, in A, of unit length.
};

/// First t in [0, 1] at which |from + t (to - from)| <= radii: two spheres whose centres differ by `from` at the start
/// and by `to` at the end and move along straight lines [Weller and Zachmann 2011], the smaller root clamped to the
/// start. 0 when they touch there; the start and the end may be equal.
std::optional<double> swept_spheres_contact(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radii);

/// Memory that continuous queries work in. One a thread; after the first query on a pair of trees nothing is allocated.
class SweepScratch {
 public:
  struct Entry {
    std::uint32_t a;
    std::uint32_t b;
    float time;  ///< Not before this do their children touch.
  };
  std::vector<Entry>& entries() { return entries_; }

 private:
  std::vector<Entry> entries_;
};

/// B's spheres move along straight lines from where X_AB_start puts them to where X_AB_end does. Exact for that motion
/// up to rounding in double precision; it is a rigid one when B does not turn.
std::optional<Impact> time_of_impact(const SphereTree& a, const SphereTree& b, const Transform& X_AB_start,
                                     const Transform& X_AB_end, SweepScratch& scratch);

inline constexpr double kLeastImpactTolerance = 1e-9;  // m

struct ImpactOptions {
  /// Gap that may be left at the time that is returned, m. kLeastImpactTolerance is taken where less is asked for.
  double tolerance = 1e-5;
};

/// B moves along a screw. The time is never later than the first contact, and then the gap is at most the tolerance: a
/// sphere that turns is taken to move along chords of its path, larger by what it leaves them by, and chords are cut
/// where that matters. Misses nothing: a motion without contact that passes within the tolerance may be reported.
std::optional<Impact> time_of_impact(const SphereTree& a, const SphereTree& b, const ScrewMotion& motion,
                                     const ImpactOptions& options, SweepScratch& scratch);

}  // namespace prescene::collision
