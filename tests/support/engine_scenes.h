// SPDX-License-Identifier: Apache-2.0
// Twenty small scenes with uncertain starts on which engines of rigid bodies are compared: each is one mechanism (drop,
// slide, tip, roll, strike, bounce, fall off an edge), each asks one exclusive question about places and turns at the
// end. Masses are certain; friction and restitution are those of the pair (1 of whatever is fixed).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"

namespace prescene::tests {

struct EngineScene {
  std::string name;  ///< In words.
  std::shared_ptr<const belief::Scene> scene;
};
std::vector<EngineScene> engine_scenes();

}  // namespace prescene::tests
