// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/local_runs.h"

#include <algorithm>
#include <numeric>

#include "prescene/simulation/own_actions.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Box;
using geometry::Vector3d;

constexpr double kReachFactor = 1.001;  // for rounding
constexpr double kApart = 0.01;         // m between boxes about things that are simulated without each other
constexpr int kMostParts = 4;           // larger and larger ones, of an instance; the last is everything
constexpr std::size_t kMostKept = 16;   // simulators that are kept for the next instances

bool are_near(const Box& a, const Box& b) {
  return (a.min().array() < b.max().array() + kApart).all() && (b.min().array() < a.max().array() + kApart).all();
}

}  // namespace

LocalRuns::LocalRuns(const belief::Scene& scene, std::span<const geometry::TriangleMesh> shapes,
                     const belief::WorldState& likeliest, const simulation::Simulator& whole,
                     const simulation::SimulatorFactory& make_simulator)
    : scene_(scene), shapes_(shapes), likeliest_(likeliest), whole_(whole), make_simulator_(make_simulator) {}

Box LocalRuns::box_of(std::size_t object, const Pose& X_WO) const {
  Box box;
  for (const Vector3d& vertex : shapes_[object].vertices) box.extend(X_WO * vertex);
  return box;
}

double LocalRuns::reach_of(std::size_t object) const {
  double reach = 0.0;
  for (const Vector3d& vertex : shapes_[object].vertices) reach = std::max(reach, vertex.norm());
  return kReachFactor * reach;
}

std::vector<std::size_t> LocalRuns::with_neighbours(std::vector<std::size_t> open) {
  const std::size_t n = scene_.objects.size();
  if (boxes_.empty())
    for (std::size_t i = 0; i < n; ++i) boxes_.push_back(box_of(i, likeliest_.objects[i].X_WO));
  // What is jointed is separated by no box: then all are simulated.
  std::vector<std::uint8_t> kept(n, scene_.joints.empty() ? 0 : 1);
  for (const std::size_t i : open) kept[i] = 1;
  // What it touches, what that touches, and so on.
  while (!open.empty()) {
    const std::size_t i = open.back();
    open.pop_back();
    for (std::size_t j = 0; j < n; ++j) {
      if (kept[j] != 0 || !are_near(boxes_[i], boxes_[j])) continue;
      kept[j] = 1;
      open.push_back(j);
    }
  }
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < n; ++i)
    // What a hand holds stays, so that the hand does.
    if (kept[i] != 0 || likeliest_.objects[i].mode == belief::MotionMode::kHeld) all.push_back(i);
  return all;
}

core::Result<const LocalRuns::Part*> LocalRuns::part_of(const std::vector<std::size_t>& kept) {
  if (parts_.size() >= kMostKept && !parts_.contains(kept)) parts_.clear();
  std::unique_ptr<Part>& known = parts_[kept];
  if (known) return known.get();
  auto part = std::make_unique<Part>();
  part->kept = kept;
  belief::Scene local = scene_;
  local.objects.clear();
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    if (std::binary_search(kept.begin(), kept.end(), i))
      local.objects.push_back(scene_.objects[i]);
    else
      part->left_out.push_back(i);
  }
  if (!part->left_out.empty()) {
    PRESCENE_TRY(part->simulator, make_simulator_(local, 1.0));
  }
  known = std::move(part);
  return known.get();
}

std::vector<std::size_t> LocalRuns::met_by(const Part& part, const belief::WorldState& start,
                                           const std::vector<belief::Action>& actions,
                                           const belief::Trajectory& local) const {
  std::vector<Box> lying;
  for (const std::size_t i : part.left_out) lying.push_back(box_of(i, start.objects[i].X_WO));
  std::vector<std::uint8_t> met(lying.size(), 0);
  const auto near_any = [&](const Box& box) {
    return std::any_of(lying.begin(), lying.end(), [&](const Box& other) { return are_near(box, other); });
  };
  const auto note = [&](const Box& box) {
    for (std::size_t i = 0; i < lying.size(); ++i)
      if (are_near(box, lying[i])) met[i] = 1;
  };
  for (const belief::Action& action : actions) {
    const auto* push = std::get_if<belief::Push>(&action.what);
    if (push == nullptr) continue;
    const Vector3d radius = Vector3d::Constant(push->radius);
    note({push->from.cwiseMin(push->to) - radius, push->from.cwiseMax(push->to) + radius});
  }
  for (std::size_t k = 0; k < part.kept.size(); ++k) {
    // Most are nowhere near: a box about the sphere that holds it says so, without a look at its vertices.
    const double reach = reach_of(part.kept[k]);
    const auto around = [&](const Pose& X_WO) {
      return Box(X_WO.translation - Vector3d::Constant(reach), X_WO.translation + Vector3d::Constant(reach));
    };
    const Pose* at = &local.states.front().objects[k].X_WO;
    for (const belief::WorldState& state : local.states) {
      const Pose& X_WO = state.objects[k].X_WO;
      if (X_WO == *at) continue;
      // What it swept since the state before, straight.
      if (near_any(around(*at).merged(around(X_WO))))
        note(box_of(part.kept[k], *at).merged(box_of(part.kept[k], X_WO)));
      at = &X_WO;
    }
  }
  std::vector<std::size_t> objects;
  for (std::size_t i = 0; i < lying.size(); ++i)
    if (met[i] != 0) objects.push_back(part.left_out[i]);
  return objects;
}

