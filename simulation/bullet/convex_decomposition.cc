// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/bullet/convex_decomposition.h"

#include <hacdHACD.h>

#include <algorithm>
#include <cmath>

namespace prescene::simulation {
namespace {

// HACD is quadratic in the triangles; a contact shape needs no more.
constexpr int kMaxTriangles = 2000;
// HACD measures concavity on data scaled to this size.
constexpr double kScale = 1000.0;

core::Result<std::vector<geometry::TriangleMesh>> decompose(const geometry::TriangleMesh& input,
                                                            const DecompositionSettings& settings) {
  const geometry::TriangleMesh mesh = geometry::simplified(input, kMaxTriangles);
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
  hacd.SetAddExtraDistPoints(false);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  if (!hacd.Compute()) {
    return core::invalid_input("convex decomposition failed; give the mesh's convex parts instead (convex_parts)");
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
    if (make_polytope(part.vertices)) parts.push_back(std::move(part));  // flat slivers carry nothing
  }
  if (parts.empty()) {
    return core::invalid_input("convex decomposition found no part with a volume; check the mesh's scale");
  }
  return parts;
}

}  // namespace

Decomposer hacd_decomposer() { return decompose; }

}  // namespace prescene::simulation
