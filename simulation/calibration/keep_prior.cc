// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/keep_prior.h"

#include <cmath>
#include <vector>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::simulation {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Makes the errors of value i as large as `deviation`; correlations stay.
void set_error(MatrixXd* covariance, Index i, double deviation) {
  const double factor = deviation / std::sqrt((*covariance)(i, i));
  covariance->row(i) *= factor;
  covariance->col(i) *= factor;
  (*covariance)(i, i) = deviation * deviation;
}

}  // namespace

void keep_prior(const VectorXd& prior_mean, const VectorXd& prior_deviation, VectorXd* value, MatrixXd* covariance) {
  std::vector<Index> unidentifiable;
  for (Index i = 0; i < value->size(); ++i)
    if (!(std::sqrt((*covariance)(i, i)) < kUnidentifiable * prior_deviation[i])) unidentifiable.push_back(i);
  if (unidentifiable.empty()) return;
  const auto count = static_cast<Index>(unidentifiable.size());
  VectorXd back(count);
  MatrixXd own(count, count);
  MatrixXd across(value->size(), count);
  for (Index a = 0; a < count; ++a) {
    const Index i = unidentifiable[static_cast<std::size_t>(a)];
    back[a] = prior_mean[i] - (*value)[i];
    across.col(a) = covariance->col(i);
    for (Index b = 0; b < count; ++b) own(a, b) = (*covariance)(i, unidentifiable[static_cast<std::size_t>(b)]);
  }
  *value += across * geometry::solve_symmetric(own, back);
  for (const Index i : unidentifiable) {
    (*value)[i] = prior_mean[i];
    set_error(covariance, i, prior_deviation[i]);
  }
}

}  // namespace prescene::simulation
