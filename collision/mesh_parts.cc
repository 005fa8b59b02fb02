// SPDX-License-Identifier: Apache-2.0
#include "mesh_parts.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace prescene::collision {
namespace {

/// Sets of vertices that are joined, each named by its least vertex.
class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

std::vector<Vector3f> corners_of_parts(const std::vector<Vector3f>& vertices,
                                       const std::vector<TriangleIndices>& triangles) {
  Parts parts(vertices.size());
  for (const TriangleIndices& t : triangles) {
    parts.join(t[0], t[1]);
    parts.join(t[1], t[2]);
  }
  std::vector<std::uint32_t> by_place(vertices.size());
  std::iota(by_place.begin(), by_place.end(), 0U);
  const auto place = [&](std::uint32_t i) { return std::tie(vertices[i].x(), vertices[i].y(), vertices[i].z()); };
  std::sort(by_place.begin(), by_place.end(), [&](auto i, auto k) { return place(i) < place(k); });
  for (std::size_t i = 1; i < by_place.size(); ++i) {
    if (place(by_place[i]) == place(by_place[i - 1])) parts.join(by_place[i], by_place[i - 1]);
  }
  std::vector<Vector3f> corners;
  std::vector<bool> seen(vertices.size());
  for (const TriangleIndices& t : triangles) {
    const std::uint32_t part = parts.find(t[0]);
    if (seen[part]) continue;
    seen[part] = true;
    corners.push_back(vertices[t[0]]);
  }
  return corners;
}

}  // namespace prescene::collision
