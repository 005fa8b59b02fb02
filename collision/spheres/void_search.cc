// SPDX-License-Identifier: Apache-2.0
#include "void_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kRound = 48;   // Entries worked on together; fixed, for the order of insertion hangs on it.
constexpr double kRoundShare = 0.6;  // An entry of a round has at least this share of the largest bound.
// A sphere is taken when its radius is this share of what may be left: less after many rounds without one, for plates
// of even thickness show only in small cells everywhere that nothing much larger is left.
constexpr double kAcceptShare = 0.8;
constexpr double kLeastAcceptShare = 0.55;
constexpr double kImpatience = 0.04;  // A round.
// Of the smallest radius. A cell whose half diagonal is less is given up: spheres that just reach the smallest radius
// may fall short of it by the rounding of their centres, in every cell of whatever size.
constexpr double kFinestCell = 0.05;
constexpr double kClimbShare = 1.0;         // A prototype sets out where the cell's half diagonal is below this share.
constexpr std::size_t kMostObstacles = 12;  // That a climbing prototype keeps in mind.

double distance_to(const PackedSphere& sphere, const Vector3d& x) {
  return (sphere.centre.cast<double>() - x).norm() - static_cast<double>(sphere.radius);
}

// The room near a place, as one obstacle bounds it: `room` there, and more by as much as one moves along `away`.
struct Bound {
  Vector3d away;
  double room;
};

// The step after which the lowest of the bounds is highest, less the step's square over twice `reach`: from the weights
// of the dual problem, two of them changed at a time.
Vector3d best_step(std::span<const Bound> bounds, double reach) {
  constexpr int kMostChanges = 40;
  std::array<double, kMostObstacles> weights{};
  const auto lowest =
      std::min_element(bounds.begin(), bounds.end(), [](const Bound& a, const Bound& b) { return a.room < b.room; });
  weights[static_cast<std::size_t>(lowest - bounds.begin())] = 1.0;
  Vector3d sum = lowest->away;
  for (int i = 0; i < kMostChanges; ++i) {
    std::size_t least = 0;
    std::size_t most = 0;
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (std::size_t k = 0; k < bounds.size(); ++k) {
      const double after = reach * bounds[k].away.dot(sum) + bounds[k].room;
      if (after < low) std::tie(low, least) = std::tuple(after, k);
      if (weights[k] > 0.0 && after > high) std::tie(high, most) = std::tuple(after, k);
    }
    const Vector3d change = bounds[least].away - bounds[most].away;
    const double curvature = reach * change.squaredNorm();
    if (high - low <= 1e-7 * reach || curvature <= 0.0) break;
    const double moved = std::min(weights[most], (high - low) / curvature);
    weights[least] += moved;
    weights[most] -= moved;
    sum += moved * change;
  }
  return reach * sum;
}

// Far from the origin centres can only lie on the coarse grid of single precision; smaller spheres than that are in
// vain.
double resolution(const Eigen::AlignedBox3d& box) {
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  return 2.0 * farthest * static_cast<double>(std::numeric_limits<float>::epsilon());
}

}  // namespace

bool VoidSearch::Before::operator()(const Entry& a, const Entry& b) const {
  return std::tuple(a.key, b.candidate, b.cell) < std::tuple(b.key, a.candidate, a.cell);
}

VoidSearch::VoidSearch(const SurfaceSearch& surface, double smallest, const Vector3d& downhill, core::ThreadPool& pool)
    : surface_(surface), smallest_(std::max(smallest, resolution(surface.box()))), downhill_(downhill), pool_(pool) {
  Cell root;
  root.centre = surface.box().center();
  root.half = 0.5 * surface.box().sizes().maxCoeff() * (1.0 + 1e-9);
  root.surface_low = -std::numeric_limits<double>::infinity();
  root.surface_high = std::numeric_limits<double>::infinity();
  measure(root, {});
  cells_.push_back(std::move(root));
  push_cell(0);
}

