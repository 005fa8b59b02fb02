// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/worlds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "falling_particles.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/core/check.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

using belief::Belief;
using belief::ObjectBelief;
using belief::Particle;
using collision::OverlapState;
using collision::RelativeUncertainty;
using collision::SphereTree;
using geometry::Vector3d;

constexpr double kTouchReach = 0.005;  // m; what is nearer touches as well as one knows
constexpr int kTouchSpheres = 300;     // that a model is filled with
constexpr double kFarOff = 4.0;        // standard deviations, for balls
constexpr double kLeastClass = -5.0;   // nats; worlds of this weight or more keep one of their kind

const belief::ObjectModel& model_at(const Belief& belief, std::size_t object) {
  return belief::model_of(belief, belief.objects[object]);
}

double log_sum_of(const std::vector<double>& values) {
  const double largest = *std::max_element(values.begin(), values.end());
  if (!std::isfinite(largest)) return largest;
  double sum = 0.0;
  for (const double value : values) sum += std::exp(value - largest);
  return largest + std::log(sum);
}

/// Groups of members whose weights are the same.
std::vector<Island> groups_in(const Belief& belief, const Island& island) {
  std::vector<Island> groups;
  for (const std::size_t member : island) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const Island& g) {
      return are_worlds(belief, {g.front(), member});
    });
    if (group != groups.end())
      group->push_back(member);
    else
      groups.push_back({member});
  }
  return groups;
}

/// For each world the number of its kind: worlds of one kind have every member turned alike.
std::vector<std::size_t> kinds_of(const Belief& belief, const Island& island) {
  std::vector<std::vector<std::size_t>> turns;
  for (const std::size_t member : island)
    turns.push_back(turn_numbers(belief.objects[member].particles, model_at(belief, member).symmetry));
  std::map<std::vector<std::size_t>, std::size_t> numbers;
  std::vector<std::size_t> kinds;
  for (std::size_t i = 0; i < turns.front().size(); ++i) {
    std::vector<std::size_t> kind;
    for (const auto& of_member : turns) kind.push_back(of_member[i]);
    kinds.push_back(numbers.try_emplace(kind, numbers.size()).first->second);
  }
  return kinds;
}

/// Scales the worlds' weights until each member's turns weigh what its own evidence says (iterative proportional
/// fitting [Deming and Stephan 1940]). A turn that few worlds have would else weigh what chance says of the other
/// members in those.
void fit_turns(const std::vector<std::vector<std::size_t>>& turns, const std::vector<std::vector<double>>& own,
               std::vector<double>& log_weights) {
  constexpr int kSweeps = 3;
  const auto sums_of = [](const std::vector<std::size_t>& turn_of, const std::vector<double>& logs) {
    std::vector<std::vector<double>> parts(1 + *std::max_element(turn_of.begin(), turn_of.end()));
    for (std::size_t i = 0; i < logs.size(); ++i) parts[turn_of[i]].push_back(logs[i]);
    std::vector<double> sums;
    for (const std::vector<double>& part : parts) sums.push_back(log_sum_of(part));
    return sums;
  };
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t m = 0; m < turns.size(); ++m) {
      const std::vector<double> wanted = sums_of(turns[m], own[m]), is = sums_of(turns[m], log_weights);
      for (std::size_t i = 0; i < log_weights.size(); ++i) {
        const double change = wanted[turns[m][i]] - is[turns[m][i]];
        if (std::isfinite(change)) log_weights[i] += change;
      }
    }
}

}  // namespace

struct TouchTest::Memory {
  std::map<belief::MeshPtr, std::shared_ptr<const SphereTree>> by_visual;
  std::map<std::uint64_t, std::shared_ptr<const SphereTree>> by_content;
  collision::UncertainScratch scratch;
};

TouchTest::TouchTest() : memory_(std::make_unique<Memory>()) {}
TouchTest::~TouchTest() = default;

const SphereTree* TouchTest::tree_of(const belief::ObjectModel& model, core::ThreadPool& threads) {
  if (model.visual) {
    const auto known = memory_->by_visual.find(model.visual);
    if (known != memory_->by_visual.end()) return known->second.get();
  }
  const belief::MeshPtr mesh =
      model.visual ? model.visual : std::make_shared<const geometry::TriangleMesh>(belief::collision_mesh(model));
  const auto [entry, is_new] = memory_->by_content.try_emplace(geometry::facts_of(mesh).content, nullptr);
  if (is_new) {
    const auto make = [&]() -> core::Result<std::shared_ptr<const SphereTree>> {
      PRESCENE_TRY(const auto checked, collision::Mesh::make(*mesh, model.name));
      collision::PackingOptions options;
      options.max_spheres = kTouchSpheres;
      options.close_holes = true;
      options.layouts = 1;
      PRESCENE_TRY(const collision::PackedMesh packed, collision::pack_spheres(*checked, options, threads));
      return SphereTree::make(packed.packing, {}, threads);
    };
    if (const auto tree = make()) entry->second = *tree;
  }
  if (model.visual) memory_->by_visual.emplace(model.visual, entry->second);
  return entry->second.get();
}

