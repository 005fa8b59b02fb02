// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/pose_auc.h"

#include <algorithm>

#include "prescene/core/check.h"

namespace prescene::service {

double stepwise_auc(std::vector<double> errors, double max_error) {
  PRESCENE_CHECK(!errors.empty());
  std::sort(errors.begin(), errors.end());
  const auto count = static_cast<double>(errors.size());
  double area = 0.0, previous = 0.0, share = 0.0;
  for (std::size_t i = 0; i < errors.size() && errors[i] <= max_error; ++i) {
    share = static_cast<double>(i + 1) / count;
    area += (errors[i] - previous) * share;
    previous = errors[i];
  }
  return (area + (max_error - previous) * share) / max_error;
}

double linear_auc(const std::vector<double>& errors, double max_error) {
  PRESCENE_CHECK(!errors.empty());
  double sum = 0.0;
  for (const double error : errors) sum += std::max(0.0, 1.0 - error / max_error);
  return sum / static_cast<double>(errors.size());
}

double share_below(const std::vector<double>& errors, double limit) {
  if (errors.empty()) return 0.0;
  const auto below = std::count_if(errors.begin(), errors.end(), [&](double error) { return error < limit; });
  return static_cast<double>(below) / static_cast<double>(errors.size());
}

double median_of(std::vector<double> errors) {
  PRESCENE_CHECK(!errors.empty());
  std::sort(errors.begin(), errors.end());
  const std::size_t middle = errors.size() / 2;
  return errors.size() % 2 == 1 ? errors[middle] : 0.5 * (errors[middle - 1] + errors[middle]);
}

}  // namespace prescene::service
