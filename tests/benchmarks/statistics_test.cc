// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/statistics.h"

#include <gmock/gmock.h>

namespace prescene::benchmarks {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;

TEST(Summarize, WorkedByHand) {
  const std::vector<double> values = {4.0, 1.0, 2.0, 9.0};
  const Summary summary = summarize(values);
  EXPECT_EQ(summary.n, 4U);
  EXPECT_DOUBLE_EQ(summary.mean, 4.0);
  EXPECT_DOUBLE_EQ(summary.median, 3.0);
  EXPECT_DOUBLE_EQ(summary.min, 1.0);
  EXPECT_DOUBLE_EQ(summary.max, 9.0);
  EXPECT_NEAR(summary.standard_deviation, 3.559026084, 1e-9);  // sqrt((0 + 9 + 4 + 25) / 3)
  EXPECT_DOUBLE_EQ(summary.median_absolute_deviation, 1.5);    // of 1, 2, 1, 6
}

TEST(Summarize, NoneAndOne) {
  EXPECT_EQ(summarize({}).n, 0U);
  const std::vector<double> one = {3.0};
  EXPECT_EQ(summarize(one).standard_deviation, 0.0);
  EXPECT_EQ(summarize(one).median, 3.0);
}

TEST(WithoutOutliers, DropsWhatIsFarFromTheQuartiles) {
  const std::vector<double> values = {100.0, 1.0, 2.0, 3.0, 4.0};  // quartiles 2 and 4: kept in [-1, 7]
  EXPECT_THAT(without_outliers(values), ElementsAre(1.0, 2.0, 3.0, 4.0));
  const std::vector<double> equal = {5.0, 5.0};
  EXPECT_THAT(without_outliers(equal), ElementsAre(5.0, 5.0));
  EXPECT_THAT(without_outliers({}), ElementsAre());
}

TEST(GeometricMean, OfRatios) {
  const std::vector<double> ratios = {2.0, 8.0};
  EXPECT_THAT(geometric_mean(ratios), DoubleNear(4.0, 1e-12));
  EXPECT_EQ(geometric_mean({}), 1.0);
}

}  // namespace
}  // namespace prescene::benchmarks
