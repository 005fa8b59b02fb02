// SPDX-License-Identifier: Apache-2.0
// A test that skips on purpose, and one that does not: no_skip_test.sh runs both through CTest.
#include <gtest/gtest.h>

TEST(Planted, Passes) {}

TEST(Planted, Skips) { GTEST_SKIP() << "the moon is missing"; }
