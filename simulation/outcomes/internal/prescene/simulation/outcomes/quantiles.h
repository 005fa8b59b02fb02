// SPDX-License-Identifier: Apache-2.0
// Distribution functions and quantiles that intervals are made of.
#pragma once

namespace prescene::simulation {

/// Regularised incomplete beta function I_x(a, b), the distribution function of Beta(a, b); a, b > 0, x in [0, 1].
/// Absolute error below 1e-11 for a, b up to 1e4 (continued fraction, modified Lentz) [Press et al. 2007, section 6.4].
double beta_cdf(double x, double a, double b);

/// The x with beta_cdf(x, a, b) == p; p in [0, 1]. The answer is good to 1e-11 of its
/// distance to 0, and to 1e-16 near 1.
double beta_quantile(double p, double a, double b);

/// The t with P(T <= t) == p of Student's distribution; p in (0, 1), degrees_of_freedom > 0, not necessarily whole.
double student_t_quantile(double p, double degrees_of_freedom);

/// Logarithm of the gamma function for x > 0 (Stirling's series above 16, recurrence below; the C library's own writes
/// a global); relative error about 1e-14.
double log_gamma(double x);

}  // namespace prescene::simulation
