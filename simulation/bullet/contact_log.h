// SPDX-License-Identifier: Apache-2.0
// Contact intervals of a run from the touching pairs of its steps.
#pragma once

#include <utility>
#include <vector>

#include "instance_world.h"
#include "prescene/belief/trajectory.h"

namespace prescene::simulation {

class ContactLog {
 public:
  void reset() {
    open_.clear();
    closed_.clear();
  }
  /// The touches of the step from `begin` to `end`; contacts that part for less than `merge_time` go on.
  void note(const std::vector<Touch>& touches, double begin, double end, double merge_time);
  /// All intervals, ordered.
  void finish(std::vector<belief::ContactInterval>& contacts);

 private:
  std::vector<belief::ContactInterval> open_;
  std::vector<belief::ContactInterval> closed_;
};

}  // namespace prescene::simulation
