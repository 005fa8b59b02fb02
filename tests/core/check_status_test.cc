// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <memory>

#include "prescene/core/check.h"
#include "prescene/core/status.h"

namespace prescene::core {
namespace {

TEST(CheckDeathTest, NamesPlaceExpressionAndMessage) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const int answer = 41;
  EXPECT_DEATH(PRESCENE_CHECK(answer == 42), "check_status_test.cc:[0-9]+: check failed: answer == 42\n");
  EXPECT_DEATH(PRESCENE_CHECK_MSG(answer == 42, "ask again"), "check failed: answer == 42 \\(ask again\\)\n");
}

TEST(Check, EvaluatesItsConditionOnce) {
  int calls = 0;
  PRESCENE_CHECK(++calls > 0);
  EXPECT_EQ(calls, 1);
}

TEST(Status, DefaultIsOk) {
  EXPECT_TRUE(Status().ok());
  EXPECT_EQ(Status(), ok_status());
  EXPECT_EQ(to_string(Status()), "ok");
}

TEST(Status, TellsCodeAndMessage) {
  const Status status = invalid_input("cup.ply: no vertices");
  EXPECT_FALSE(status.ok());
  EXPECT_EQ(status.code(), StatusCode::kInvalidInput);
  EXPECT_EQ(to_string(status), "invalid input: cup.ply: no vertices");
  EXPECT_EQ(to_string(not_found("x")), "not found: x");
  EXPECT_EQ(to_string(data_loss("x")), "data loss: x");
  EXPECT_EQ(to_string(unsupported("x")), "unsupported: x");
  EXPECT_EQ(to_string(unavailable("x")), "unavailable: x");
  EXPECT_EQ(to_string(resource_exhausted("x")), "resource exhausted: x");
  EXPECT_EQ(to_string(cancelled("x")), "cancelled: x");
}

TEST(Status, PlacesAreStackedFromInsideOut) {
  const Status status = invalid_input("mass is -1").at("line 3").at("scene.yaml");
  EXPECT_EQ(status, invalid_input("scene.yaml: line 3: mass is -1"));
  EXPECT_TRUE(ok_status().at("scene.yaml").ok());
  EXPECT_EQ(Status(StatusCode::kCancelled, "").at("replay").message(), "replay");
}

Result<int> half(int x) {
  if (x % 2 != 0) return invalid_input(std::to_string(x) + " is odd");
  return x / 2;
}

Result<int> quarter(int x) {
  PRESCENE_TRY(const int first, half(x));
  PRESCENE_TRY(const int second, half(first));
  return second;
}

Status check_quarter(int x) {
  PRESCENE_RETURN_IF_ERROR(quarter(x).status());
  return ok_status();
}

TEST(Result, HoldsAValueOrTheReason) {
  EXPECT_TRUE(half(4).ok());
  EXPECT_EQ(*half(4), 2);
  EXPECT_TRUE(half(4).status().ok());
  EXPECT_FALSE(half(3));
  EXPECT_EQ(half(3).status(), invalid_input("3 is odd"));
}

TEST(Result, MacrosPassTheFirstErrorOn) {
  EXPECT_EQ(*quarter(12), 3);
  EXPECT_EQ(quarter(6).status().message(), "3 is odd");
  EXPECT_TRUE(check_quarter(8).ok());
  EXPECT_EQ(check_quarter(10).message(), "5 is odd");
}

TEST(Result, IsNeverMadeFromAnOkStatus) {
  const Result<int> wrong = ok_status();
  EXPECT_FALSE(wrong.ok());
  EXPECT_FALSE(wrong.status().ok());
}

TEST(Result, CarriesValuesThatOnlyMove) {
  const auto make = []() -> Result<std::unique_ptr<int>> { return std::make_unique<int>(7); };
  const auto use = [&]() -> Result<int> {
    PRESCENE_TRY(const std::unique_ptr<int> value, make());
    return *value;
  };
  EXPECT_EQ(*use(), 7);
}

}  // namespace
}  // namespace prescene::core
