// SPDX-License-Identifier: Apache-2.0
// Moments of the wrench between a packed body and a static shape with an uncertain pose.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "critical_spheres.h"
#include "prescene/collision/spheres/uncertain_shape_queries.h"
#include "prescene/core/random.h"
#include "uncertain_lanes.h"

namespace prescene::collision {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Vector6d;

// Spheres further apart touch with 0.13 % and push with 4e-4 of a deviation on average.
constexpr double kReach = 3.0;

/// Half the depth, x = max(0, -(gap + sigma z)) / 2, with z standard normal.
struct HalfDepth {
  double mean = 0.0;
  double slope = 0.0;  ///< Minus its expected derivative by the gap: half the probability of touching.
  double rest = 0.0;   ///< r and f2 of WrenchSums.
  double bend = 0.0;

  HalfDepth(double gap, double sigma) {
    if (sigma <= 0.0 || std::abs(gap) > kReach * sigma) {
      mean = 0.5 * std::max(0.0, -gap);
      slope = gap < 0.0 ? 0.5 : 0.0;
      return;
    }
    const double margin = gap / sigma;
    const double density = 0.3989422804014327 * std::exp(-0.5 * margin * margin);
    const double touching = core::normal_cdf(-margin);
    const double depth = sigma * density - gap * touching;
    mean = 0.5 * depth;
    slope = 0.5 * touching;
    // As in the sums over pairs of spheres: what the variance has beyond the first two orders, with the sign of the
    // third.
    const double square = (gap * gap + sigma * sigma) * touching - sigma * gap * density;
    const double linear = sigma * touching;
    const double second = sigma * density;
    const double fourth = second * std::max(0.0, margin * margin - 1.0);
    const double even = second * second + fourth * fourth / 12.0;
    const double known = depth * depth + linear * linear + 0.5 * even;
    const double odd = 0.5 * std::sqrt(std::max(0.0, square - known)) / sigma;
    rest = margin < 0.0 ? odd : -odd;
    bend = 0.5 * std::sqrt(even) / (sigma * sigma);
  }
};

/// Adds up what spheres give; n points from A's sphere to the shape, which turns it. The wrench is that on B.
class ShapeWrench {
 public:
  explicit ShapeWrench(const RelativeUncertainty& between)
      : covariance_(between.covariance()), turn_(covariance_.topLeftCorner<3, 3>()) {
    for (Matrix6d& m : sums_.bending) m.setZero();
  }

  void add(const CriticalSphere& sphere) {
    const HalfDepth x(sphere.gap, sphere.slope.norm());
    if (x.slope <= 0.0) return;
    const Vector3d n = -sphere.normal;
    const Vector3d& c = sphere.centre;
    Vector6d m;
    m << c.cross(n), n;
    sums_.pairs += 2.0 * x.slope;
    // The mean: of x n, of the turn that goes with x, and of turning twice.
    const Vector3d turned =
        -x.slope * (covariance_.topRows<3>() * m).cross(n) + 0.5 * x.mean * (turn_ * n - turn_.trace() * n);
    add_vector(n * x.mean + turned, c);
    add_matrix(WrenchSums::kNormal, x.slope, m);
    add_matrix(WrenchSums::kRest, x.rest, m);
    add_tensor(x.bend, m);
    // A direction that turns with B changes as that from A's centre to a place of B that is infinitely far.
    double* sideways = sums_.sums.data() + WrenchSums::kSideways;
    for (std::size_t k = 0; k < 3; ++k) {
      sideways[1 + k] += x.mean * at(n, k);
      for (std::size_t j = 0; j < 3; ++j) sideways[7 + 3 * k + j] += x.mean * at(c, k) * at(n, j);
    }
    add_turning(x.slope, m, n, c);
  }

  UncertainWrench wrench(const RelativeUncertainty& between, double stiffness) const {
    UncertainWrench wrench;
    if (sums_.pairs == 0.0) return wrench;
    const Eigen::Map<const Vector6d> mean(sums_.sums.data() + WrenchSums::kMean);
    wrench.force = -stiffness * mean.head<3>();
    wrench.torque = -stiffness * mean.tail<3>();
    wrench.expected_pairs = sums_.pairs;
    wrench.covariance = stiffness * stiffness * wrench_covariance(sums_, between.factor());
    return wrench;
  }

 private:
  static double at(const Vector3d& v, std::size_t k) { return v[static_cast<Eigen::Index>(k)]; }

  void add_vector(const Vector3d& force, const Vector3d& place) {
    Eigen::Map<Vector6d> mean(sums_.sums.data() + WrenchSums::kMean);
    mean.head<3>() += force;
    mean.tail<3>() += place.cross(force);
  }
  void add_matrix(std::size_t first, double weight, const Vector6d& m) {
    double* sum = sums_.sums.data() + first;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) *sum++ += weight * m[i] * m[j];
    }
  }
  void add_tensor(double weight, const Vector6d& m) {
    if (weight == 0.0) return;
    double* sum = sums_.sums.data() + WrenchSums::kKink;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) {
        const double of_both = weight * m[i] * m[j];
        for (Eigen::Index k = j; k < 6; ++k) *sum++ += of_both * m[k];
      }
    }
  }
  /// What the wrench changes when the depth does and the normal turns at once: its second derivative by the error
  /// (phi, tau), whose first part turns.
  void add_turning(double slope, const Vector6d& m, const Vector3d& n, const Vector3d& c) {
    Eigen::Matrix<double, 6, 3> turning;  // of (torque, force)
    turning << -geometry::cross_matrix(c) * geometry::cross_matrix(n), -geometry::cross_matrix(n);
    for (std::size_t i = 0; i < 6; ++i) {
      const Eigen::Matrix<double, 6, 3> both = -slope * m * turning.row(static_cast<Eigen::Index>(i));
      sums_.bending[i].leftCols<3>() += both;
      sums_.bending[i].topRows<3>() += both.transpose();
    }
  }

  const Matrix6d& covariance_;
  Matrix3d turn_;
  WrenchSums sums_;
};

}  // namespace

UncertainWrench uncertain_wrench(const SphereTree& a, const StaticShape& b, const RelativeUncertainty& between,
                                 const PenaltyOptions& options, UncertainScratch& scratch) {
  const UncertainShape pair(a, b, between);
  ShapeWrench sums(between);
  pair.for_near(kReach, &scratch.memory().nodes, [&](const CriticalSphere& sphere) { sums.add(sphere); });
  return about_point(sums.wrench(between, options.stiffness), options.p_AP);
}

}  // namespace prescene::collision
