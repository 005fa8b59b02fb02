// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "prescene/geometry/sampling.h"

int main() {
  prescene::core::RandomStream stream(1, prescene::core::Purpose::kTest);
  const auto direction = prescene::geometry::uniform_direction(stream);
  std::printf("a direction of length %.6f\n", direction.norm());
}
