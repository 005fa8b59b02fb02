// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/refine.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace prescene::geometry {
namespace {

constexpr std::uint32_t kWhole = std::numeric_limits<std::uint32_t>::max();
using Edge = std::pair<std::uint32_t, std::uint32_t>;
using Triangle = std::array<std::uint32_t, 3>;

Edge edge_of(const Triangle& t, std::size_t k) { return std::minmax(t[k], t[(k + 1) % 3]); }

/// Appends the pieces of a triangle; middles[k] is the middle of the edge from corner k, or kWhole.
void cut(const Triangle& t, const std::array<std::uint32_t, 3>& middles, std::vector<Triangle>& pieces) {
  // Corners between two middles are cut off. What remains is convex, and seen from a middle none of its sides but the
  // two halves that it lies on is in line with it.
  std::vector<std::uint32_t> rest;
  std::size_t from = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t before = middles[(k + 2) % 3];
    if (before != kWhole && middles[k] != kWhole) {
      pieces.push_back({before, t[k], middles[k]});
    } else {
      rest.push_back(t[k]);
    }
    if (middles[k] == kWhole) continue;
    from = rest.size();
    rest.push_back(middles[k]);
  }
  const auto at = [&](std::size_t i) { return rest[(from + i) % rest.size()]; };
  for (std::size_t i = 2; i < rest.size(); ++i) pieces.push_back({at(0), at(i - 1), at(i)});
}

}  // namespace

TriangleMesh refined(const TriangleMesh& mesh, double longest, std::size_t max_triangles) {
  TriangleMesh fine;
  fine.vertices = mesh.vertices;
  fine.triangles = mesh.triangles;
  while (true) {
    std::map<Edge, std::uint32_t> middles;
    std::size_t pieces = fine.triangles.size();
    for (const Triangle& t : fine.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge e = edge_of(t, k);
        if (!((fine.vertices[e.first] - fine.vertices[e.second]).norm() > longest)) continue;
        middles[e] = kWhole;
        ++pieces;
      }
    }
    if (middles.empty() || pieces > max_triangles) return fine;
    for (auto& [e, middle] : middles) {
      middle = static_cast<std::uint32_t>(fine.vertices.size());
      fine.vertices.push_back(0.5 * (fine.vertices[e.first] + fine.vertices[e.second]));
    }
    std::vector<Triangle> triangles;
    for (const Triangle& t : fine.triangles) {
      std::array<std::uint32_t, 3> of_edges{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto found = middles.find(edge_of(t, k));
        of_edges[k] = found == middles.end() ? kWhole : found->second;
      }
      cut(t, of_edges, triangles);
    }
    fine.triangles = std::move(triangles);
  }
}

}  // namespace prescene::geometry
