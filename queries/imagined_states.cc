// SPDX-License-Identifier: Apache-2.0
#include "imagined_states.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace prescene::queries {
namespace {

using belief::Pose;
using belief::ViewAbout;
using geometry::Vector3d;

// As alternatives of `where` (prescene/belief/alternative_poses.h).
constexpr double kOnePlaceRadius = 0.05, kOneTurnAngle = 0.5236, kLeastShare = 0.01;
// Twice those of `where`. Hypotheses share the draws: the more there are, the fewer circumstances weigh each image.
constexpr std::size_t kMostPlaces = 8;
// A standard error from so few is itself right within about 27 % (1 / sqrt(2 (n - 1))), and each image is weighed with
// seven others. With 2, an image is weighed by one other circumstance, which is hardly ever near.
constexpr std::size_t kFewestCircumstances = 8;

struct StateDraw {
  belief::WorldState state;
  double weight = 0.0;
};

/// Each component of the start has its share of the draws.
std::vector<StateDraw> draw_states(const Prior& prior, int count) {
  std::vector<StateDraw> draws;
  double all = 0.0;
  for (const simulation::StartComponent& component : prior.starts.components) all += component.weight;
  const std::vector<simulation::StartSampler> samplers = simulation::samplers_of(prior.starts, prior.stream);
  for (std::size_t c = 0; c < samplers.size(); ++c) {
    const double share = prior.starts.components[c].weight / all;
    const auto own = static_cast<std::uint32_t>(std::max(1L, std::lround(share * count)));
    for (std::uint32_t i = 0; i < own; ++i) draws.push_back({samplers[c].draw(i), share / own});
  }
  return draws;
}

/// A turn and a shift along the axes of W.
struct Offset {
  Vector3d turn = Vector3d::Zero(), shift = Vector3d::Zero();
};
Pose moved_by(const Pose& X, const Offset& off) {
  return {(geometry::exp_rotation(off.turn) * X.rotation).normalized(), X.translation + off.shift};
}
Offset offset_between(const Pose& X, const Pose& X_from) {
  return {geometry::log_rotation(X.rotation * X_from.rotation.conjugate()), X.translation - X_from.translation};
}

struct WeightedPose {
  Pose X_WO;
  double weight = 0.0;
};

/// Poses that are about one, up to symmetry.
struct Place {
  Pose X_WO;  ///< Their mean.
  double weight = 0.0;
};

/// The heaviest first; weights sum to 1.
std::vector<Place> places_of(std::vector<WeightedPose> poses, const geometry::SymmetryGroup& symmetry) {
  struct Group {
    Pose X_leader;
    double weight = 0.0;
    Offset sum;  // weighted, from the leader
  };
  std::ranges::stable_sort(poses, std::ranges::greater(), &WeightedPose::weight);
  std::vector<Group> groups;
  for (const WeightedPose& pose : poses) {
    Group* found = nullptr;
    Offset off;
    for (Group& group : groups) {
      off = offset_between(geometry::closest_equivalent(pose.X_WO, group.X_leader, symmetry), group.X_leader);
      if (off.shift.norm() > kOnePlaceRadius || off.turn.norm() > kOneTurnAngle) continue;
      found = &group;
      break;
    }
    if (found == nullptr) {
      found = &groups.emplace_back(Group{pose.X_WO, 0.0, {}});
      off = {};
    }
    found->weight += pose.weight;
    found->sum.turn += pose.weight * off.turn;
    found->sum.shift += pose.weight * off.shift;
  }
  std::ranges::stable_sort(groups, std::ranges::greater(), &Group::weight);
  while (groups.size() > 1 && (groups.size() > kMostPlaces || groups.back().weight < kLeastShare)) groups.pop_back();
  double all = 0.0;
  for (const Group& group : groups) all += group.weight;
  std::vector<Place> places;
  for (const Group& group : groups)
    places.push_back({moved_by(group.X_leader, {group.sum.turn / group.weight, group.sum.shift / group.weight}),
                      group.weight / all});
  return places;
}

/// By how much each draw is off the place that it is nearest to; the mean over the draws of a place is 0.
std::vector<Offset> offsets_from(const std::vector<Place>& places, const std::vector<StateDraw>& draws,
                                 std::size_t object, const geometry::SymmetryGroup& symmetry) {
  std::vector<Offset> offsets;
  std::vector<std::size_t> place_of;
  std::vector<Offset> sums(places.size());
  std::vector<double> weights(places.size(), 0.0);
  for (const StateDraw& draw : draws) {
    const Pose& X_WO = draw.state.objects[object].X_WO;
    double least = std::numeric_limits<double>::infinity();
    Offset nearest;
    std::size_t at = 0;
    for (std::size_t p = 0; p < places.size(); ++p) {
      const Offset off = offset_between(geometry::closest_equivalent(X_WO, places[p].X_WO, symmetry), places[p].X_WO);
      const double distance = off.shift.norm() / kOnePlaceRadius + off.turn.norm() / kOneTurnAngle;
      if (distance >= least) continue;
      least = distance;
      nearest = off;
      at = p;
    }
    offsets.push_back(nearest);
    place_of.push_back(at);
    sums[at].turn += draw.weight * nearest.turn;
    sums[at].shift += draw.weight * nearest.shift;
    weights[at] += draw.weight;
  }
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::size_t at = place_of[i];
    offsets[i].turn -= sums[at].turn / weights[at];
    offsets[i].shift -= sums[at].shift / weights[at];
  }
  return offsets;
}

