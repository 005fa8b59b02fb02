// SPDX-License-Identifier: Apache-2.0
// Scenes and beliefs as start distributions.
#include <algorithm>
#include <cmath>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/simulation/outcomes/start_distribution.h"

namespace prescene::simulation {
namespace {

/// Number of joint hypotheses, or nothing when there are more than `limit`.
bool at_most_joint_hypotheses(const belief::Belief& belief, std::size_t limit) {
  std::size_t count = 1;
  for (const belief::ObjectBelief& object : belief.objects) {
    count *= std::max<std::size_t>(1, object.particles.size());
    if (count > limit) return false;
  }
  return true;
}

/// The belief in which joint hypothesis `index` is certain; its weight goes to `weight`.
std::shared_ptr<const belief::Belief> joint_hypothesis(const belief::Belief& belief, std::size_t index,
                                                       double* weight) {
  auto one = std::make_shared<belief::Belief>(belief);
  *weight = 1.0;
  for (belief::ObjectBelief& object : one->objects) {
    if (object.particles.empty()) continue;
    belief::Particle chosen = object.particles[index % object.particles.size()];
    index /= object.particles.size();
    *weight *= std::exp(chosen.log_weight);
    chosen.log_weight = 0.0;
    object.particles.assign(1, chosen);
  }
  return one;
}

StartComponent component_of(std::shared_ptr<const belief::Belief> belief, double weight) {
  const auto sampler = std::make_shared<const belief::BeliefSampler>(*belief);
  return {weight, sampler->dimensions(),
          [belief = std::move(belief), sampler](std::span<const double> uniforms) { return sampler->draw(uniforms); }};
}

}  // namespace

StartDistribution start_of(std::shared_ptr<const belief::Scene> scene) {
  const int dimensions = belief::start_dimensions(*scene);
  StartDistribution starts;
  starts.components.push_back({1.0, dimensions, [scene = std::move(scene)](std::span<const double> uniforms) {
                                 return belief::draw_start(*scene, uniforms);
                               }});
  return starts;
}

StartDistribution start_of(std::shared_ptr<const belief::Belief> belief, int max_components) {
  StartDistribution starts;
  if (!at_most_joint_hypotheses(*belief, static_cast<std::size_t>(std::max(1, max_components)))) {
    starts.components.push_back(component_of(std::move(belief), 1.0));
    return starts;
  }
  std::size_t count = 1;
  for (const belief::ObjectBelief& object : belief->objects) count *= std::max<std::size_t>(1, object.particles.size());
  for (std::size_t i = 0; i < count; ++i) {
    double weight = 0.0;
    std::shared_ptr<const belief::Belief> one = joint_hypothesis(*belief, i, &weight);
    if (weight > 0.0) starts.components.push_back(component_of(std::move(one), weight));
  }
  PRESCENE_CHECK_MSG(!starts.components.empty(), "no joint hypothesis of the belief has weight");
  return starts;
}

}  // namespace prescene::simulation
