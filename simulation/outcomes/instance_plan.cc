// SPDX-License-Identifier: Apache-2.0
#include "instance_plan.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {
namespace {

/// Fewest points of a component, so that a rare one is looked at too.
constexpr std::uint32_t kMinPoints = 8;

/// The number 2^j or 3 2^j nearest in ratio to `wanted`, at least kMinPoints: sizes at which nets are even.
std::uint32_t even_size(double wanted) {
  std::uint32_t size = kMinPoints;
  for (;;) {
    const bool power_of_two = (size & (size - 1)) == 0;
    const std::uint32_t next = power_of_two ? size / 2 * 3 : size / 3 * 4;
    if (static_cast<double>(size) * static_cast<double>(next) > wanted * wanted) return size;
    size = next;
  }
}

}  // namespace

int next_net_size(int count) {
  std::int64_t size = 64;  // wider than the result, so that it passes every count
  bool power_of_two = true;
  while (size <= count) {
    size = power_of_two ? size / 2 * 3 : size / 3 * 4;
    power_of_two = !power_of_two;
  }
  return static_cast<int>(std::min<std::int64_t>(size, std::numeric_limits<int>::max()));
}

InstancePlan::InstancePlan(const std::vector<double>& weights) : shares_(weights), sizes_(weights.size(), 0) {
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& share : shares_) share /= sum;
}

void InstancePlan::once() {
  order_.clear();
  for (std::size_t k = 0; k < shares_.size(); ++k) order_.push_back({static_cast<int>(k), 0});
}

void InstancePlan::grow() {
  nominal_ = next_net_size(nominal_);
  struct Turn {
    double when;
    PlannedInstance instance;
  };
  std::vector<Turn> turns;
  for (std::size_t k = 0; k < shares_.size(); ++k) {
    const std::uint32_t size = shares_.size() == 1 ? static_cast<std::uint32_t>(nominal_)
                                                   : std::max(sizes_[k], even_size(shares_[k] * nominal_));
    const double added = static_cast<double>(size - sizes_[k]);
    for (std::uint32_t i = sizes_[k]; i < size; ++i)
      turns.push_back({(static_cast<double>(i - sizes_[k]) + 0.5) / added, {static_cast<int>(k), i}});
    sizes_[k] = size;
  }
  std::sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) {
    if (a.when != b.when) return a.when < b.when;
    if (a.instance.component != b.instance.component) return a.instance.component < b.instance.component;
    return a.instance.point < b.instance.point;
  });
  for (const Turn& turn : turns) order_.push_back(turn.instance);
}

}  // namespace prescene::simulation