bool TouchTest::may_touch(const Belief& belief, std::size_t a, std::size_t b, double reach, core::ThreadPool& threads) {
  const std::array<std::size_t, 2> objects = {a, b};
  std::array<collision::UncertainPose, 2> poses;
  std::array<Vector3d, 2> centres;
  double apart = reach;
  for (std::size_t i = 0; i < 2; ++i) {
    const ObjectBelief& object = belief.objects[objects[i]];
    const belief::ObjectEstimate estimate = belief::estimate(belief, object);
    poses[i] = {estimate.mean, estimate.covariance.topLeftCorner<6, 6>()};
    centres[i] = estimate.mean * centre_of(*belief.scene, object);
    apart += radius_of(*belief.scene, object) +
             kFarOff * std::sqrt(std::max(0.0, poses[i].covariance.bottomRightCorner<3, 3>().trace()));
  }
  if ((centres[0] - centres[1]).norm() > apart) return false;
  const std::array<const SphereTree*, 2> trees = {tree_of(model_at(belief, a), threads),
                                                  tree_of(model_at(belief, b), threads)};
  if (trees[0] == nullptr || trees[1] == nullptr) return true;
  // Spheres leave corners out, and within `reach` is near enough: as if places were known that much less well.
  auto between = RelativeUncertainty::make(poses[0], poses[1]);
  if (!between) return true;
  const double deviation = reach / between->region_radius();
  poses[0].covariance.diagonal().tail<3>().array() += deviation * deviation;
  between = RelativeUncertainty::make(poses[0], poses[1]);
  return !between || overlap_state(*trees[0], *trees[1], *between, memory_->scratch) != OverlapState::kNone;
}

bool may_change(const Belief& belief, std::size_t object, double least_change) {
  const std::vector<Particle>& particles = belief.objects[object].particles;
  const Particle& best = belief::heaviest(particles);
  const geometry::SymmetryGroup& symmetry = model_at(belief, object).symmetry;
  double moves = 0.0, turned = 0.0;
  for (const Particle& particle : particles) {
    const double weight = std::exp(particle.log_weight);
    if (particle.mode != belief::MotionMode::kResting) moves += weight;
    if (geometry::symmetric_angle(particle.X_WO, best.X_WO, symmetry) >= kRivalTurn) turned += weight;
  }
  return std::max(moves, turned) >= least_change;
}

std::vector<Island> islands_that_change(const Belief& belief, double dt, const WorldsOptions& options, TouchTest& touch,
                                        core::ThreadPool& threads) {
  const std::size_t count = belief.objects.size();
  std::vector<bool> changes(count, false);
  for (std::size_t i = 0; i < count; ++i)
    changes[i] = is_present(belief.objects[i]) && may_change(belief, i, options.least_change);
  std::vector<Island> islands;
  if (std::none_of(changes.begin(), changes.end(), [](bool change) { return change; })) return islands;
  std::vector<std::size_t> number(count);
  std::iota(number.begin(), number.end(), std::size_t{0});
  const auto size_of = [&](std::size_t n) { return std::count(number.begin(), number.end(), n); };
  // From what changes outwards: what touches nothing that does is as it was.
  std::vector<std::size_t> reached;
  for (std::size_t i = 0; i < count; ++i)
    if (changes[i]) reached.push_back(i);
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const std::size_t a = reached[next];
    for (std::size_t b = 0; b < count; ++b) {
      if (number[a] == number[b] || !is_present(belief.objects[b]) ||
          belief.objects[a].particles.size() != belief.objects[b].particles.size() ||
          size_of(number[a]) + size_of(number[b]) > options.most_members)
        continue;
      const double speed = belief::heaviest(belief.objects[a].particles).V_WO.linear.norm() +
                           belief::heaviest(belief.objects[b].particles).V_WO.linear.norm();
      if (!touch.may_touch(belief, a, b, kTouchReach + speed * dt, threads)) continue;
      const std::size_t low = std::min(number[a], number[b]), high = std::max(number[a], number[b]);
      std::replace(number.begin(), number.end(), high, low);
      if (std::find(reached.begin(), reached.end(), b) == reached.end()) reached.push_back(b);
    }
  }
  for (std::size_t n = 0; n < count; ++n) {
    Island island;
    for (std::size_t i = 0; i < count; ++i)
      if (number[i] == n) island.push_back(i);
    if (island.size() > 1) islands.push_back(std::move(island));
  }
  return islands;
}

bool are_worlds(const Belief& belief, const Island& island) {
  const std::vector<Particle>& first = belief.objects[island.front()].particles;
  return std::all_of(island.begin(), island.end(), [&](std::size_t member) {
    const std::vector<Particle>& particles = belief.objects[member].particles;
    return std::equal(first.begin(), first.end(), particles.begin(), particles.end(),
                      [](const Particle& a, const Particle& b) { return a.log_weight == b.log_weight; });
  });
}

