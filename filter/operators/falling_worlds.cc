// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "falling_particles.h"
#include "prescene/core/check.h"

namespace prescene::filter {

using belief::ObjectBelief;
using belief::Particle;

void WorldsOfIsland::begin(std::size_t object, bool released, const ObjectBelief& now) {
  const auto place = static_cast<std::size_t>(std::find(members.begin(), members.end(), object) - members.begin());
  starts[place] = now.particles;
  apart = apart || released;
}

double WorldsOfIsland::shared_draw(std::size_t world, double own) {
  if (draws.size() <= world) draws.push_back(own);
  return draws[world];
}

void WorldsOfIsland::fall_together(belief::Belief& belief, std::vector<Falling>& falling) {
  if (apart) return;
  const std::size_t own = falling.size();
  for (const Falling& other : may_fall) {
    const bool simulated =
        std::any_of(falling.begin(), falling.begin() + static_cast<std::ptrdiff_t>(own), [&](const Falling& f) {
          return f.particle == other.particle && std::binary_search(members.begin(), members.end(), f.object);
        });
    if (!simulated) continue;
    const Particle& start = *start_of(other.object, other.particle);
    Particle& particle = belief.objects[other.object].particles[other.particle];
    particle.X_WO = start.X_WO;
    particle.V_WO = start.V_WO;
    falling.push_back(other);
  }
}

const Particle* WorldsOfIsland::start_of(std::size_t object, std::size_t world) const {
  const auto member = std::find(members.begin(), members.end(), object);
  return member == members.end() ? nullptr : &starts[static_cast<std::size_t>(member - members.begin())][world];
}

WorldsOfIsland* Worlds::of(std::size_t object) {
  for (WorldsOfIsland& island : islands)
    if (std::binary_search(island.members.begin(), island.members.end(), object)) return &island;
  return nullptr;
}

const WorldsOfIsland* Worlds::of(std::size_t object) const {
  for (const WorldsOfIsland& island : islands)
    if (std::binary_search(island.members.begin(), island.members.end(), object)) return &island;
  return nullptr;
}

Worlds worlds_of(const belief::Belief& belief, std::span<const Island> islands) {
  Worlds worlds;
  for (const Island& island : islands) {
    PRESCENE_CHECK(are_worlds(belief, island));
    WorldsOfIsland& of = worlds.islands.emplace_back();
    of.members = island;
    of.log_weights = world_weights(belief, island);
    of.starts.resize(island.size());
  }
  return worlds;
}

}  // namespace prescene::filter
