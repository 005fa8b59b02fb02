// SPDX-License-Identifier: Apache-2.0
// Whether an instance is at rest: everything has been calm for the rest rule's time, and stays so by the tests of
// simulation/rules/rest.h.
#pragma once

#include <vector>

#include "instance_world.h"
#include "prescene/core/progress.h"
#include "prescene/geometry/polygon.h"

namespace prescene::simulation {

class RestDetector {
 public:
  /// Calm, no action to come, and nothing balances. The costly test runs once for each calm: its answer holds until
  /// something moves again. False, untested, once cancelled: the tests of many objects take longer than their fall.
  bool at_rest(InstanceWorld& world, const core::Cancellation* cancellation = nullptr);
  void reset() { tested_ = false; }

 private:
  bool stands_firmly(InstanceWorld& world, int object);
  bool returns_after_nudges(InstanceWorld& world, int object, const core::Cancellation* cancellation);

  struct Before {
    Quaterniond rotation;
    Vector3d center_of_mass;
    double height;  // of the centre of mass above the lowest contact
  };

  bool tested_ = false;
  bool stable_ = false;
  std::vector<std::uint8_t> saved_;
  std::vector<Before> before_;
  std::vector<geometry::Vector2d> points_, corners_;
};

}  // namespace prescene::simulation
