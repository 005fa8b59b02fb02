// SPDX-License-Identifier: Apache-2.0
// The area under the share of poses whose error is below a threshold, as the YCB-Video toolbox defines it.
#pragma once

#include <vector>

namespace prescene::service {

/// Area under the share of errors below t for t in [0, max_error], divided by max_error: 1 when all errors are zero.
/// Stepwise like the toolbox's VOCap: between two sorted errors the share at the upper one counts, which is more than
/// the area under the true step function by (last step) at most. Infinite errors are poses that were not found; with no
/// finite error below max_error the area is 0. At least one error.
double stepwise_auc(std::vector<double> errors, double max_error = 0.1);

/// Mean of max(0, 1 - error / max_error): the exact area under the step function of the shares.
double linear_auc(const std::vector<double>& errors, double max_error = 0.1);

/// Share of errors below a limit.
double share_below(const std::vector<double>& errors, double limit);
/// Middle error, of an even number the mean of the two; infinite errors count. Not empty.
double median_of(std::vector<double> errors);

}  // namespace prescene::service