std::vector<double> world_weights(const Belief& belief, const Island& island) {
  std::vector<double> weights;
  for (const Particle& particle : belief.objects[island.front()].particles) weights.push_back(particle.log_weight);
  return weights;
}

bool combine_weights(const Island& island, const std::vector<double>& before, Belief& belief) {
  std::vector<double> after = before;
  std::vector<std::vector<std::size_t>> turns;
  std::vector<std::vector<double>> own;
  for (const std::size_t member : island) {
    const std::vector<Particle>& particles = belief.objects[member].particles;
    PRESCENE_CHECK(particles.size() == before.size());
    turns.push_back(turn_numbers(particles, model_at(belief, member).symmetry));
    own.push_back(world_weights(belief, {member}));
    // What had no weight keeps none, whatever is said of it.
    for (std::size_t i = 0; i < after.size(); ++i)
      after[i] = std::isfinite(before[i]) ? after[i] + (particles[i].log_weight - before[i]) : before[i];
  }
  fit_turns(turns, own, after);
  bool possible = true;
  for (const std::size_t member : island) {
    std::vector<Particle>& particles = belief.objects[member].particles;
    for (std::size_t i = 0; i < after.size(); ++i) particles[i].log_weight = after[i];
    possible = belief::normalize(particles);
  }
  return possible;
}

bool resample_worlds(const Island& island, const ResampleOptions& options, const core::RandomStream& stream,
                     Belief& belief) {
  const std::vector<double> before = world_weights(belief, island);
  const std::vector<std::size_t> kinds = kinds_of(belief, island);
  std::vector<std::size_t> sources;
  std::vector<Particle> leader = belief.objects[island.front()].particles;
  const bool resampled = resample(options, stream, leader, &sources);
  std::vector<double> log_weights;
  for (const Particle& particle : leader) log_weights.push_back(particle.log_weight);
  if (resampled) {
    const std::size_t count = *std::max_element(kinds.begin(), kinds.end()) + 1;
    std::vector<std::vector<double>> weights(count);
    std::vector<std::size_t> heaviest(count, kinds.size());
    std::vector<std::vector<std::size_t>> members(count);
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      weights[kinds[i]].push_back(before[i]);
      std::size_t& best = heaviest[kinds[i]];
      if (best == kinds.size() || before[i] > before[best]) best = i;
    }
    for (std::size_t i = 0; i < sources.size(); ++i) members[kinds[sources[i]]].push_back(i);
    for (std::size_t kind = 0; kind < count; ++kind) {
      if (!members[kind].empty() || !(log_sum_of(weights[kind]) > kLeastClass)) continue;
      const auto richest = std::max_element(members.begin(), members.end(),
                                            [](const auto& a, const auto& b) { return a.size() < b.size(); });
      if (richest->size() < 2) break;
      members[kind].push_back(richest->back());
      sources[richest->back()] = heaviest[kind];
      richest->pop_back();
    }
    for (std::size_t kind = 0; kind < count; ++kind)
      for (const std::size_t i : members[kind])
        log_weights[i] = log_sum_of(weights[kind]) - std::log(static_cast<double>(members[kind].size()));
  }
  for (const std::size_t member : island) {
    std::vector<Particle>& particles = belief.objects[member].particles;
    copy_from(options,
              stream.for_purpose(core::Purpose::kProcessNoise).at(belief.step, static_cast<std::uint32_t>(member)),
              sources, particles);
    for (std::size_t i = 0; i < particles.size(); ++i) particles[i].log_weight = log_weights[i];
    belief::normalize(particles);
  }
  return resampled;
}

bool join_worlds(const Island& island, const ResampleOptions& options, const core::RandomStream& stream,
                 Belief& belief) {
  const std::vector<Island> groups = groups_in(belief, island);
  if (groups.size() < 2) return false;
  ResampleOptions always = options;
  always.min_effective_share = 2.0;
  std::vector<double> product(belief.objects[island.front()].particles.size(), 0.0);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const core::RandomStream mine = stream.at(belief.step, static_cast<std::uint32_t>(groups[g].front()));
    resample_worlds(groups[g], always, mine, belief);
    // Which meets which is chance, but that the likeliest meet, which are first.
    if (g > 0) {
      core::RandomStream draws = mine.for_purpose(core::Purpose::kProposal);
      for (std::size_t i = product.size() - 1; i > 1; --i) {
        const std::size_t j = 1 + draws.uniform_below(static_cast<std::uint32_t>(i));
        for (const std::size_t member : groups[g])
          std::swap(belief.objects[member].particles[i], belief.objects[member].particles[j]);
      }
    }
    const std::vector<double> weights = world_weights(belief, groups[g]);
    for (std::size_t i = 0; i < product.size(); ++i) product[i] += weights[i];
  }
  for (const std::size_t member : island) {
    std::vector<Particle>& particles = belief.objects[member].particles;
    for (std::size_t i = 0; i < product.size(); ++i) particles[i].log_weight = product[i];
    belief::normalize(particles);
  }
  return true;
}

}  // namespace prescene::filter
