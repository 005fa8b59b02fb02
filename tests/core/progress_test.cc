// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/progress.h"

#include <gtest/gtest.h>

namespace prescene::core {
namespace {

TEST(Cancellation, ALimitedOneEndsWithTheOuterOneOrAtItsDeadline) {
  const auto now = Cancellation::Clock::now();
  Cancellation outer;
  const Cancellation past(outer, now);
  const Cancellation future(outer, now + std::chrono::hours(1));
  EXPECT_TRUE(past.requested());
  EXPECT_FALSE(future.requested());
  EXPECT_FALSE(outer.requested()) << "the outer one is not touched by the deadline of an inner one";
  outer.request();
  EXPECT_TRUE(future.requested());
}

TEST(Cancellation, ALimitedOneCanBeRequestedAlone) {
  const Cancellation outer;
  Cancellation inner(outer, Cancellation::Clock::now() + std::chrono::hours(1));
  inner.request();
  EXPECT_TRUE(inner.requested());
  EXPECT_FALSE(outer.requested());
}

}  // namespace
}  // namespace prescene::core
