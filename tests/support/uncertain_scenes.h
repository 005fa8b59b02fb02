// SPDX-License-Identifier: Apache-2.0
// Four small scenes with uncertain starts on which estimators of outcome probabilities are compared: smooth ones with
// few contacts (A, D), one that ends on a rolling body (B) and a chaotic one (C).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"

namespace prescene::tests {

/// A: a carton of 20 x 7 x 7 cm falls beside the middle of an open bin: in, outside or on the rim ("other"). 10
/// uncertain numbers. The bin is one support of five boxes.
belief::Scene carton_over_bin();
/// B: a tilted bottle is let go near the edge of a table: falls, stands or lies ("other"). 8 uncertain numbers.
belief::Scene bottle_at_edge();
/// C: a box of 10 x 8 x 6 cm is thrown, tumbling, on a floor: which face is up ("other" never). 10 uncertain numbers.
belief::Scene tumbling_box();
/// D: the upper of two boxes is shoved: does it stay on the lower one, or not ("other")? 8 uncertain numbers.
belief::Scene shoved_stack();

/// All four, named "A" to "D".
struct NamedScene {
  std::string name;
  std::shared_ptr<const belief::Scene> scene;
};
std::vector<NamedScene> uncertain_scenes();

}  // namespace prescene::tests
