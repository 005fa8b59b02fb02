// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/start_distribution.h"

#include <algorithm>

namespace prescene::simulation {

const StartComponent& StartDistribution::chosen_by(double uniform) const {
  double all = 0.0, reached = 0.0;
  for (const StartComponent& component : components) all += component.weight;
  for (const StartComponent& component : components)
    if ((reached += component.weight) / all > uniform) return component;
  return components.back();
}

StartSampler::StartSampler(const StartComponent& component, std::uint64_t seed)
    : component_(&component),
      net_(std::clamp(component.dimensions, 1, core::SobolNet::kMaxDimensions), seed),
      padding_(seed, core::Purpose::kStartBelief) {}

belief::WorldState StartSampler::draw(std::uint32_t index) const { return component_->draw(uniforms(index)); }

std::vector<double> StartSampler::uniforms(std::uint32_t index) const {
  std::vector<double> uniforms(static_cast<std::size_t>(component_->dimensions));
  const std::size_t netted = std::min(uniforms.size(), static_cast<std::size_t>(net_.dimensions()));
  if (netted > 0) net_.point(index, std::span(uniforms).first(netted));
  core::RandomStream stream = padding_.at(index);
  for (std::size_t i = netted; i < uniforms.size(); ++i) uniforms[i] = stream.uniform();
  return uniforms;
}

std::vector<StartSampler> samplers_of(const StartDistribution& starts, const core::RandomStream& stream) {
  core::RandomStream seeds = stream.for_purpose(core::Purpose::kSobolScramble);
  std::vector<StartSampler> samplers;
  for (const StartComponent& component : starts.components) samplers.emplace_back(component, seeds.next_u64());
  return samplers;
}

}  // namespace prescene::simulation
