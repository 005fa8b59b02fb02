// SPDX-License-Identifier: Apache-2.0
// How far a true motion may be off a simulated one, and how likely frames are if it is.
//
//   PathError error(0.1, radius, up, symmetry);   // off by a tenth of how far it moves
//   error.move_to(X_WO);                          // where the simulated object is in the next frame
//   const PathFit fit = error.fit(peak);          // the frame's log likelihood, given the frames before
//   error.learn(peak);                            // ... and what it says of where the true one is
//
// No simulated motion is exactly the true one: friction, contacts and the start are known roughly. The error of a path
// (the discrepancy of a model [Kennedy & O'Hagan 2001]) is taken as a random walk: between two frames it grows by a
// share of how far the simulated object moves, and what lies still keeps it; heights and tilts are off only as far as
// the motion goes up or down or tilts. Each frame measures it, so the likelihood of all frames is that of a Kalman
// filter [Kalman 1960].
#pragma once

#include <array>
#include <optional>

#include "prescene/geometry/pose.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::queries {

/// By what share of its motion a simulated path may be off, each as probable before the frames are seen.
inline constexpr std::array<double, 4> kErrorShares = {0.02, 0.06, 0.18, 0.5};

/// Where a frame says that an object is: its likelihood about the peak, as a Gaussian.
struct FramePeak {
  bool seen = false;  ///< Else the frame has no peak, and nothing below means anything.
  geometry::Pose X_WO;
  /// Rotation, then translation, both along W's axes: R = exp(w) R_WO. Variances of turns that change nothing are huge.
  geometry::Matrix6d covariance = geometry::Matrix6d::Identity();
  double log_peak = 0.0;      ///< Log likelihood at the peak.
  double log_mass = 0.0;      ///< Of its integral over translations (m^3) and turns that change something (rad).
  double error = 0.0;         ///< Standard error of log_mass.
  double log_put_down = 0.0;  ///< Log density with which somebody puts the object down there (EventPriors).
  /// m by which the peak is above what the object would rest on there, negative = in it; empty = not known.
  std::optional<double> lift;
};

/// m; deviation of the height at which things rest, from that at which shapes and surfaces have them rest.
inline constexpr double kRestHeight = 0.003;

/// The covariance of a pose in the coordinates of geometry::box_plus (turns along the axes of the object) in those of
/// FramePeak.
geometry::Matrix6d turns_about_W(const geometry::Pose& X_WO, const geometry::Matrix6d& covariance);

/// What is asked of a peak's covariance for every path, worked out once.
struct PeakShape {
  explicit PeakShape(const FramePeak& peak);
  geometry::Matrix6d inverse;
  double log_determinant;
};

struct PathFit {
  double log_likelihood = 0.0;
  double mahalanobis = 0.0;  ///< Squared distance of the path from the peak, by the spread of both.
  double spread = 0.0;       ///< Of the path, by that of the peak: the sum of the ratios of their variances.
};

class PathError {
 public:
  /// `share`: by which the error grows with motion, >= 0; `radius`: of gyration, m, for which turns count as motion.
  /// `up`: W's, a unit vector. `symmetry` must outlive it.
  PathError(double share, double radius, const geometry::Vector3d& up, const geometry::SymmetryGroup& symmetry);

  /// The true pose is off by this much more, whatever moves: coordinates as those of FramePeak.
  void loosen(const geometry::Matrix6d& covariance) { covariance_ += covariance; }
  /// The path goes on from where a frame saw the object; if it `rests`, from where it rests near there.
  void put_at(const FramePeak& peak, bool rests);
  /// By what the error grows while the path shifts and turns so, about W's axes. Of the velocities of a path, that of
  /// their error.
  geometry::Matrix6d growth(const geometry::Vector3d& shift, const geometry::Vector3d& turn) const;
  /// The next pose of the simulated path.
  void move_to(const geometry::Pose& X_WO);
  /// `peak` must be seen, and there must be a pose.
  PathFit fit(const FramePeak& peak) const { return fit(peak, PeakShape(peak)); }
  PathFit fit(const FramePeak& peak, const PeakShape& shape) const;
  void learn(const FramePeak& peak);

  /// Of the true pose, about that of the simulated path: coordinates as those of FramePeak.
  const geometry::Vector6d& mean() const { return mean_; }
  const geometry::Matrix6d& covariance() const { return covariance_; }
  /// Where the true object is, most probably: the path's pose with the mean error.
  geometry::Pose pose() const;

 private:
  geometry::Vector6d innovation(const FramePeak& peak) const;

  double share_, radius_;
  geometry::Vector3d up_;
  const geometry::SymmetryGroup* symmetry_;
  bool placed_ = false;
  geometry::Pose X_WO_;
  geometry::Vector6d mean_ = geometry::Vector6d::Zero();
  geometry::Matrix6d covariance_ = geometry::Matrix6d::Zero();
};

}  // namespace prescene::queries
