// SPDX-License-Identifier: Apache-2.0
// The largest sphere that still fits into a body beside the spheres that are there: a best-first search over an octree,
// whose bounds say that nothing larger is left, with prototypes that climb to the middle of the void [Weller and
// Zachmann 2010].
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <queue>
#include <span>
#include <vector>

#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/parallel.h"
#include "surface_search.h"

namespace prescene::collision {

class VoidSearch {
 public:
  /// Spheres with a radius below `smallest`, or too small for single precision so far from the origin, are not looked
  /// for. A prototype gives up the share |downhill| (well below 1) of what it moves that way, so that among equal
  /// places it ends in a corner or beside another sphere, and not in the middle of a plate or a rod where it would
  /// leave two gaps. `surface` outlives the search.
  VoidSearch(const SurfaceSearch& surface, double smallest, const Eigen::Vector3d& downhill, core::ThreadPool& pool);

  /// Inserts at least one and at most `most` (>= 1) of the largest spheres that fit, or none, and says so, when all
  /// voids are smaller than the smallest radius. The same for any number of threads.
  bool grow(std::size_t most);
  /// Inserts a sphere that overlaps no other one and lies inside of the body.
  void insert(const PackedSphere& sphere);
  const std::vector<PackedSphere>& spheres() const { return spheres_; }
  /// Sum of the spheres' volumes, m^3.
  double volume() const { return volume_; }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  // A cube. What is known of its centre: the signed distance to the surface, positive inside, is between surface_low
  // and surface_high; `room` is the radius of the largest sphere there that fits beside the spheres (a lower bound of
  // the distance to the surface may stand for it where a sphere is nearer).
  struct Cell {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double half = 0.0;  // Half of the edge length.
    double surface_low = 0.0;
    double surface_high = 0.0;
    double room = 0.0;
    double bound = 0.0;  // No sphere with its centre in the cell is larger.
    std::uint32_t first_child = kNone;
    bool climbed = false;               // A prototype has set out from here since the last change.
    std::vector<std::uint32_t> nearby;  // Spheres that may limit the room somewhere in the cell.
  };
  struct Candidate {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double room = 0.0;
  };
  // Of the queue: a cell, or a candidate (cell == kNone).
  struct Entry {
    double key = 0.0;
    std::uint32_t cell = kNone;
    std::uint32_t candidate = kNone;
  };
  struct Before {
    bool operator()(const Entry& a, const Entry& b) const;
  };
  // What bounds the room at a place: the nearest point of the surface or a sphere.
  struct Limit {
    double room = 0.0;
    Eigen::Vector3d away = Eigen::Vector3d::Zero();  // Direction in which the room grows.
    Eigen::Vector3d obstacle = Eigen::Vector3d::Zero();
    double obstacle_radius = 0.0;
  };
  // What one entry of a round has become.
  struct Outcome {
    bool split = false;
    bool given_up = false;
    std::array<Cell, 8> children;
    Candidate candidate;
  };

  bool is_live(const Cell& cell) const { return cell.bound >= smallest_; }
  Limit limit_at(const Eigen::Vector3d& x, double room_below) const;
  const Cell* leaf_at(const Eigen::Vector3d& x) const;
  Candidate climb(const Eigen::Vector3d& start) const;
  PackedSphere fitted(const Vector3f& centre, double room_below) const;
  Cell make_child(const Cell& parent, int octant) const;
  void measure(Cell& cell, std::span<const std::uint32_t> nearby) const;
  std::vector<Entry> take_round();
  Outcome work_on(const Entry& entry) const;
  bool settle(std::vector<Candidate>& candidates, std::size_t most, double share);
  double update(std::uint32_t cell, std::uint32_t sphere);
  void push_cell(std::uint32_t cell);
  void push_candidate(const Candidate& candidate, double key);

  const SurfaceSearch& surface_;
  double smallest_;
  Eigen::Vector3d downhill_;
  core::ThreadPool& pool_;
  std::vector<Cell> cells_;  // The root first.
  std::vector<Candidate> candidates_;
  std::priority_queue<Entry, std::vector<Entry>, Before> queue_;
  std::vector<PackedSphere> spheres_;
  double volume_ = 0.0;
};

}  // namespace prescene::collision
