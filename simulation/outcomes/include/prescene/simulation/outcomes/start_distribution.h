// SPDX-License-Identifier: Apache-2.0
// Where instances start: a mixture of components, each a map from the unit cube to world states.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/core/random.h"
#include "prescene/core/sobol.h"

namespace prescene::simulation {

/// A part of a start distribution.
struct StartComponent {
  double weight = 1.0;  ///< > 0; need not be normalised.
  int dimensions = 0;   ///< Uniform numbers that a draw takes, the most decisive first; may be 0.
  /// Pure; called from several threads.
  std::function<belief::WorldState(std::span<const double>)> draw;
};

struct StartDistribution {
  std::vector<StartComponent> components;  ///< At least one.

  /// The component that a uniform number in [0, 1) chooses: each by its share of all weight, in their order.
  const StartComponent& chosen_by(double uniform) const;
};

/// The priors of a scene: one component.
StartDistribution start_of(std::shared_ptr<const belief::Scene> scene);

/// A belief. When it is a choice between few joint hypotheses (the product of the objects' numbers of particles is at
/// most `max_components`), each is a component, so that a rare one gets its instances too; otherwise one component in
/// which a coordinate of the net chooses the particle.
StartDistribution start_of(std::shared_ptr<const belief::Belief> belief, int max_components = 8);

/// Draws the points of one component's net.
class StartSampler {
 public:
  /// `component` must outlive the sampler.
  StartSampler(const StartComponent& component, std::uint64_t seed);
  /// The start at point `index` of the net. Coordinates beyond core::SobolNet::kMaxDimensions are plain random numbers.
  belief::WorldState draw(std::uint32_t index) const;
  /// The uniform numbers of that point: component.draw(uniforms(i)) is draw(i).
  std::vector<double> uniforms(std::uint32_t index) const;

 private:
  const StartComponent* component_;
  core::SobolNet net_;
  core::RandomStream padding_;
};

/// One sampler a component, with the nets that an estimate with this stream uses. `starts` must outlive them.
std::vector<StartSampler> samplers_of(const StartDistribution& starts, const core::RandomStream& stream);

}  // namespace prescene::simulation
