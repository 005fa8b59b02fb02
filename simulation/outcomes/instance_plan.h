// SPDX-License-Identifier: Apache-2.0
// In which order the points of the components' nets are run.
#pragma once

#include <cstdint>
#include <vector>

namespace prescene::simulation {

struct PlannedInstance {
  int component = 0;
  std::uint32_t point = 0;
};

/// The order is a function of the weights alone, so that any prefix of it can be run again. Within a stage the
/// components take turns in proportion to what they add.
class InstancePlan {
 public:
  /// Weights are positive.
  explicit InstancePlan(const std::vector<double>& weights);

  const std::vector<PlannedInstance>& order() const { return order_; }
  /// The first point of each component, instead of stages: where nothing varies.
  void once();
  /// Appends the next stage of growth.
  void grow();

 private:
  std::vector<double> shares_;
  std::vector<std::uint32_t> sizes_;
  std::vector<PlannedInstance> order_;
  int nominal_ = 0;
};

}  // namespace prescene::simulation
