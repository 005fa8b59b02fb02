// SPDX-License-Identifier: Apache-2.0
// Who touches whom: how probably, when and how hard.
#include <algorithm>
#include <cmath>
#include <map>

#include "contact_forecast.h"
#include "prescene/belief/body_names.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kMostPairs = 40;
constexpr int kTimes = 51;
constexpr std::size_t kBetweenLooks = 256;  // instances, at whether it is stopped

/// A value of each instance that touches, with its weight.
using Weighted = std::vector<std::pair<double, double>>;

double quantile(Weighted& values, double share) {
  std::sort(values.begin(), values.end());
  double sum = 0.0, below = 0.0;
  for (const auto& [value, weight] : values) sum += weight;
  for (const auto& [value, weight] : values) {
    below += weight;
    if (below >= share * sum) return value;
  }
  return values.empty() ? 0.0 : values.back().first;
}

struct Pair {
  std::vector<int> touched;  ///< 0 = it does, of each instance that did not fail; 1 = it does not.
  Weighted first, impulse;
  std::vector<double> touching = std::vector<double>(kTimes, 0.0);
};

}  // namespace

bool forecast_contacts(const Foresight& foresight, double confidence, const core::Cancellation* abandoned,
                       belief::PredictAnswer& answer) {
  const std::vector<simulation::InstanceRecord>& instances = foresight.estimate.instances;
  double longest = 0.0, mass = 0.0;
  for (const simulation::InstanceRecord& record : instances) {
    if (record.failed) continue;
    longest = std::max(longest, record.simulated_seconds);
    mass += record.weight;
  }
  if (!(mass > 0.0)) return true;
  const auto stopped = [&] {
    if (!abandoned || !abandoned->requested()) return false;
    answer.contact_times.clear();
    answer.contacts.clear();
    return true;
  };
  for (int i = 0; i < kTimes; ++i) answer.contact_times.push_back(longest * i / (kTimes - 1));

  std::map<std::pair<int, int>, Pair> pairs;
  for (std::size_t n = 0; n < instances.size(); ++n) {
    const simulation::InstanceRecord& record = instances[n];
    if (n % kBetweenLooks == 0 && stopped()) return false;
    if (record.failed) continue;
    const double start = record.final.time - record.simulated_seconds;
    std::map<std::pair<int, int>, std::vector<const belief::ContactInterval*>> touches;
    for (const belief::ContactInterval& contact : record.contacts)
      touches[{contact.first, contact.second}].push_back(&contact);
    for (const auto& [key, intervals] : touches) {
      Pair& pair = pairs[key];
      pair.touched.resize(instances.size(), 1);
      pair.touched[n] = 0;
      pair.first.emplace_back(intervals.front()->begin - start, record.weight);
      double hardest = 0.0;
      for (const belief::ContactInterval* contact : intervals) hardest = std::max(hardest, contact->largest_impulse);
      pair.impulse.emplace_back(hardest, record.weight);
      for (int i = 0; i < kTimes; ++i) {
        const double time = start + answer.contact_times[static_cast<std::size_t>(i)];
        const bool touching =
            std::any_of(intervals.begin(), intervals.end(), [&](const belief::ContactInterval* contact) {
              // What touches at the end of a run goes on touching.
              return contact->begin <= time && (time <= contact->end || contact->end >= record.final.time);
            });
        if (touching) pair.touching[static_cast<std::size_t>(i)] += record.weight / mass;
      }
    }
  }
  std::map<int, double> component_weights;
  for (const simulation::InstanceRecord& record : instances) component_weights[record.component] += record.weight;
  for (auto& [key, pair] : pairs) {
    if (stopped()) return false;
    std::vector<simulation::ComponentClasses> components;
    std::map<int, std::size_t> index;
    for (const auto& [component, weight] : component_weights) {
      index[component] = components.size();
      components.push_back({weight, {}});
    }
    for (std::size_t n = 0; n < instances.size(); ++n)
      components[index[instances[n].component]].classes.push_back(instances[n].failed ? -1 : pair.touched[n]);
    const simulation::ClassEstimate touched = simulation::class_estimate(components, 0, confidence);
    belief::ContactForecast& contact = answer.contacts.emplace_back();
    contact.first = belief::body_name(*foresight.scene, key.first);
    contact.second = belief::body_name(*foresight.scene, key.second);
    contact.probability = touched.probability;
    contact.low = touched.low;
    contact.high = touched.high;
    contact.first_touch = {quantile(pair.first, 0.1), quantile(pair.first, 0.5), quantile(pair.first, 0.9)};
    contact.impulse = {quantile(pair.impulse, 0.05), quantile(pair.impulse, 0.5), quantile(pair.impulse, 0.95)};
    contact.touching = std::move(pair.touching);
  }
  std::stable_sort(
      answer.contacts.begin(), answer.contacts.end(),
      [](const belief::ContactForecast& a, const belief::ContactForecast& b) { return a.probability > b.probability; });
  if (answer.contacts.size() > kMostPairs) answer.contacts.resize(kMostPairs);
  return true;
}

}  // namespace prescene::queries
