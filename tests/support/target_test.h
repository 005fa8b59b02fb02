// SPDX-License-Identifier: Apache-2.0
// Tests that run once for each instruction set of the machine.
#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <string>
#include <vector>

namespace prescene::collision {

/// HWY_DYNAMIC_DISPATCH goes to this target; 0: to the best again.
inline void use_target(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().DeInit();
}

/// The same as long as it lives, also where an assertion throws.
class UseTarget {
 public:
  explicit UseTarget(std::int64_t target) { use_target(target); }
  UseTarget(const UseTarget&) = delete;
  UseTarget& operator=(const UseTarget&) = delete;
  ~UseTarget() { use_target(0); }
};

/// Runs with HWY_DYNAMIC_DISPATCH going to the target that is the parameter.
class TargetTest : public testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { use_target(GetParam()); }
  void TearDown() override { use_target(0); }
};

inline std::vector<std::int64_t> all_targets() {
  hwy::SetSupportedTargetsForTest(0);
  return hwy::SupportedAndGeneratedTargets();
}

inline std::string target_name(const testing::TestParamInfo<std::int64_t>& target) {
  return hwy::TargetName(target.param);
}

}  // namespace prescene::collision