void VoidSearch::measure(Cell& cell, std::span<const std::uint32_t> nearby) const {
  const double half_diagonal = std::numbers::sqrt3 * cell.half;
  double beside = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : nearby) beside = std::min(beside, distance_to(spheres_[i], cell.centre));
  if (beside > cell.surface_low) {
    const double reach = std::max(std::abs(cell.surface_low), std::abs(cell.surface_high));
    const double distance = std::sqrt(surface_.nearest(cell.centre, reach * reach * 1.0001).squared_distance);
    const bool inside = cell.surface_low > 0.0 || (cell.surface_high > 0.0 && surface_.winding(cell.centre) > 0);
    cell.surface_low = inside ? distance : -distance;
    cell.surface_high = cell.surface_low;
  }
  cell.room = std::min(beside, cell.surface_low);
  cell.bound = cell.room + half_diagonal;
  if (!is_live(cell)) return;
  for (const std::uint32_t i : nearby) {
    if (distance_to(spheres_[i], cell.centre) - half_diagonal <= cell.bound) cell.nearby.push_back(i);
  }
}

VoidSearch::Cell VoidSearch::make_child(const Cell& parent, int octant) const {
  Cell child;
  child.half = 0.5 * parent.half;
  const Vector3d sign((octant & 1) != 0 ? 1.0 : -1.0, (octant & 2) != 0 ? 1.0 : -1.0, (octant & 4) != 0 ? 1.0 : -1.0);
  child.centre = parent.centre + child.half * sign;
  const double shift = std::numbers::sqrt3 * child.half * (1.0 + 1e-9);
  child.surface_low = parent.surface_low - shift;
  child.surface_high = parent.surface_high + shift;
  measure(child, parent.nearby);
  child.bound = std::min(child.bound, parent.bound);
  return child;
}

const VoidSearch::Cell* VoidSearch::leaf_at(const Vector3d& x) const {
  const Cell* cell = &cells_[0];
  if (((x - cell->centre).cwiseAbs().array() > cell->half).any()) return nullptr;
  while (cell->first_child != kNone) {
    const Vector3d& c = cell->centre;
    const std::uint32_t octant = (x.x() > c.x() ? 1U : 0U) + (x.y() > c.y() ? 2U : 0U) + (x.z() > c.z() ? 4U : 0U);
    cell = &cells_[cell->first_child + octant];
  }
  return is_live(*cell) ? cell : nullptr;
}

// Room of 0 where there is less than the smallest radius. `room_below` is more than the room there.
VoidSearch::Limit VoidSearch::limit_at(const Vector3d& x, double room_below) const {
  Limit limit;
  const Cell* leaf = leaf_at(x);
  if (leaf == nullptr) return limit;
  double beside = room_below;
  for (const std::uint32_t i : leaf->nearby) {
    const double distance = distance_to(spheres_[i], x);
    if (distance >= beside) continue;
    beside = distance;
    limit.obstacle = spheres_[i].centre.cast<double>();
    limit.obstacle_radius = static_cast<double>(spheres_[i].radius);
  }
  if (beside <= 0.0) return limit;
  const SurfaceSearch::Nearest wall = surface_.nearest(x, beside * beside);
  if (wall.triangle != SurfaceSearch::kNone) {
    beside = std::sqrt(wall.squared_distance);
    limit.obstacle = wall.point;
    limit.obstacle_radius = 0.0;
  }
  limit.away = (x - limit.obstacle).normalized();
  limit.room = beside;
  return limit;
}

