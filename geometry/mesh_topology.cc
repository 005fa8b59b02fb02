// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <tuple>

#include "mesh_edges.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {
namespace {

// Into the order of their lower vertices, one pass over them; false where the vertices' numbers are so much larger than
// their count that a list over all of these would be out of proportion.
bool order_by_low(std::vector<EdgeUse>& uses) {
  std::size_t end = 0;
  for (const EdgeUse& use : uses) end = std::max(end, std::size_t{use.low} + 1);
  if (end > 4 * uses.size()) return false;
  std::vector<std::uint32_t> place(end + 1, 0);
  for (const EdgeUse& use : uses) ++place[use.low + 1];
  std::partial_sum(place.begin(), place.end(), place.begin());
  std::vector<EdgeUse> ordered(uses.size());
  for (const EdgeUse& use : uses) ordered[place[use.low]++] = use;
  uses = std::move(ordered);
  return true;
}

}  // namespace

std::vector<EdgeUse> edge_uses(const std::vector<Triangle>& triangles) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      uses.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(i), k, a < b});
    }
  }
  const auto before = [](const EdgeUse& x, const EdgeUse& y) {
    return std::tie(x.low, x.high, x.triangle) < std::tie(y.low, y.high, y.triangle);
  };
  if (!order_by_low(uses)) {
    std::sort(uses.begin(), uses.end(), before);
    return uses;
  }
  for (auto begin = uses.begin(); begin != uses.end();) {
    const auto end = std::find_if(begin, uses.end(), [&](const EdgeUse& use) { return use.low != begin->low; });
    std::sort(begin, end, before);
    begin = end;
  }
  return uses;
}

std::vector<std::uint32_t> welded_indices(const std::vector<Vector3d>& vertices) {
  // Bits, not values, so that NaN has an order too.
  const auto key = [&](std::uint32_t i) {
    const Vector3d p = vertices[i] + Vector3d::Zero();  // -0 + 0 is 0.
    return std::array<std::uint64_t, 3>{std::bit_cast<std::uint64_t>(p.x()), std::bit_cast<std::uint64_t>(p.y()),
                                        std::bit_cast<std::uint64_t>(p.z())};
  };
  std::vector<std::pair<std::array<std::uint64_t, 3>, std::uint32_t>> order(vertices.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {key(i), i};
  std::sort(order.begin(), order.end());

  std::vector<std::uint32_t> welded(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && order[i].first == order[i - 1].first;
    welded[order[i].second] = same ? welded[order[i - 1].second] : order[i].second;
  }
  return welded;
}

TriangleMesh with_used_vertices(const std::vector<Vector3d>& vertices, std::vector<Triangle> triangles) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> index(vertices.size(), kUnused);
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) index[v] = 0;
  }
  TriangleMesh mesh;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (index[v] == kUnused) continue;
    index[v] = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(vertices[v]);
  }
  for (Triangle& t : triangles) {
    for (std::uint32_t& v : t) v = index[v];
  }
  mesh.triangles = std::move(triangles);
  return mesh;
}

namespace {

std::vector<Triangle> relabelled(const std::vector<Triangle>& triangles, const std::vector<std::uint32_t>& index) {
  std::vector<Triangle> result = triangles;
  for (Triangle& t : result) {
    for (std::uint32_t& v : t) v = index[v];
  }
  return result;
}

// For each triangle the number of its component, counted in the order of first triangles; and how many there are.
std::pair<std::vector<int>, int> component_numbers(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  std::vector<std::uint32_t> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Triangle& t : triangles) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  std::vector<int> number_of_root(vertex_count, -1);
  std::vector<int> numbers;
  numbers.reserve(triangles.size());
  int count = 0;
  for (const Triangle& t : triangles) {
    int& number = number_of_root[root(t[0])];
    if (number < 0) number = count++;
    numbers.push_back(number);
  }
  return {std::move(numbers), count};
}

void count_edges(const std::vector<Triangle>& triangles, MeshTopology& topology) {
  for_each_edge(edge_uses(triangles), [&](std::span<const EdgeUse> uses) {
    const auto forward = std::count_if(uses.begin(), uses.end(), [](const EdgeUse& use) { return use.forward; });
    topology.open_edges += uses.size() == 1;
    topology.non_manifold_edges += uses.size() > 2;
    topology.inconsistent_edges += uses.size() == 2 && forward != 1;
    topology.unbalanced_edges += 2 * forward != std::ssize(uses);
  });
}

// The triangles by their own indices when these make them watertight, else by the indices of welded vertices. Scans and
// convex parts that touch in a point are apart by their own indices; soups of triangles are one surface once welded.
std::vector<Triangle> joined_triangles(const TriangleMesh& mesh, MeshTopology& topology) {
  count_edges(mesh.triangles, topology);
  if (topology.watertight()) return mesh.triangles;
  std::vector<Triangle> welded = relabelled(mesh.triangles, welded_indices(mesh.vertices));
  topology = {};
  count_edges(welded, topology);
  return welded;
}

}  // namespace

MeshTopology mesh_topology(const TriangleMesh& mesh) {
  MeshTopology topology;
  const std::vector<Triangle> triangles = joined_triangles(mesh, topology);
  topology.components = component_numbers(triangles, mesh.vertices.size()).second;
  return topology;
}

std::vector<TriangleMesh> connected_components(const TriangleMesh& mesh) {
  MeshTopology topology;
  const auto [numbers, count] = component_numbers(joined_triangles(mesh, topology), mesh.vertices.size());
  std::vector<std::vector<Triangle>> triangles(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    triangles[static_cast<std::size_t>(numbers[i])].push_back(mesh.triangles[i]);
  }
  std::vector<TriangleMesh> components;
  components.reserve(triangles.size());
  for (auto& part : triangles) components.push_back(with_used_vertices(mesh.vertices, std::move(part)));
  return components;
}

}  // namespace prescene::geometry
