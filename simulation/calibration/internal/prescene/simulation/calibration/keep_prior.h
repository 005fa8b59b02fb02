// SPDX-License-Identifier: Apache-2.0
// A parameter about which recordings say nothing keeps its prior.
#pragma once

#include <Eigen/Core>

namespace prescene::simulation {

/// Share of the prior's deviation, from which on a parameter counts as unidentifiable.
inline constexpr double kUnidentifiable = 0.9;

/// Of an estimate under independent Gaussian priors: values whose error is kUnidentifiable of their prior's deviation
/// or more become the prior's mean with its deviation; the others move along, as their errors hang together. What they
/// say of an unidentifiable value is chance. No error stays above its prior's. `covariance` is square, of the values'
/// size.
void keep_prior(const Eigen::VectorXd& prior_mean, const Eigen::VectorXd& prior_deviation, Eigen::VectorXd* value,
                Eigen::MatrixXd* covariance);

}  // namespace prescene::simulation
