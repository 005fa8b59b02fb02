// SPDX-License-Identifier: Apache-2.0
// How simulated points move with the parameters, as linear functions, and what scores follow.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "prescene/simulation/calibration/m_estimate.h"

namespace prescene::simulation {

/// Linear functions of u, the parameters in units of the trials' spread about their middle.
class PointResponse {
 public:
  /// One row of `trials` for each of `simulated`.
  PointResponse(const Observations& observations, const Eigen::MatrixXd& trials,
                const std::vector<Eigen::MatrixXd>& simulated);

  /// Slopes of the recordings' scores at u, one row each.
  Eigen::MatrixXd slopes(const Eigen::VectorXd& u) const;
  /// Of the mean score, by differences of its slope.
  Eigen::MatrixXd curvature(const Eigen::VectorXd& u) const;
  /// Of each recording's score.
  std::vector<Eigen::MatrixXd> curvatures(const Eigen::VectorXd& u) const;

 private:
  Eigen::MatrixXd slopes_of_points(Eigen::Index view, const Eigen::MatrixXd& points) const;

  const Observations& observations_;
  Eigen::Index parameters_;
  std::vector<Eigen::VectorXd> middles_;    ///< Of each view, its samples' points one after the other.
  std::vector<Eigen::MatrixXd> responses_;  ///< To u, likewise.
  std::vector<double> widths_squared_;      ///< Of each view.
};

}  // namespace prescene::simulation
