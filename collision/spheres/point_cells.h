// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

namespace prescene::collision {

/// Points in cubes of an edge length, to find those near a place: all that are within that length, and others.
class PointCells {
 public:
  explicit PointCells(double edge) : edge_(edge) {}
  void add(const Eigen::Vector3d& p, std::size_t index) { cells_[key(p)].push_back(index); }
  template <class Visit>
  void for_near(const Eigen::Vector3d& p, const Visit& visit) const {
    const Key middle = key(p);
    for (std::int64_t x = -1; x <= 1; ++x)
      for (std::int64_t y = -1; y <= 1; ++y)
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto found = cells_.find({middle[0] + x, middle[1] + y, middle[2] + z});
          if (found == cells_.end()) continue;
          for (const std::size_t i : found->second) visit(i);
        }
  }

 private:
  using Key = std::array<std::int64_t, 3>;
  Key key(const Eigen::Vector3d& p) const {
    const auto of = [&](double x) { return static_cast<std::int64_t>(std::floor(x / edge_)); };
    return {of(p.x()), of(p.y()), of(p.z())};
  }
  double edge_;
  std::map<Key, std::vector<std::size_t>> cells_;
};

}  // namespace prescene::collision