/// So many of the draws, equally likely, spread over all of them.
std::vector<std::size_t> thinned(const std::vector<StateDraw>& draws, std::size_t count) {
  std::vector<std::size_t> chosen;
  double sum = 0.0;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    sum += draws[i].weight;
    while (chosen.size() < count && (static_cast<double>(chosen.size()) + 0.5) / static_cast<double>(count) <= sum)
      chosen.push_back(i);
  }
  while (chosen.size() < count) chosen.push_back(draws.size() - 1);
  return chosen;
}

}  // namespace

Imagining imagine(const Prior& prior, std::size_t object, const belief::NextViewQuery& query,
                  std::span<const belief::Particle> particles) {
  const std::vector<StateDraw> draws = draw_states(prior, query.draws);
  const auto asked = static_cast<std::size_t>(query.draws);
  Imagining result;
  if (query.about == ViewAbout::kPose) {
    for (const StateDraw& draw : draws) {
      result.add(draw.state.objects[object].X_WO, draw.weight);
      Imagined& one = result.states.emplace_back(Imagined{prior.likeliest, {}});
      one.state.objects[object] = draw.state.objects[object];
      one.is_there.assign(prior.existence.size(), 1);
    }
    return result;
  }
  const geometry::SymmetryGroup& symmetry = prior.scene->model_of(prior.scene->objects[object]).symmetry;
  // Means of particles are known exactly, those of draws are not: their noise would tell places apart that look alike.
  std::vector<WeightedPose> poses;
  for (const belief::Particle& particle : particles) poses.push_back({particle.X_WO, std::exp(particle.log_weight)});
  if (poses.empty())
    for (const StateDraw& draw : draws) poses.push_back({draw.state.objects[object].X_WO, draw.weight});
  const std::vector<Place> places = places_of(std::move(poses), symmetry);
  const bool of_existence = query.about == ViewAbout::kExistence;
  if (of_existence) {
    result.add(places.front().X_WO, prior.existence[object]);
    result.add(std::nullopt, 1.0 - prior.existence[object]);
  } else {
    for (const Place& place : places) result.add(place.X_WO, place.weight);
  }
  result.circumstances = std::max(kFewestCircumstances, asked / result.hypotheses.size());
  const std::vector<std::size_t> chosen = thinned(draws, result.circumstances);
  const std::vector<Offset> offsets = offsets_from(places, draws, object, symmetry);
  for (std::size_t h = 0; h < result.hypotheses.size(); ++h) {
    for (std::size_t j = 0; j < chosen.size(); ++j) {
      core::RandomStream chance = prior.stream.for_purpose(core::Purpose::kScenario).at(j);
      Imagined& one = result.states.emplace_back(Imagined{draws[chosen[j]].state, {}});
      for (const double existence : prior.existence) one.is_there.push_back(chance.uniform() < existence ? 1 : 0);
      one.is_there[object] = result.hypotheses[h].X_WO ? 1 : 0;
      // Where it is, if it is there, belongs to the circumstances of its existence.
      if (!of_existence) one.state.objects[object].X_WO = moved_by(*result.hypotheses[h].X_WO, offsets[chosen[j]]);
    }
  }
  return result;
}

}  // namespace prescene::queries
