// SPDX-License-Identifier: Apache-2.0
#include "mesh_holes.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <numeric>
#include <sstream>
#include <tuple>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

// For each vertex the lowest index of one at the same position.
std::vector<std::uint32_t> welded(const std::vector<Vector3f>& vertices) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) { return std::tuple(vertices[i].x(), vertices[i].y(), vertices[i].z()); };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::tuple(key(a), a) < std::tuple(key(b), b); });
  std::vector<std::uint32_t> result(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    result[order[i]] = same ? result[order[i - 1]] : order[i];
  }
  return result;
}

bool starts_before(const OpenEdges::Edge& a, const OpenEdges::Edge& b) {
  return std::tuple(a.from, a.to) < std::tuple(b.from, b.to);
}

}  // namespace

OpenEdges open_edges(const Mesh& mesh) {
  const std::vector<std::uint32_t> index = welded(mesh.vertices());
  struct Use {
    std::uint32_t low;
    std::uint32_t high;
    int direction;
  };
  std::vector<Use> uses;
  uses.reserve(3 * mesh.triangles().size());
  for (const TriangleIndices& t : mesh.triangles()) {
    const std::array<std::uint32_t, 3> v = {index[t[0]], index[t[1]], index[t[2]]};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = v[k];
      const std::uint32_t b = v[(k + 1) % 3];
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  }
  std::sort(uses.begin(), uses.end(),
            [](const Use& x, const Use& y) { return std::tuple(x.low, x.high) < std::tuple(y.low, y.high); });
  OpenEdges open;
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    int balance = 0;
    for (; end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high; ++end)
      balance += uses[end].direction;
    const OpenEdges::Edge missing = balance > 0 ? OpenEdges::Edge{uses[begin].high, uses[begin].low}
                                                : OpenEdges::Edge{uses[begin].low, uses[begin].high};
    for (int i = 0; i < std::abs(balance); ++i) open.edges.push_back(missing);
  }
  std::sort(open.edges.begin(), open.edges.end(), starts_before);
  return open;
}

core::Status check_closed(const Mesh& mesh, const OpenEdges& open, std::string_view remedy) {
  if (open.edges.empty()) return core::ok_status();
  const Vector3f place = 0.5F * (mesh.vertices()[open.edges[0].from] + mesh.vertices()[open.edges[0].to]);
  std::ostringstream text;
  text << std::setprecision(4) << "mesh '" << mesh.name()
       << "': it is open, or its triangles are of mixed orientation: " << open.edges.size() << " open edges, one at ("
       << place.x() << ", " << place.y() << ", " << place.z() << ") m; mend it, or " << remedy;
  return core::invalid_input(text.str());
}

ClosedMesh close_holes(const Mesh& mesh, const OpenEdges& open) {
  ClosedMesh closed{mesh.vertices(), mesh.triangles(), 0};
  // Each vertex has as many missing edges to it as from it, for each triangle enters a corner as often as it leaves it:
  // a walk along unused missing edges ends where it began.
  std::vector<bool> used(open.edges.size(), false);
  for (std::size_t start = 0; start < open.edges.size(); ++start) {
    if (used[start]) continue;
    std::vector<std::uint32_t> loop;
    std::size_t edge = start;
    while (true) {
      used[edge] = true;
      loop.push_back(open.edges[edge].from);
      const std::uint32_t at = open.edges[edge].to;
      if (at == open.edges[start].from) break;
      const auto first = std::lower_bound(open.edges.begin(), open.edges.end(), OpenEdges::Edge{at, 0}, starts_before);
      edge = static_cast<std::size_t>(first - open.edges.begin());
      while (edge < open.edges.size() && used[edge]) ++edge;
      PRESCENE_CHECK(edge < open.edges.size() && open.edges[edge].from == at);
    }
    ++closed.holes;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t v : loop) sum += closed.vertices[v].cast<double>();
    if (loop.size() == 3) {
      closed.triangles.push_back({loop[0], loop[1], loop[2]});
      continue;
    }
    const auto middle = static_cast<std::uint32_t>(closed.vertices.size());
    closed.vertices.emplace_back((sum / static_cast<double>(loop.size())).cast<float>());
    for (std::size_t i = 0; i < loop.size(); ++i)
      closed.triangles.push_back({loop[i], loop[(i + 1) % loop.size()], middle});
  }
  return closed;
}

}  // namespace prescene::collision
