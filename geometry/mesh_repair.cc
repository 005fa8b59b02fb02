// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "mesh_edges.h"
#include "prescene/geometry/cancellable.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

bool MeshRepairReport::changed() const { return *this != MeshRepairReport{}; }

std::string MeshRepairReport::text() const {
  std::string text;
  const auto say = [&](int count, const char* what) {
    if (count == 0) return;
    if (!text.empty()) text += ", ";
    text += std::to_string(count) + " " + what;
  };
  say(non_finite_vertices, "vertices with NaN or infinity removed");
  say(out_of_range_triangles, "triangles with an index beyond the vertices removed");
  say(degenerate_triangles, "triangles without area removed");
  say(flipped_edges, "edges flipped to get rid of triangles without area");
  say(duplicate_vertices, "vertices at the same place made one");
  say(unused_vertices, "unused vertices removed");
  return text;
}

namespace {

// Height over longest edge below which a triangle has no area: its normal would be noise of the coordinates' rounding.
constexpr double kSliver = 1e-9;

bool has_equal_corners(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// The corner opposite of the longest edge when the triangle has (almost) no area.
std::optional<std::size_t> sliver_corner(const std::vector<Vector3d>& vertices, const Triangle& t) {
  std::array<double, 3> opposite;
  for (std::size_t k = 0; k < 3; ++k) opposite[k] = (vertices[t[(k + 1) % 3]] - vertices[t[(k + 2) % 3]]).squaredNorm();
  const auto corner = static_cast<std::size_t>(std::max_element(opposite.begin(), opposite.end()) - opposite.begin());
  const Vector3d& a = vertices[t[corner]];
  const double doubled_area = (vertices[t[(corner + 1) % 3]] - a).cross(vertices[t[(corner + 2) % 3]] - a).norm();
  if (doubled_area > kSliver * opposite[corner]) return std::nullopt;
  return corner;
}

bool edges_are_closed(const std::vector<Triangle>& triangles) {
  bool closed = true;
  for_each_edge(edge_uses(triangles), [&](std::span<const EdgeUse> uses) { closed = closed && uses.size() == 2; });
  return closed;
}

bool edge_exists(const std::vector<EdgeUse>& uses, std::uint32_t a, std::uint32_t b) {
  const std::pair edge(std::min(a, b), std::max(a, b));
  const auto found = std::lower_bound(uses.begin(), uses.end(), edge, [](const EdgeUse& use, const auto& wanted) {
    return std::pair(use.low, use.high) < wanted;
  });
  return found != uses.end() && std::pair(found->low, found->high) == edge;
}

// Flips the longest edge of each sliver that has one neighbour across it: the middle vertex is put onto that
// neighbour's edge, the sliver is gone and the surface stays as it was. Returns how many were flipped; each pass leaves
// alone what it touched already.
int flip_slivers(const std::vector<Vector3d>& vertices, std::vector<Triangle>& triangles) {
  // Most meshes have none, and to find neighbours takes longer than to see that.
  if (std::none_of(triangles.begin(), triangles.end(),
                   [&](const Triangle& t) { return sliver_corner(vertices, t).has_value(); }))
    return 0;
  const std::vector<EdgeUse> uses = edge_uses(triangles);
  std::vector<bool> touched(triangles.size(), false);
  int flips = 0;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2 || edge[0].forward == edge[1].forward) return;
    for (std::size_t side = 0; side < 2; ++side) {
      const EdgeUse& own = edge[side];
      const EdgeUse& other = edge[1 - side];
      if (touched[own.triangle] || touched[other.triangle]) return;
      const Triangle sliver = triangles[own.triangle];
      if (sliver_corner(vertices, sliver) != static_cast<std::size_t>((own.corner + 2) % 3)) continue;
      const std::uint32_t from = sliver[own.corner];
      const std::uint32_t to = sliver[(own.corner + 1U) % 3];
      const std::uint32_t middle = sliver[(own.corner + 2U) % 3];
      const std::uint32_t across = triangles[other.triangle][(other.corner + 2U) % 3];
      if (middle == across || edge_exists(uses, middle, across)) continue;
      triangles[own.triangle] = {middle, from, across};
      triangles[other.triangle] = {to, middle, across};
      touched[own.triangle] = touched[other.triangle] = true;
      ++flips;
      return;
    }
  });
  return flips;
}

