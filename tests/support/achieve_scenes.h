// SPDX-License-Identifier: Apache-2.0
// Ten small problems of four free parameters: how is something to be placed or pushed, so that it ends as wanted? Poses
// in the hand, frictions and the execution are uncertain.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/achieve.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"

namespace prescene::tests {

struct AchieveProblem {
  std::string name;
  std::shared_ptr<const belief::Scene> scene;
  belief::AchieveQuery query;
};
/// Fails where one of the texts that the scenes are made from is wrong.
core::Result<std::vector<AchieveProblem>> achieve_problems();

}  // namespace prescene::tests
