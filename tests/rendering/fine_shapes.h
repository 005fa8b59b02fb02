// SPDX-License-Identifier: Apache-2.0
// Closed, curved household shapes of some 10,000 triangles, with their levels of detail.
#pragma once

#include <string>
#include <vector>

#include "prescene/rendering/sensor/levels_of_detail.h"

namespace prescene::tests {

struct FineShape {
  std::string name;
  geometry::TriangleMesh mesh;
  rendering::LevelsOfDetail levels;  ///< With the default options.
};

/// A vase, a cup with thin walls, a bottle, a stone with bumps: 7 to 26 cm. Made when it is first asked for.
const std::vector<FineShape>& fine_shapes();

}  // namespace prescene::tests
