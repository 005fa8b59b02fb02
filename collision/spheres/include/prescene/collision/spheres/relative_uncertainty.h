// SPDX-License-Identifier: Apache-2.0
// How uncertain it is where the points of one body are relative to another, when the poses of both are Gaussian.
//
//   PRESCENE_TRY(const RelativeUncertainty between, RelativeUncertainty::make({X_WA, C_A}, {X_WB, C_B}));
//
// Everything is seen from A. To first order in both errors, the point of B whose mean place is p moves by
// d(p) = tau + phi x p, with phi = R_AB phi_B - phi_A and tau = R_WA^T (tau_B - tau_A) + p_AB x R_AB phi_B,
// so that all pairs of points move with one Gaussian error (phi, tau) of six dimensions. What the first order misses is
// bounded: see remainder().
#pragma once

#include <Eigen/Core>

#include "prescene/collision/transform.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// A Gaussian pose: covariance in the error coordinates of geometry::box_plus, rad^2, rad m and m^2.
struct UncertainPose {
  geometry::Pose X_WB;
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
};

class RelativeUncertainty {
 public:
  /// Probability that some error is so large that remainder() does not hold: four bounds of 1e-6 each.
  static constexpr double kRemainderFails = 4e-6;

  /// The errors of A and B are independent. Fails with kInvalidInput when a pose is refused by relative_transform, a
  /// covariance is not finite, symmetric within 1e-6 of its size or positive semidefinite, or the confidence is not in
  /// [0.5, 1 - 1e-9].
  /// `confidence`: how sure "no overlap" and "overlap" must be. No overlap is said of all pairs at once, for the errors
  /// in an ellipsoid of six dimensions: 0.997 is 4.45 standard deviations along any direction. Overlap is said of one
  /// pair, for the displacements of its centre in a ball: 3.73 standard deviations.
  static core::Result<RelativeUncertainty> make(const UncertainPose& a, const UncertainPose& b,
                                                double confidence = 0.997);

  const Transform& X_AB() const { return X_AB_; }
  /// Of (phi, tau), in A's frame about A's origin.
  const geometry::Matrix6d& covariance() const { return covariance_; }
  /// Lower triangular, factor() * factor().transpose() == covariance().
  const geometry::Matrix6d& factor() const { return factor_; }
  double confidence() const { return confidence_; }
  /// Radius of the region of errors in standard deviations.
  double region_radius() const { return region_radius_; }
  /// Radius of the ball of displacements of one place in standard deviations.
  double ball_radius() const { return ball_radius_; }

  /// X_AB when the error of A's pose (in the coordinates of UncertainPose) is its factor times the first six of `z`,
  /// that of B's its factor times the last six: exactly, rotations of any size.
  Transform displaced(const Eigen::Matrix<double, 12, 1>& z) const;

  /// Covariance of the place of B's point at p (m, in A), to first order.
  Eigen::Matrix3d covariance_at(const Eigen::Vector3d& p) const;
  /// d(p) = displacement_at(p) * z with z standard normal in six dimensions.
  Eigen::Matrix<double, 3, 6> displacement_at(const Eigen::Vector3d& p) const;
  /// Bound of the largest standard deviation of the place of B's point at p along any direction.
  double deviation_bound(double distance_to_pivot) const;
  /// Bound of what the first order misses at p, m; also holds the rounding of single precision.
  double remainder(double distance_to_pivot) const { return remainder_ + remainder_slope_ * distance_to_pivot; }
  /// The same for A's points as seen from B: the one at p (m, in A) moves by -d(p) to first order.
  double reversed_remainder(double distance_to_pivot) const {
    return reversed_remainder_ + reversed_remainder_slope_ * distance_to_pivot;
  }
  /// How A's points move along a direction n (of unit length, in A) as seen from B: -n . d(p) to first order. Turns
  /// about n, however large, hardly count.
  class Along {
   public:
    const Eigen::Vector3d& direction() const { return n_; }
    /// Standard deviation of turns about axes across n, at most.
    double tilt() const { return tilt_; }
    /// Bound of what the first order misses for all points within `radius` of p, m.
    double remainder(const Eigen::Vector3d& p, double radius = 0.0) const;

   private:
    friend class RelativeUncertainty;
    Along(const RelativeUncertainty& between, const Eigen::Vector3d& n);

    // Bounds of a body's turns about n, about axes across it, and of both.
    struct Turns {
      double about = 0.0;
      double across = 0.0;
      double both = 0.0;
    };
    Turns turns(const Eigen::Matrix3d& covariance) const;
    double largest_across(const Eigen::Matrix3d& covariance) const;

    const RelativeUncertainty* between_;
    Eigen::Vector3d n_;
    double tilt_;
    Turns a_;
    Turns b_;
  };
  /// The answer refers to this object.
  Along reversed_along(const Eigen::Vector3d& n) const { return Along(*this, n); }
  /// -n . d(p) = slope_along(n, p) . z with z standard normal in six dimensions.
  geometry::Vector6d slope_along(const Eigen::Vector3d& n, const Eigen::Vector3d& p) const;
  /// Bound of how far A's point at p moves as seen from B, m; fails as remainder() does.
  double reversed_displacement(const Eigen::Vector3d& p) const;
  /// Where B is least uncertain, in A, m.
  const Eigen::Vector3d& pivot() const { return pivot_; }

  /// deviation_bound(e)^2 = at_pivot + linear e + quadratic e^2, and remainder(e) = remainder + remainder_slope e.
  struct Growth {
    double at_pivot = 0.0;
    double linear = 0.0;
    double quadratic = 0.0;
    double remainder = 0.0;
    double remainder_slope = 0.0;
  };
  Growth growth() const { return {at_pivot_, linear_, quadratic_, remainder_, remainder_slope_}; }
  /// Of covariance_at(pivot()), which is the least, m^2.
  double least_trace() const { return least_trace_; }

 private:
  RelativeUncertainty() = default;
  void set_growth(const UncertainPose& a, const UncertainPose& b);

  Transform X_AB_;
  geometry::Pose mean_;          // X_AB_ before it was rounded.
  geometry::Matrix6d factor_a_;  // Of the bodies' own errors, translations in A's axes.
  geometry::Matrix6d factor_b_;
  geometry::Matrix6d covariance_ = geometry::Matrix6d::Zero();
  geometry::Matrix6d factor_ = geometry::Matrix6d::Zero();
  double confidence_ = 0.0;
  double region_radius_ = 0.0;
  double ball_radius_ = 0.0;
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero();
  double least_trace_ = 0.0;
  double at_pivot_ = 0.0;
  double linear_ = 0.0;
  double quadratic_ = 0.0;
  double remainder_ = 0.0;
  double remainder_slope_ = 0.0;
  double reversed_remainder_ = 0.0;
  double reversed_remainder_slope_ = 0.0;
  // Of the bodies' own turns, in A's axes, and bounds of turns and shifts.
  Eigen::Matrix3d turns_a_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d turns_b_ = Eigen::Matrix3d::Zero();
  double size_radius_ = 0.0;  // Standard deviations of the largest turns and shifts.
  double most_turn_a_ = 0.0;
  double most_turn_b_ = 0.0;
  double most_shift_ = 0.0;
};

}  // namespace prescene::collision
