// SPDX-License-Identifier: Apache-2.0
// Whether an instance is at rest: everything has been calm for the rest rule's time, nothing merely balances, and what
// stands firmly does not creep down a slope.
//
// Balance is tested twice. An object that only fixed bodies touch is stable when the vertical through its centre of
// mass passes inside the polygon of its contacts, a nudge's reach or more from every side. All others (balanced on an
// edge or tip, round, leaning, stacked) are nudged: in a copy of the instance each is turned by a small angle about
// horizontal axes in turn, and a short simulation shows whether it comes back (or merely rolls), or turns away and
// sinks.
#pragma once

#include <vector>

#include "instance_world.h"
#include "prescene/core/progress.h"

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
};

}  // namespace prescene::simulation
