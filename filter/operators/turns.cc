// SPDX-License-Identifier: Apache-2.0
#include "turns.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/filter/operators/rivals.h"
#include "rival_search.h"

namespace prescene::filter {
namespace {

using belief::Particle;
using geometry::SymmetryGroup;

constexpr double kOpenLogOdds = -3.0;  // nats; a turn that is less likely was decided against: the prior counts

}  // namespace

std::vector<std::size_t> turns_of(const std::vector<Particle>& particles, const SymmetryGroup& symmetry,
                                  std::vector<Turn>& turns) {
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return particles[a].log_weight > particles[b].log_weight; });
  std::vector<std::size_t> turn_of(particles.size(), 0);
  for (const std::size_t i : order) {
    const auto found = std::find_if(turns.begin(), turns.end(), [&](const Turn& turn) {
      return !is_apart(particles[i].X_WO, particles[turn.leader].X_WO, symmetry);
    });
    turn_of[i] = static_cast<std::size_t>(found - turns.begin());
    if (found == turns.end()) turns.push_back({i});
  }
  return turn_of;
}

void share_among_turns(std::span<const double> log_weights_before, const SymmetryGroup& symmetry,
                       std::vector<Particle>& particles, int cameras, double turned_log_odds, double memory) {
  if (symmetry.ball || log_weights_before.size() != particles.size()) return;
  std::vector<Turn> turns;
  const std::vector<std::size_t> turn_of = turns_of(particles, symmetry, turns);
  if (turns.size() < 2) return;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    Turn& turn = turns[turn_of[i]];
    turn.log_before = log_sum(turn.log_before, log_weights_before[i]);
    turn.log_after = log_sum(turn.log_after, particles[i].log_weight);
  }
  double log_leading = -std::numeric_limits<double>::infinity();
  for (const Turn& turn : turns) log_leading = std::max(log_leading, turn.log_before);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Turn& turn = turns[turn_of[i]];
    if (!std::isfinite(turn.log_before) || !std::isfinite(turn.log_after)) continue;
    const double frame = cameras * (turn.log_after - turn.log_before);
    const double prior = turn.log_before < log_leading + kOpenLogOdds ? turned_log_odds : 0.0;
    const double shared = log_leading + (1.0 - memory) * (turn.log_before - log_leading) + memory * (prior + frame);
    particles[i].log_weight += shared - turn.log_after;
  }
  belief::normalize(particles);
}

bool holds_turns(const std::vector<Particle>& particles, const SymmetryGroup& symmetry) {
  if (symmetry.ball || particles.empty()) return false;
  const Particle& best = belief::heaviest(particles);
  double others = -std::numeric_limits<double>::infinity();
  for (const Particle& particle : particles)
    if (is_apart(particle.X_WO, best.X_WO, symmetry)) others = log_sum(others, particle.log_weight);
  return others > kSlipLogOdds;
}

std::vector<std::size_t> turn_numbers(const std::vector<Particle>& particles, const SymmetryGroup& symmetry) {
  std::vector<Turn> turns;
  return symmetry.ball ? std::vector<std::size_t>(particles.size(), 0) : turns_of(particles, symmetry, turns);
}

bool resample_within_turns(const ResampleOptions& options, const core::RandomStream& stream,
                           const SymmetryGroup& symmetry, std::vector<Particle>& particles) {
  std::vector<Turn> turns;
  const std::vector<std::size_t> turn_before = turns_of(particles, symmetry, turns);
  if (symmetry.ball || turns.size() < 2) return resample(options, stream, particles);
  const std::vector<Particle> before = particles;
  for (std::size_t i = 0; i < before.size(); ++i) {
    Turn& turn = turns[turn_before[i]];
    turn.log_before = log_sum(turn.log_before, before[i].log_weight);
  }
  if (!resample(options, stream, particles)) return false;
  std::vector<std::vector<std::size_t>> members(turns.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    std::size_t turn = 0;
    while (turn + 1 < turns.size() && is_apart(particles[i].X_WO, before[turns[turn].leader].X_WO, symmetry)) ++turn;
    members[turn].push_back(i);
  }
  for (std::size_t turn = 0; turn < turns.size(); ++turn) {
    if (!members[turn].empty() || !(turns[turn].log_before > kSlipLogOdds)) continue;
    const auto richest = std::max_element(members.begin(), members.end(),
                                          [](const auto& a, const auto& b) { return a.size() < b.size(); });
    if (richest->size() < 2) break;
    members[turn].push_back(richest->back());
    richest->pop_back();
    particles[members[turn].front()] = before[turns[turn].leader];
  }
  for (std::size_t turn = 0; turn < turns.size(); ++turn)
    for (const std::size_t i : members[turn])
      particles[i].log_weight = turns[turn].log_before - std::log(static_cast<double>(members[turn].size()));
  belief::normalize(particles);
  return true;
}

}  // namespace prescene::filter
