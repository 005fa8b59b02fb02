// SPDX-License-Identifier: Apache-2.0
// The vector kernels of uncertain_sphere_queries.h: descent of two sphere trees whose spheres are as large as they may
// become, and what is summed over the pairs of spheres that it finds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

inline constexpr std::size_t kPairLanes = 16;
using PairNumbers = std::array<float, kPairLanes>;

/// RelativeUncertainty in single precision, rounded to the safe side. The bounds of deviation and remainder are concave
/// in the squared distance w from the pivot: tangents of them, which take no root, are bounds, too.
struct Swelling {
  /// The tangents touch where B's spheres are.
  Swelling(const RelativeUncertainty& between, const SphereTree& b);

  Transform X_AB;
  std::array<float, 3> pivot;
  float deviation;  ///< deviation + deviation_slope w, m.
  float deviation_slope;
  float remainder;  ///< remainder + remainder_slope w, m.
  float remainder_slope;
  float region_radius;  ///< Of RelativeUncertainty, as ball_radius.
  float ball_radius;
  float least_trace;                  ///< Of covariance_at(pivot), m^2.
  std::array<float, 9> trace_growth;  ///< Times the offset from the pivot, twice: what the trace is more elsewhere.
  std::array<float, 21> factor;       ///< Rows of the lower triangle of RelativeUncertainty::factor().
};

/// Whether errors of so many standard deviations may bring some spheres of two trees together, by their bounding
/// spheres alone.
bool roots_may_meet(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between, double deviations);

/// Pairs of spheres, one array a number: the centre in A, B's centre in A, and the sum of the radii, m.
template <std::size_t Capacity>
struct SpherePairs {
  static constexpr std::size_t kCapacity = Capacity;
  // A vector may be stored at the last place.
  using Numbers = std::array<float, Capacity + kPairLanes>;
  alignas(64) std::array<Numbers, 3> a{};
  alignas(64) std::array<Numbers, 3> b{};
  alignas(64) Numbers radii{};
  std::size_t size = 0;
};

using PairBuffer = SpherePairs<512>;

/// The pairs that may touch first, by the length of the shortest error that lets them.
struct CriticalPairs {
  static constexpr std::size_t kMost = 64;

  SpherePairs<kMost> pairs;
  /// In standard deviations along the line of centres; below 0: they touch at the mean. The remainder counts against
  /// them: no shorter error makes them touch.
  alignas(64) std::array<float, kMost + kPairLanes> margin{};
  bool certain = false;  ///< `certain_pair` touches wherever its centre is within the ball.
  std::size_t certain_pair = 0;
  bool complete = true;   ///< No pair with a margin within the region was left out.
  float left_out = 0.0F;  ///< No pair that was left out has a smaller margin.
};

/// Memory of a descent.
struct DescentStack {
  struct Pairs {
    std::vector<std::uint32_t> a;  ///< Nodes.
    std::vector<std::uint32_t> b;
    std::vector<float> gap;  ///< How deep they are.
    /// Grows by at least half.
    void reserve(std::size_t size);
  };
  Pairs open;
  Pairs below;  ///< The level below.
  PairBuffer buffer;
};

void find_critical_pairs(const SphereTree& a, const SphereTree& b, const Swelling& swelling, DescentStack* stack,
                         CriticalPairs* critical);

OverlapState find_state(const SphereTree& a, const SphereTree& b, const Swelling& swelling, DescentStack* stack);

/// Lines through the space of the six normal numbers behind the error: all have the direction `direction`.
struct ErrorLines {
  static constexpr std::size_t kCount = 32;
  std::array<std::array<float, 6>, kCount> start{};
  std::array<float, 6> direction{};
};
/// Where along each line some pair touches: `most` intervals a line at most, joined where they overlap. Returns how
/// many of `ends` each line has.
struct TouchingIntervals {
  static constexpr std::size_t kMost = 8;
  std::array<std::array<float, kMost>, ErrorLines::kCount> low{};
  std::array<std::array<float, kMost>, ErrorLines::kCount> high{};
  std::array<std::size_t, ErrorLines::kCount> count{};
};
void intersect_lines(const CriticalPairs& critical, const Swelling& swelling, const ErrorLines& lines,
                     TouchingIntervals* intervals);

/// A tensor of three indices, symmetric in all: t[i](j, k).
using SymmetricTensor = std::array<geometry::Matrix6d, 6>;

/// Sums over pairs near each other, of a part of the second derivative that matters only where many touch: all are
/// taken to be at the mean of their places.
struct LocalSums {
  static constexpr std::size_t kPlace = 0;   ///< Places times weights: 3.
  static constexpr std::size_t kWeight = 3;  ///< Weights.
  static constexpr std::size_t kBent = 4;    ///< b n, of b (n I + I n + n I - 3 n n n): 3.
  static constexpr std::size_t kCubic = 7;   ///< b n n n over i <= j <= k: 10.
  static constexpr std::size_t kCount = 17;
  std::array<double, kCount> sums{};
};
/// Adds the second derivative of the wrench, over m = (c, n) in place of (n, c).
void add_bending(const LocalSums& local, SymmetricTensor* bending);

/// Sums over pairs, of which the moments of the wrench are made. n is the unit vector from A's centre a to B's mean
/// centre p, c = p x n; x is half the depth, f0 and f1 its mean and expected derivative along n.
struct WrenchSums {
  static constexpr std::size_t kMean = 0;       ///< f0 (n, c): 6.
  static constexpr std::size_t kNormal = 6;     ///< (f1 + w) (c, n) (c, n)^T, upper triangle by rows: 21.
  static constexpr std::size_t kSideways = 27;  ///< w, w p, w a, w a p^T by rows: 16; w is the sideways stiffness.
  static constexpr std::size_t kRest = 43;      ///< r m m, upper triangle: 21; r, f2: see WrenchSink.
  static constexpr std::size_t kKink = 64;      ///< f2 m m m over i <= j <= k: 56.
  static constexpr std::size_t kCount = 120;
  std::array<double, kCount> sums{};
  double pairs = 0.0;       ///< Expected number of pairs that touch.
  SymmetricTensor bending;  ///< Of all but the kinks.
};
/// Covariance of the wrench (force, torque) for unit stiffness, the error being factor * z with z standard normal.
geometry::Matrix6d wrench_covariance(const WrenchSums& sums, const geometry::Matrix6d& factor);
/// The wrench about A's origin as one about the point P of A.
UncertainWrench about_point(const UncertainWrench& wrench, const Eigen::Vector3d& p_AP);
/// Pairs further apart than `reach` standard deviations are left out.
void sum_wrenches(const SphereTree& a, const SphereTree& b, const Swelling& swelling, float reach, DescentStack* stack,
                  WrenchSums* sums);

}  // namespace prescene::collision
