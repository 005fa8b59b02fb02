// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/local_runs.h"

#include <algorithm>

#include "prescene/simulation/own_actions.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Box;
using geometry::Vector3d;

constexpr double kReachFactor = 1.001;  // for rounding
constexpr double kApart = 0.01;         // m between boxes about things that are simulated without each other

bool are_near(const Box& a, const Box& b) {
  return (a.min().array() < b.max().array() + kApart).all() && (b.min().array() < a.max().array() + kApart).all();
}

}  // namespace

LocalRuns::LocalRuns(const belief::Scene& scene, std::span<const geometry::TriangleMesh> shapes,
                     const belief::WorldState& likeliest, const simulation::Simulator& whole,
                     const simulation::SimulatorFactory& make_simulator)
    : scene_(scene),
      shapes_(shapes),
      likeliest_(likeliest),
      whole_(whole),
      make_simulator_(make_simulator),
      parts_(scene.objects.size()) {}

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

core::Result<const LocalRuns::Part*> LocalRuns::part_of(std::size_t object) {
  if (parts_[object]) return parts_[object].get();
  auto part = std::make_unique<Part>();
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) boxes.push_back(box_of(i, likeliest_.objects[i].X_WO));
  // What is jointed is told apart by no box: then all are simulated.
  std::vector<std::uint8_t> kept(boxes.size(), scene_.joints.empty() ? 0 : 1);
  std::vector<std::size_t> open = {object};
  kept[object] = 1;
  // What it touches, what that touches, and so on.
  while (!open.empty()) {
    const std::size_t i = open.back();
    open.pop_back();
    for (std::size_t j = 0; j < boxes.size(); ++j) {
      if (kept[j] != 0 || !are_near(boxes[i], boxes[j])) continue;
      kept[j] = 1;
      open.push_back(j);
    }
  }
  belief::Scene local = scene_;
  local.objects.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    // What a hand holds stays, so that the hand does.
    if (likeliest_.objects[i].mode == belief::MotionMode::kHeld) kept[i] = 1;
    (kept[i] != 0 ? part->kept : part->left_out).push_back(i);
    if (kept[i] != 0) local.objects.push_back(scene_.objects[i]);
  }
  if (!part->left_out.empty()) {
    PRESCENE_TRY(part->simulator, make_simulator_(local, 1.0));
  }
  parts_[object] = std::move(part);
  return parts_[object].get();
}

bool LocalRuns::meets(const Part& part, const belief::WorldState& start, const std::vector<belief::Action>& actions,
                      const belief::Trajectory& local) const {
  std::vector<Box> lying;
  for (const std::size_t i : part.left_out) lying.push_back(box_of(i, start.objects[i].X_WO));
  const auto near_any = [&](const Box& box) {
    return std::any_of(lying.begin(), lying.end(), [&](const Box& other) { return are_near(box, other); });
  };
  for (const belief::Action& action : actions) {
    const auto* push = std::get_if<belief::Push>(&action.what);
    if (push == nullptr) continue;
    const Vector3d radius = Vector3d::Constant(push->radius);
    if (near_any({push->from.cwiseMin(push->to) - radius, push->from.cwiseMax(push->to) + radius})) return true;
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
      if (near_any(around(*at).merged(around(X_WO))) &&
          near_any(box_of(part.kept[k], *at).merged(box_of(part.kept[k], X_WO))))
        return true;
      at = &X_WO;
    }
  }
  return false;
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

core::Result<int> LocalRuns::run(std::size_t object, const OwnRuns& runs, std::span<belief::Trajectory> trajectories) {
  PRESCENE_TRY(const Part* part, part_of(object));
  const std::size_t n = runs.starts.size();
  std::vector<belief::WorldState> starts(runs.starts.begin(), runs.starts.end());
  if (part->simulator) {
    for (belief::WorldState& start : starts) {
      std::vector<belief::ObjectState> kept;
      for (const std::size_t i : part->kept) kept.push_back(start.objects[i]);
      start.objects = std::move(kept);
    }
  }
  simulation::run_own_actions(part->simulator ? *part->simulator : whole_, starts, runs.actions, *runs.request,
                              runs.stream, 0, *runs.pool, trajectories, runs.cancellation);
  if (!part->simulator) return static_cast<int>(n);
  std::vector<std::uint8_t> near(n, 0);
  runs.pool->for_blocks(n, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      near[i] = meets(*part, runs.starts[i], runs.actions[i], trajectories[i]) ? 1 : 0;
      if (near[i] == 0) complete(*part, runs.starts[i], trajectories[i]);
    }
  });
  std::vector<belief::WorldState> again;
  std::vector<std::vector<belief::Action>> actions;
  std::vector<std::uint32_t> numbers;
  for (std::size_t i = 0; i < n; ++i) {
    if (near[i] == 0) continue;
    again.push_back(runs.starts[i]);
    actions.push_back(runs.actions[i]);
    numbers.push_back(static_cast<std::uint32_t>(i));
  }
  if (again.empty()) return static_cast<int>(n);
  std::vector<belief::Trajectory> whole(again.size());
  simulation::run_own_actions(whole_, again, actions, *runs.request, runs.stream,
                              std::span<const std::uint32_t>(numbers), *runs.pool, whole, runs.cancellation);
  for (std::size_t j = 0; j < again.size(); ++j) trajectories[numbers[j]] = std::move(whole[j]);
  return static_cast<int>(n + again.size());
}

}  // namespace prescene::queries
