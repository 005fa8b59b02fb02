// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of tests/support (matchers, generators) take for granted.
#pragma once

#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"

namespace prescene::tests::given_tests_support {

using geometry::Pose;

extern const geometry::Pose X_WB, expected;
extern const geometry::DepthImage depth, expected_depth;

}  // namespace prescene::tests::given_tests_support