// Maximises the room and the way downhill by a proximal bundle of the obstacles that were met [Kiwiel 1990]. First
// those of the surface count as planes, which lets prototypes slide along walls in few steps; then as the points that
// they are, which is right beside edges and corners that stick into the body.
VoidSearch::Candidate VoidSearch::climb(const Vector3d& start) const {
  constexpr int kMostSteps = 100;
  constexpr double kEnough = 1e-5;  // Gains below this share of the room aren't worth a step.
  constexpr double kKept = 0.9;     // Of the room: where a body tapers, the way downhill ends here.
  Limit limit = limit_at(start, std::numeric_limits<double>::max());
  Candidate best{start, limit.room};
  if (limit.room <= 0.0) return best;
  std::array<Limit, kMostObstacles> seen;
  std::array<Bound, kMostObstacles> bounds;
  seen[0] = limit;
  std::size_t count = 1;
  double highest = limit.room;
  double reach = 0.5 * limit.room;
  bool planes = true;
  for (int i = 0; i < kMostSteps; ++i) {
    for (std::size_t k = 0; k < count; ++k) {
      const Vector3d from = best.centre - seen[k].obstacle;
      if (planes && seen[k].obstacle_radius == 0.0) {
        bounds[k] = {seen[k].away + downhill_, std::max(seen[k].away.dot(from), 0.0)};
      } else {
        bounds[k] = {from.normalized() + downhill_, from.norm() - seen[k].obstacle_radius};
      }
    }
    Vector3d step = best_step(std::span(bounds).first(count), reach);
    double gain = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < count; ++k)
      gain = std::min(gain, bounds[k].room + bounds[k].away.dot(step) - best.room);
    if (gain <= kEnough * best.room) {
      if (!planes) break;
      planes = false;
      continue;
    }
    // Within the sphere about the present place, and so within the body.
    const double shortened = std::min(1.0, 0.99 * best.room / step.norm());
    step *= shortened;
    limit = limit_at(best.centre + step, best.room + 1.001 * step.norm());
    highest = std::max(highest, limit.room);
    if (limit.room < kKept * highest) {
      reach *= 0.5;
      continue;
    }
    const double won = limit.room + downhill_.dot(step) - best.room;
    std::size_t slot = count;
    if (count < kMostObstacles) {
      ++count;
    } else {  // The one that matters least is forgotten.
      slot = static_cast<std::size_t>(std::max_element(bounds.begin(), bounds.end(),
                                                       [](const Bound& a, const Bound& b) { return a.room < b.room; }) -
                                      bounds.begin());
    }
    seen[slot] = limit;
    if (won > 0.1 * shortened * gain) {
      best = {best.centre + step, limit.room};
      reach = std::min(2.0 * reach, 100.0 * best.room);
    } else {
      reach *= won > -gain ? 0.7 : 0.3;
    }
  }
  return best;
}

std::vector<VoidSearch::Entry> VoidSearch::take_round() {
  std::vector<Entry> round;
  double top = 0.0;
  while (!queue_.empty() && round.size() < kRound) {
    const Entry entry = queue_.top();
    if (entry.key < kRoundShare * top) break;
    queue_.pop();
    if (entry.cell != kNone && entry.key > cells_[entry.cell].bound) {
      push_cell(entry.cell);
      continue;
    }
    if (round.empty()) top = entry.key;
    round.push_back(entry);
  }
  return round;
}

VoidSearch::Outcome VoidSearch::work_on(const Entry& entry) const {
  Outcome outcome;
  if (entry.cell == kNone) {
    const Candidate& candidate = candidates_[entry.candidate];
    const Limit now = limit_at(candidate.centre, candidate.room * 1.0001);
    if (now.room >= candidate.room) {
      outcome.candidate = candidate;
    } else if (now.room > 0.5 * candidate.room) {
      outcome.candidate = climb(candidate.centre);
    }
    return outcome;
  }
  const Cell& cell = cells_[entry.cell];
  if (!cell.climbed && std::numbers::sqrt3 * cell.half <= kClimbShare * cell.room) {
    outcome.candidate = climb(cell.centre);
    return outcome;
  }
  if (std::numbers::sqrt3 * cell.half < kFinestCell * smallest_) {
    outcome.given_up = true;
    return outcome;
  }
  outcome.split = true;
  for (int octant = 0; octant < 8; ++octant)
    outcome.children[static_cast<std::size_t>(octant)] = make_child(cell, octant);
  return outcome;
}

