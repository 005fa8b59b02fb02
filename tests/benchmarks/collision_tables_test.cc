// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/collision_tables.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>

#include "benchmarks/collision_algorithms.h"

namespace prescene::benchmarks {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<double, 2> kShares = {0.0, 0.01};

Cell cell(const char* pair, double share, std::vector<double> ours, std::vector<double> fcl) {
  Cell made;
  made.pair = pair;
  made.share = share;
  made.configurations.resize(ours.size());
  made.collides.assign(ours.size(), true);
  made.timings.resize(2);
  for (std::size_t k = 0; k < 2; ++k) {
    Timings& timings = made.timings[k];
    timings.collide = k == 0 ? ours : fcl;
    timings.answers.assign(ours.size(), true);
    timings.repeated.assign(ours.size(), k == 0 ? 1e-6 : 5e-6);
  }
  return made;
}

Measurements two_algorithms() {
  Measurements measurements;
  measurements.algorithms = {std::string(kDefaultTree), std::string(kFcl)};
  measurements.differs = {"", ""};
  measurements.ours = {true, false};
  return measurements;
}

TEST(SpeedRatio, IsAGeometricMeanOfGeometricMeans) {
  Measurements measurements = two_algorithms();
  measurements.cells = {cell("p", 0.0, {1e-6, 1e-6}, {2e-6, 8e-6}),    // 4
                        cell("p", 0.01, {1e-6}, {16e-6}),              // 16
                        cell("q", 0.0, {2e-6, kNone}, {16e-6, 1e-6}),  // 8
                        cell("q", 0.3, {1e-6}, {1e-6})};               // not asked for
  const std::optional<Ratio> ratio = speed_ratio(measurements, kDefaultTree, kFcl, Query::kCollide, kShares);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(ratio->value, 8.0, 1e-12);
  EXPECT_EQ(ratio->n, 4);
  EXPECT_EQ(ratio->pairs, 2);
  EXPECT_NEAR(speed_ratio(measurements, kDefaultTree, kFcl, Query::kCollideRepeated, kShares)->value, 5.0, 1e-12);
  EXPECT_FALSE(speed_ratio(measurements, kDefaultTree, kOde, Query::kCollide, kShares));
  EXPECT_FALSE(speed_ratio(measurements, kDefaultTree, kFcl, Query::kDistance, kShares));
}

TEST(SpeedRatio, LeavesOutWrongAnswers) {
  Measurements measurements = two_algorithms();
  measurements.cells = {cell("p", 0.0, {1e-6, 1e-6}, {2e-6, 100e-6})};
  measurements.cells[0].timings[1].answers[1] = false;
  const std::optional<Ratio> ratio = speed_ratio(measurements, kDefaultTree, kFcl, Query::kCollide, kShares);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(ratio->value, 2.0, 1e-12);
  EXPECT_EQ(ratio->n, 1);
}

TEST(BatchRatio, ComparesWithSingles) {
  Measurements measurements = two_algorithms();
  measurements.cells = {cell("p", 0.0, {1e-6}, {2e-6})};
  measurements.cells[0].timings[0].batch = {4e-6, 4e-6};
  measurements.cells[0].timings[0].batch_single = {8e-6, 32e-6};
  const std::optional<Ratio> ratio = batch_ratio(measurements, kDefaultTree, kShares);
  ASSERT_TRUE(ratio);
  EXPECT_NEAR(ratio->value, 4.0, 1e-12);
  EXPECT_FALSE(batch_ratio(measurements, kFcl, kShares));
}

TEST(BytesATriangle, CountsLargeMeshes) {
  Measurements measurements = two_algorithms();
  const auto cost = [](std::string_view algorithm, std::uint32_t triangles, double bytes) {
    return MeshCost{std::string(algorithm), "m", triangles, {0.0, bytes}};
  };
  measurements.costs = {cost(kDefaultTree, 100, 9000.0), cost(kDefaultTree, 1000, 20000.0),
                        cost(kDefaultTree, 3000, 40000.0), cost(kFcl, 1000, 700000.0)};
  EXPECT_DOUBLE_EQ(bytes_a_triangle(measurements, kDefaultTree, 1000).value(), 15.0);
  EXPECT_FALSE(bytes_a_triangle(measurements, kDefaultTree, 5000));
}

TEST(Tables, HaveARowAnAlgorithmAndDistance) {
  Measurements measurements = two_algorithms();
  measurements.cells = {cell("p", 0.0, {1e-6, 3e-6}, {2e-6, 8e-6}), cell("p", -0.01, {1e-6}, {16e-6})};
  measurements.wrong = {{"p", 0.0, std::string(kFcl), false, 1e-9, {}}};
  EXPECT_EQ(summary_table(measurements).columns,
            (std::vector<std::string>{"algorithm", "query", "touching", "overlap 1 %"}));
  EXPECT_DOUBLE_EQ(std::get<double>(summary_table(measurements).rows.at(0).at(2)), 2.0);  // the median
  EXPECT_EQ(query_table(measurements).rows.size(), 8U);                                   // with and without outliers
  EXPECT_EQ(std::get<std::int64_t>(wrong_answer_counts(measurements).rows.at(1).at(3)), 1);
  EXPECT_EQ(wrong_answer_table(measurements).rows.size(), 1U);
  EXPECT_NEAR(std::get<double>(ratio_table(measurements).rows.at(0).at(3)), 16.0, 1e-9);
}

}  // namespace
}  // namespace prescene::benchmarks
