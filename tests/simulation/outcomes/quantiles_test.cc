// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/quantiles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "prescene/core/random.h"

namespace prescene::simulation {
namespace {

TEST(Quantiles, StudentAgreesWithTables) {
  struct Row {
    double p, freedom, t;
  };
  // Percentage points as printed in [Abramowitz & Stegun 1964, table 26.10] and, to more digits, by common software.
  for (const Row& row : {Row{0.975, 1, 12.706204736}, Row{0.975, 2, 4.302652730}, Row{0.975, 5, 2.570581836},
                         Row{0.975, 10, 2.228138852}, Row{0.975, 11, 2.200985160}, Row{0.975, 15, 2.131449546},
                         Row{0.975, 30, 2.042272456}, Row{0.975, 120, 1.979930405}, Row{0.95, 7, 1.894578605},
                         Row{0.95, 15, 1.753050356}, Row{0.995, 10, 3.169272673}, Row{0.90, 4, 1.533206274}}) {
    EXPECT_NEAR(student_t_quantile(row.p, row.freedom), row.t, 2e-9 * row.t) << row.p << " " << row.freedom;
    EXPECT_NEAR(student_t_quantile(1.0 - row.p, row.freedom), -row.t, 2e-9 * row.t);
  }
}

TEST(Quantiles, StudentHasItsClosedFormsAndItsLimit) {
  for (double p : {0.6, 0.9, 0.999}) {
    EXPECT_NEAR(student_t_quantile(p, 1.0), std::tan(M_PI * (p - 0.5)), 1e-9 * std::tan(M_PI * (p - 0.5)));
    const double a = 4.0 * p * (1.0 - p);
    EXPECT_NEAR(student_t_quantile(p, 2.0), 2.0 * (p - 0.5) * std::sqrt(2.0 / a), 1e-9);
    EXPECT_NEAR(student_t_quantile(p, 1e5), core::inverse_normal_cdf(p), 1e-4);
  }
  EXPECT_EQ(student_t_quantile(0.5, 3.0), 0.0);
}

TEST(Quantiles, StudentIsMonotoneInItsDegreesOfFreedom) {
  double before = student_t_quantile(0.975, 1.0);
  for (double freedom = 1.37; freedom < 60.0; freedom *= 1.3) {
    const double now = student_t_quantile(0.975, freedom);
    EXPECT_LT(now, before);
    before = now;
  }
}

TEST(Quantiles, BetaHasItsClosedForms) {
  for (double x : {0.003, 0.2, 0.5, 0.77, 0.999}) {
    EXPECT_NEAR(beta_cdf(x, 1.0, 7.5), 1.0 - std::pow(1.0 - x, 7.5), 1e-13);
    EXPECT_NEAR(beta_cdf(x, 3.25, 1.0), std::pow(x, 3.25), 1e-13);
    EXPECT_NEAR(beta_cdf(x, 2.0, 2.0), x * x * (3.0 - 2.0 * x), 1e-13);
    EXPECT_NEAR(beta_cdf(x, 0.5, 0.5), 2.0 / M_PI * std::asin(std::sqrt(x)), 1e-13);
  }
}

TEST(Quantiles, BetaReflects) {
  for (double x : {1e-6, 0.1, 0.4, 0.9})
    for (double a : {0.5, 3.0, 400.0})
      for (double b : {0.5, 12.0, 9000.0}) EXPECT_NEAR(beta_cdf(x, a, b), 1.0 - beta_cdf(1.0 - x, b, a), 1e-11);
}

TEST(Quantiles, BetaQuantileInvertsTheDistributionFunction) {
  for (double p : {1e-4, 0.025, 0.3, 0.5, 0.975, 0.9999})
    for (double a : {0.5, 8.5, 2000.5})
      for (double b : {0.5, 64.5, 8192.5}) {
        const double x = beta_quantile(p, a, b);
        EXPECT_NEAR(beta_cdf(x, a, b), p, 1e-8) << a << " " << b;
      }
  EXPECT_EQ(beta_quantile(0.0, 2.0, 3.0), 0.0);
  EXPECT_EQ(beta_quantile(1.0, 2.0, 3.0), 1.0);
}

TEST(Quantiles, JeffreysLimitsAgreeWithThePublishedTable) {
  // [Brown, Cai & DasGupta 2001, table 5], 95 %: x = 0 and n = 7, 10, 20, 30.
  EXPECT_NEAR(beta_quantile(0.975, 0.5, 7.5), 0.292, 6e-4);
  EXPECT_NEAR(beta_quantile(0.975, 0.5, 10.5), 0.217, 6e-4);
  EXPECT_NEAR(beta_quantile(0.975, 0.5, 20.5), 0.117, 6e-4);
  EXPECT_NEAR(beta_quantile(0.975, 0.5, 30.5), 0.080, 6e-4);
}

TEST(Quantiles, LogGammaOfHalvesAndWholes) {
  EXPECT_NEAR(log_gamma(0.5), 0.5 * std::log(M_PI), 1e-14);
  EXPECT_NEAR(log_gamma(1.0), 0.0, 1e-13);
  EXPECT_NEAR(log_gamma(11.0), std::log(3628800.0), 1e-13);
  EXPECT_NEAR(log_gamma(2.5), std::log(0.75 * std::sqrt(M_PI)), 1e-14);
}

}  // namespace
}  // namespace prescene::simulation