bool VoidSearch::grow(std::size_t most) {
  for (double share = kAcceptShare;; share = std::max(share - kImpatience, kLeastAcceptShare)) {
    const std::vector<Entry> round = take_round();
    if (round.empty()) return false;
    std::vector<Outcome> outcomes(round.size());
    pool_.for_blocks(round.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) outcomes[i] = work_on(round[i]);
    });
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < round.size(); ++i) {
      Outcome& outcome = outcomes[i];
      if (outcome.split) {
        const auto first = static_cast<std::uint32_t>(cells_.size());
        cells_[round[i].cell].first_child = first;
        cells_[round[i].cell].nearby = {};
        for (Cell& child : outcome.children) cells_.push_back(std::move(child));
        for (std::uint32_t k = 0; k < 8; ++k) push_cell(first + k);
      } else if (outcome.given_up) {
        cells_[round[i].cell].bound = 0.0;
      } else if (round[i].cell != kNone) {
        cells_[round[i].cell].climbed = true;
        push_cell(round[i].cell);
      }
      if (outcome.candidate.room >= smallest_) candidates.push_back(outcome.candidate);
    }
    if (settle(candidates, most, share)) return true;
  }
}

// Not inlined: where g++ 12 sees both conversions of a vector, from double to float and back, its vectorizer drops
// them.
[[gnu::noinline]] PackedSphere VoidSearch::fitted(const Vector3f& centre, double room_below) const {
  const double room = limit_at(centre.cast<double>(), room_below).room;
  return {centre, std::nextafter(static_cast<float>(room), 0.0F)};
}

// Inserts those candidates that nothing larger can be left beside; the others wait.
bool VoidSearch::settle(std::vector<Candidate>& candidates, std::size_t most, double share) {
  const auto merit = [&](const Candidate& c) { return c.room + downhill_.dot(c.centre); };
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const Candidate& a, const Candidate& b) { return merit(a) > merit(b); });
  while (!queue_.empty() && queue_.top().cell != kNone && queue_.top().key > cells_[queue_.top().cell].bound) {
    const std::uint32_t cell = queue_.top().cell;
    queue_.pop();
    push_cell(cell);
  }
  const double left = queue_.empty() ? 0.0 : queue_.top().key;
  const std::size_t before = spheres_.size();
  for (const Candidate& candidate : candidates) {
    double room = candidate.room;
    for (std::size_t i = before; i < spheres_.size(); ++i)
      room = std::min(room, distance_to(spheres_[i], candidate.centre));
    if (room >= candidate.room && room >= share * left && spheres_.size() < before + most) {
      const PackedSphere sphere = fitted(candidate.centre.cast<float>(), 1.01 * candidate.room);
      if (static_cast<double>(sphere.radius) >= smallest_) insert(sphere);
    } else if (room > 0.5 * candidate.room) {
      push_candidate(candidate, room);
    }
  }
  return spheres_.size() > before;
}

void VoidSearch::insert(const PackedSphere& sphere) {
  spheres_.push_back(sphere);
  volume_ += 4.0 / 3.0 * std::numbers::pi * std::pow(static_cast<double>(sphere.radius), 3);
  update(0, static_cast<std::uint32_t>(spheres_.size() - 1));
}

double VoidSearch::update(std::uint32_t index, std::uint32_t sphere) {
  Cell& cell = cells_[index];
  const double half_diagonal = std::numbers::sqrt3 * cell.half;
  const double distance = distance_to(spheres_[sphere], cell.centre);
  if (!is_live(cell) || distance - half_diagonal > cell.bound) return cell.bound;
  if (cell.first_child == kNone) {
    cell.nearby.push_back(sphere);
    if (distance < cell.room) {
      cell.room = distance;
      cell.bound = std::min(cell.bound, distance + half_diagonal);
      cell.climbed = false;
    }
    if (!is_live(cell)) cell.nearby = {};
    return cell.bound;
  }
  double bound = 0.0;
  for (std::uint32_t k = 0; k < 8; ++k) bound = std::max(bound, update(cell.first_child + k, sphere));
  cells_[index].bound = bound;
  return bound;
}

void VoidSearch::push_cell(std::uint32_t cell) {
  if (is_live(cells_[cell])) queue_.push({cells_[cell].bound, cell, kNone});
}

void VoidSearch::push_candidate(const Candidate& candidate, double key) {
  candidates_.push_back(candidate);
  queue_.push({key, kNone, static_cast<std::uint32_t>(candidates_.size() - 1)});
}

}  // namespace prescene::collision