int remove_slivers(const std::vector<Vector3d>& vertices, std::vector<Triangle>& triangles) {
  return static_cast<int>(
      std::erase_if(triangles, [&](const Triangle& t) { return sliver_corner(vertices, t).has_value(); }));
}

core::Status cancelled_repair() { return core::cancelled("the repair of a mesh was stopped"); }

}  // namespace

core::Result<TriangleMesh> repair_mesh(TriangleMesh mesh, MeshRepairReport* report) {
  return repair_mesh(std::move(mesh), report, nullptr);
}

core::Result<TriangleMesh> repair_mesh(TriangleMesh mesh, MeshRepairReport* report,
                                       const core::Cancellation* cancellation) {
  MeshRepairReport found;
  std::vector<Triangle>& triangles = mesh.triangles;
  const std::size_t count = mesh.vertices.size();
  found.out_of_range_triangles = static_cast<int>(
      std::erase_if(triangles, [&](const Triangle& t) { return t[0] >= count || t[1] >= count || t[2] >= count; }));

  std::vector<bool> finite(count);
  for (std::size_t i = 0; i < count; ++i) finite[i] = mesh.vertices[i].allFinite();
  found.non_finite_vertices = static_cast<int>(std::count(finite.begin(), finite.end(), false));
  std::erase_if(triangles, [&](const Triangle& t) { return !finite[t[0]] || !finite[t[1]] || !finite[t[2]]; });
  found.degenerate_triangles = static_cast<int>(std::erase_if(triangles, has_equal_corners));

  // Welding closes the seams of files that repeat vertices (STL, or one vertex for each texture coordinate). A surface
  // that is closed by its own indices is only welded when it stays so: scans of thin walls touch themselves in single
  // points.
  const auto stopped = [cancellation] { return cancellation && cancellation->requested(); };
  if (stopped()) return cancelled_repair();
  const bool closed_before = edges_are_closed(triangles);
  if (stopped()) return cancelled_repair();
  const std::vector<std::uint32_t> welded = welded_indices(mesh.vertices);
  std::vector<Triangle> candidate = triangles;
  for (Triangle& t : candidate) {
    for (std::uint32_t& v : t) v = welded[v];
  }
  const int collapsed = static_cast<int>(std::erase_if(candidate, has_equal_corners));
  if (!closed_before || edges_are_closed(candidate)) {
    triangles = std::move(candidate);
    found.degenerate_triangles += collapsed;
    for (std::size_t v = 0; v < count; ++v) found.duplicate_vertices += finite[v] && welded[v] != v;
  }

  // A chain of slivers along an edge takes a pass each; longer chains than this do not occur in practice.
  constexpr int kMaxPasses = 16;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const int flips = flip_slivers(mesh.vertices, triangles);
    if (stopped()) return cancelled_repair();
    if (flips == 0) break;
    found.flipped_edges += flips;
  }
  // What no flip removes may only stay where its removal would open a closed surface.
  if (!edges_are_closed(triangles)) found.degenerate_triangles += remove_slivers(mesh.vertices, triangles);

  TriangleMesh result = with_used_vertices(mesh.vertices, std::move(triangles));
  found.unused_vertices = static_cast<int>(count - result.vertices.size()) - found.duplicate_vertices;
  if (found.non_finite_vertices > 0) found.unused_vertices -= found.non_finite_vertices;
  if (report != nullptr) *report = found;
  if (result.empty()) {
    const std::string why = found.text();
    return core::invalid_input("the mesh has no triangle with an area" + (why.empty() ? "" : " (" + why + ")") +
                               ": export it again as a mesh of triangles");
  }
  return result;
}

}  // namespace prescene::geometry
