// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/quantiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

/// The continued fraction of I_x(a, b); converges fast for x < (a + 1) / (a + b + 2).
double beta_fraction(double x, double a, double b) {
  constexpr double kTiny = 1e-300;  // stands in for a vanishing denominator
  // The number of terms grows like the square root of the larger parameter: 1e5 takes about 1000.
  constexpr int kMaxTerms = 20000;
  const auto away_from_zero = [](double v) { return std::abs(v) < kTiny ? kTiny : v; };
  double c = 1.0;
  double d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
  double fraction = d;
  for (int m = 1; m <= kMaxTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m));
    d = 1.0 / away_from_zero(1.0 + even * d);
    c = away_from_zero(1.0 + even / c);
    fraction *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0));
    d = 1.0 / away_from_zero(1.0 + odd * d);
    c = away_from_zero(1.0 + odd / c);
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < 1e-15) break;
  }
  return fraction;
}

}  // namespace

double log_gamma(double x) {
  PRESCENE_CHECK(x > 0.0);
  double shift = 0.0;
  while (x < 16.0) {
    shift -= std::log(x);
    x += 1.0;
  }
  const double z = 1.0 / (x * x);
  const double series = (1.0 / 12.0 - z * (1.0 / 360.0 - z * (1.0 / 1260.0 - z * (1.0 / 1680.0 - z / 1188.0)))) / x;
  constexpr double kHalfLogTwoPi = 0.91893853320467274178;
  return shift + (x - 0.5) * std::log(x) - x + kHalfLogTwoPi + series;
}

double beta_cdf(double x, double a, double b) {
  PRESCENE_CHECK(a > 0.0 && b > 0.0);
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  const double log_front = log_gamma(a + b) - log_gamma(a) - log_gamma(b) + a * std::log(x) + b * std::log1p(-x);
  if (x < (a + 1.0) / (a + b + 2.0)) return std::exp(log_front) * beta_fraction(x, a, b) / a;
  return 1.0 - std::exp(log_front) * beta_fraction(1.0 - x, b, a) / b;
}

double beta_quantile(double p, double a, double b) {
  PRESCENE_CHECK(p >= 0.0 && p <= 1.0);
  if (p == 0.0 || p == 1.0) return p;
  // Bisection on the logit of x keeps relative accuracy at both ends, where the quantiles of nearly empty classes lie.
  double low = -700.0, high = 700.0;
  const auto x_of = [](double logit) { return 1.0 / (1.0 + std::exp(-logit)); };
  while (high - low > 1e-12 * std::max(1.0, std::abs(low))) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (beta_cdf(x_of(middle), a, b) < p ? low : high) = middle;
  }
  return x_of(0.5 * (low + high));
}

double student_t_quantile(double p, double degrees_of_freedom) {
  PRESCENE_CHECK(p > 0.0 && p < 1.0 && degrees_of_freedom > 0.0);
  if (p == 0.5) return 0.0;
  if (p < 0.5) return -student_t_quantile(1.0 - p, degrees_of_freedom);
  // P(|T| > t) = I_x(n/2, 1/2) with x = n / (n + t^2).
  const double x = beta_quantile(2.0 * (1.0 - p), 0.5 * degrees_of_freedom, 0.5);
  if (x <= 0.0) return std::numeric_limits<double>::infinity();
  return std::sqrt(degrees_of_freedom * (1.0 - x) / x);
}

}  // namespace prescene::simulation