void LocalRuns::complete(const Part& part, const belief::WorldState& start, belief::Trajectory& trajectory) const {
  for (belief::WorldState& state : trajectory.states) {
    std::vector<belief::ObjectState> objects = start.objects;
    for (std::size_t k = 0; k < part.kept.size(); ++k) objects[part.kept[k]] = state.objects[k];
    state.objects = std::move(objects);
  }
  // Bodies are numbered objects first.
  const auto number = [&](int body) {
    const auto b = static_cast<std::size_t>(body);
    return b < part.kept.size() ? static_cast<int>(part.kept[b]) : body + static_cast<int>(part.left_out.size());
  };
  for (belief::ContactInterval& contact : trajectory.contacts)
    contact.first = number(contact.first), contact.second = number(contact.second);
  for (auto& [first, second] : trajectory.final_contacts) first = number(first), second = number(second);
}

core::Result<int> LocalRuns::run_part(const Part& part, const OwnRuns& runs, std::span<const std::size_t> instances,
                                      int round, std::span<belief::Trajectory> trajectories, Open* met) {
  std::vector<belief::WorldState> starts;
  std::vector<std::vector<belief::Action>> actions;
  std::vector<std::uint32_t> numbers;
  for (const std::size_t i : instances) {
    belief::WorldState& start = starts.emplace_back(runs.starts[i]);
    if (part.simulator) {
      std::vector<belief::ObjectState> kept;
      for (const std::size_t object : part.kept) kept.push_back(start.objects[object]);
      start.objects = std::move(kept);
    }
    actions.push_back(runs.actions[i]);
    numbers.push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<belief::Trajectory> own(instances.size());
  simulation::run_own_actions(part.simulator ? *part.simulator : whole_, starts, actions, *runs.request, runs.stream,
                              std::span<const std::uint32_t>(numbers), *runs.pool, own, runs.cancellation);
  std::vector<std::vector<std::size_t>> near(instances.size());
  if (part.simulator)
    runs.pool->for_blocks(instances.size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        near[j] = met_by(part, runs.starts[instances[j]], actions[j], own[j]);
        if (near[j].empty()) complete(part, runs.starts[instances[j]], own[j]);
      }
    });
  for (std::size_t j = 0; j < instances.size(); ++j) {
    if (near[j].empty()) {
      trajectories[instances[j]] = std::move(own[j]);
      continue;
    }
    near[j].insert(near[j].end(), part.kept.begin(), part.kept.end());
    (*met)[round + 1 < kMostParts ? with_neighbours(std::move(near[j])) : everything()].push_back(instances[j]);
  }
  return static_cast<int>(instances.size());
}

core::Result<int> LocalRuns::run(std::size_t object, const OwnRuns& runs, std::span<belief::Trajectory> trajectories) {
  Open open;
  std::vector<std::size_t>& all = open[with_neighbours({object})];
  for (std::size_t i = 0; i < runs.starts.size(); ++i) all.push_back(i);
  int simulated = 0;
  for (int round = 0; !open.empty(); ++round) {
    Open met;
    for (const auto& [kept, instances] : open) {
      PRESCENE_TRY(const Part* part, part_of(kept));
      PRESCENE_TRY(const int count, run_part(*part, runs, instances, round, trajectories, &met));
      simulated += count;
    }
    open = std::move(met);
  }
  return simulated;
}

std::vector<std::size_t> LocalRuns::everything() const {
  std::vector<std::size_t> all(scene_.objects.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

}  // namespace prescene::queries
