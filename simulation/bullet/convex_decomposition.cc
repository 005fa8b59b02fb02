// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/bullet/convex_decomposition.h"

#include <hacdHACD.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace prescene::simulation {
namespace {

// HACD is quadratic in the triangles; a contact shape needs no more.
constexpr int kMaxTriangles = 1000;
// It looks for dents at corners only, so a big triangle hides them: edges longer than this share of the mesh's diagonal
// are halved, up to so many triangles.
constexpr double kLongestEdge = 0.1;
constexpr std::size_t kMaxRefinedTriangles = 2000;
// HACD measures concavity on data scaled to this size.
constexpr double kScale = 1000.0;

/// Halves all edges longer than `longest` (m), again and again; triangles that share an edge still do.
geometry::TriangleMesh refined(geometry::TriangleMesh mesh, double longest) {
  constexpr std::uint32_t kWhole = std::numeric_limits<std::uint32_t>::max();
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  const auto edge = [](std::uint32_t a, std::uint32_t b) -> Edge { return {std::min(a, b), std::max(a, b)}; };
  while (true) {
    std::map<Edge, std::uint32_t> middles;
    for (const auto& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge e = edge(t[k], t[(k + 1) % 3]);
        if ((mesh.vertices[e.first] - mesh.vertices[e.second]).norm() > longest) middles[e] = 0;
      }
    }
    if (middles.empty() || mesh.triangles.size() + 2 * middles.size() > kMaxRefinedTriangles) return mesh;
    for (auto& [e, middle] : middles) {
      middle = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(0.5 * (mesh.vertices[e.first] + mesh.vertices[e.second]));
    }
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const auto& t : mesh.triangles) {
      // Cut off each corner between two halved edges; what remains has four corners, three or all of the triangle.
      std::array<std::uint32_t, 3> m{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto found = middles.find(edge(t[k], t[(k + 1) % 3]));
        m[k] = found == middles.end() ? kWhole : found->second;
      }
      std::vector<std::uint32_t> rest;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t before = m[(k + 2) % 3];
        if (before != kWhole && m[k] != kWhole) {
          triangles.push_back({before, t[k], m[k]});
        } else {
          rest.push_back(t[k]);
        }
        if (m[k] != kWhole) rest.push_back(m[k]);
      }
      for (std::size_t k = 2; k < rest.size(); ++k) triangles.push_back({rest[0], rest[k - 1], rest[k]});
    }
    mesh.triangles = std::move(triangles);
  }
}

/// The hull of triangles that lie in a plane, made `thickness` (m) thick inwards: one side of a wall is often a part of
/// its own. Nothing for slivers that carry nothing.
std::optional<geometry::TriangleMesh> plate(const geometry::TriangleMesh& mesh,
                                            const std::vector<std::size_t>& triangles, double thickness) {
  Vector3d area = Vector3d::Zero();
  std::vector<Vector3d> points;
  for (const std::size_t i : triangles) {
    const auto& t = mesh.triangles[i];
    const Vector3d& a = mesh.vertices[t[0]];
    area += 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (const std::uint32_t corner : t) points.push_back(mesh.vertices[corner]);
  }
  if (area.norm() < thickness * thickness) return std::nullopt;
  const std::size_t count = points.size();
  for (std::size_t i = 0; i < count; ++i) points.push_back(points[i] - thickness * area.normalized());
  auto hull = geometry::convex_hull(points);
  if (!hull || !make_polytope(hull->vertices)) return std::nullopt;
  return *std::move(hull);
}

core::Result<std::vector<geometry::TriangleMesh>> decompose(const geometry::TriangleMesh& input,
                                                            const DecompositionSettings& settings) {
  if (const auto whole = make_polytope(input.vertices); !whole) return whole.status();
  const double diagonal = geometry::bounding_box(input).sizes().norm();
  const geometry::TriangleMesh mesh = refined(geometry::simplified(input, kMaxTriangles), kLongestEdge * diagonal);
  std::vector<HACD::Vec3<HACD::Real>> points;
  points.reserve(mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<HACD::Vec3<long>> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    triangles.emplace_back(static_cast<long>(t[0]), static_cast<long>(t[1]), static_cast<long>(t[2]));
  }
  HACD::HACD hacd;
  hacd.SetPoints(points.data());
  hacd.SetNPoints(points.size());
  hacd.SetTriangles(triangles.data());
  hacd.SetNTriangles(triangles.size());
  hacd.SetScaleFactor(kScale);
  hacd.SetCompacityWeight(0.1);
  hacd.SetVolumeWeight(0.0);
  hacd.SetNClusters(static_cast<std::size_t>(std::max(1, settings.min_parts)));
  hacd.SetConcavity(settings.concavity * kScale);
  hacd.SetNVerticesPerCH(static_cast<std::size_t>(std::max(8, settings.max_part_vertices)));
  hacd.SetConnectDist(30.0);
  // Without these, dents are looked for from corners of the own part only, and thin walls fill what they surround.
  hacd.SetAddExtraDistPoints(true);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  if (!hacd.Compute()) {
    return core::invalid_input("convex decomposition failed; give the mesh's convex parts instead (convex_parts)");
  }
  std::vector<std::vector<std::size_t>> triangles_of(hacd.GetNClusters());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    triangles_of[static_cast<std::size_t>(hacd.GetPartition()[i])].push_back(i);
  }
  std::vector<geometry::TriangleMesh> parts;
  for (std::size_t i = 0; i < hacd.GetNClusters(); ++i) {
    std::vector<HACD::Vec3<HACD::Real>> corners(hacd.GetNPointsCH(i));
    std::vector<HACD::Vec3<long>> faces(hacd.GetNTrianglesCH(i));
    hacd.GetCH(i, corners.data(), faces.data());
    geometry::TriangleMesh part;
    for (const auto& c : corners) part.vertices.emplace_back(c.X(), c.Y(), c.Z());
    for (const auto& f : faces) {
      part.triangles.push_back(
          {static_cast<std::uint32_t>(f.X()), static_cast<std::uint32_t>(f.Y()), static_cast<std::uint32_t>(f.Z())});
    }
    if (make_polytope(part.vertices)) {
      parts.push_back(std::move(part));
    } else if (auto sheet = plate(mesh, triangles_of[i], settings.concavity * diagonal)) {
      parts.push_back(std::move(*sheet));
    }
  }
  if (parts.empty()) {
    return core::invalid_input("convex decomposition found no part with a volume; check the mesh's scale");
  }
  return parts;
}

}  // namespace

Decomposer hacd_decomposer() { return decompose; }

}  // namespace prescene::simulation
