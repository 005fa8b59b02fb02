// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/shape_store.h"

#include <array>
#include <cmath>
#include <string>

#include "prescene/collision/mesh.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/core/check.h"
#include "prescene/core/hash.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/mesh_facts.h"
#include "scan_hull.h"

namespace prescene::simulation {
namespace {

using geometry::TriangleMesh;

// An edge whose faces differ by less than this (rad) is flat: 2 degrees, what tessellated curved walls do not need.
constexpr double kFlatAngle = 0.035;

std::uint64_t settings_hash(belief::MeshUse use, const DecompositionSettings& settings) {
  core::Hasher hasher;
  hasher.value(use);
  if (use == belief::MeshUse::kDecompose) {
    hasher.value(settings.concavity).value(settings.min_parts).value(settings.max_part_vertices);
  }
  return hasher.digest();
}

core::Result<ConvexParts> hulls_of(const std::vector<TriangleMesh>& meshes) {
  ConvexParts parts;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    core::Result<ConvexPolytope> hull = hull_of_scan(meshes[i].vertices);
    if (!hull) return hull.status().at("convex part " + std::to_string(i + 1));
    parts.push_back(std::move(*hull));
  }
  if (parts.empty()) return core::invalid_input("the mesh has no triangle; check its file");
  return parts;
}

core::Result<ConvexParts> build_parts(const TriangleMesh& mesh, belief::MeshUse use,
                                      const DecompositionSettings& settings, const Decomposer& decomposer) {
  switch (use) {
    case belief::MeshUse::kConvexHull:
      return hulls_of({mesh});
    case belief::MeshUse::kConvexParts:
      return hulls_of(geometry::connected_components(mesh));
    case belief::MeshUse::kDecompose: {
      if (!decomposer) {
        return core::unsupported("convex decomposition is not built in; use convex_hull or convex_parts");
      }
      PRESCENE_TRY(const auto pieces, decomposer(mesh, settings));
      return hulls_of(pieces);
    }
    case belief::MeshUse::kSurface:
      return core::unsupported("a triangle surface has no convex parts; only fixed things can use it");
    case belief::MeshUse::kSpheres:
      break;
  }
  return core::unsupported("a mesh of spheres has no convex parts; use convex_hull, convex_parts or decompose");
}

using EdgeKey = std::pair<std::array<double, 3>, std::array<double, 3>>;

// Corners by position, so that meshes with split vertices (one per face) still know their neighbours.
EdgeKey edge_key(const Vector3d& a, const Vector3d& b) { return {{a.x(), a.y(), a.z()}, {b.x(), b.y(), b.z()}}; }

StaticMesh build_static(const TriangleMesh& mesh) {
  StaticMesh result{mesh, std::vector<std::uint8_t>(mesh.triangles.size(), 0)};
  std::map<EdgeKey, std::uint32_t> directed;
  const auto corner = [&](std::uint32_t triangle, int k) -> const Vector3d& {
    return mesh.vertices[mesh.triangles[triangle][static_cast<std::size_t>(k % 3)]];
  };
  const auto normal = [&](std::uint32_t triangle) {
    return Vector3d((corner(triangle, 1) - corner(triangle, 0)).cross(corner(triangle, 2) - corner(triangle, 0)))
        .normalized();
  };
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) {
    for (int k = 0; k < 3; ++k) directed.emplace(edge_key(corner(t, k), corner(t, k + 1)), t);
  }
  for (std::uint32_t t = 0; t < count; ++t) {
    const Vector3d n = normal(t);
    for (int k = 0; k < 3; ++k) {
      const auto twin = directed.find(edge_key(corner(t, k + 1), corner(t, k)));
      bool ridge = true;
      if (twin != directed.end()) {
        // The neighbour's third corner lies below this triangle's plane at a ridge, above it in a valley.
        const Vector3d m = normal(twin->second);
        const Vector3d edge = (corner(t, k + 1) - corner(t, k)).normalized();
        ridge = n.cross(m).dot(edge) > std::sin(kFlatAngle) || n.dot(m) < -0.999;
      }
      if (ridge) result.ridges[t] = static_cast<std::uint8_t>(result.ridges[t] | (1u << k));
    }
  }
  return result;
}

}  // namespace

template <class Value, class Build>
core::Result<std::shared_ptr<const Value>> ShapeStore::find_or_build(Slots<Value>& slots, const Key& key,
                                                                     const Build& build) {
  std::shared_ptr<Slot<Value>> slot;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::shared_ptr<Slot<Value>>& entry = slots[key];
    if (!entry) entry = std::make_shared<Slot<Value>>();
    slot = entry;
  }
  std::call_once(slot->once, [&] {
    core::Result<Value> value = build();
    if (value) {
      slot->value = std::make_shared<const Value>(std::move(*value));
    } else {
      slot->value = value.status();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++built_;
  });
  return slot->value;
}

core::Result<std::shared_ptr<const ConvexParts>> ShapeStore::convex_parts(const belief::MeshPtr& mesh,
                                                                          belief::MeshUse use,
                                                                          const DecompositionSettings& settings) {
  const Key key{geometry::facts_of(mesh).content, settings_hash(use, settings)};
  return find_or_build(parts_, key, [&] { return build_parts(*mesh, use, settings, decomposer_); });
}

core::Result<std::shared_ptr<const std::vector<RoundedPolytope>>> ShapeStore::rounded_parts(
    const belief::MeshPtr& mesh, belief::MeshUse use, const DecompositionSettings& settings,
    const std::vector<double>& radii, const PolytopeLimits& limits) {
  PRESCENE_TRY(const auto parts, convex_parts(mesh, use, settings));
  PRESCENE_CHECK(radii.size() == parts->size());
  core::Hasher hasher;
  hasher.value(settings_hash(use, settings)).value(limits.vertices).value(limits.corners);
  for (const double radius : radii) hasher.value(radius);
  const Key key{geometry::facts_of(mesh).content, hasher.digest()};
  return find_or_build(rounded_, key, [&]() -> core::Result<std::vector<RoundedPolytope>> {
    std::vector<RoundedPolytope> result;
    for (std::size_t i = 0; i < parts->size(); ++i) {
      core::Result<RoundedPolytope> part = rounded((*parts)[i], radii[i], limits);
      if (!part) return part.status().at("convex part " + std::to_string(i + 1));
      result.push_back(*std::move(part));
    }
    return result;
  });
}

core::Result<std::shared_ptr<const collision::SurfaceSpheres>> ShapeStore::surface_spheres(
    const belief::MeshPtr& mesh, const belief::SphereSettings& settings) {
  core::Hasher hasher;
  hasher.value(settings.count).value(settings.edge_fidelity);
  const Key key{geometry::facts_of(mesh).content, hasher.digest()};
  return find_or_build(spheres_, key, [&]() -> core::Result<collision::SurfaceSpheres> {
    if (mesh->empty()) return core::invalid_input("the mesh has no triangle; check its file");
    PRESCENE_TRY(const auto single, collision::Mesh::make(*mesh, "of spheres"));
    core::ThreadPool pool(1);
    return collision::cover_surface(single, {settings.count, settings.edge_fidelity}, pool);
  });
}

core::Result<std::shared_ptr<const StaticMesh>> ShapeStore::static_mesh(const belief::MeshPtr& mesh) {
  const Key key{geometry::facts_of(mesh).content, 0};
  return find_or_build(meshes_, key, [&]() -> core::Result<StaticMesh> {
    if (mesh->empty()) return core::invalid_input("the mesh has no triangle; check its file");
    return build_static(*mesh);
  });
}

core::Result<ShapeStore::Made> ShapeStore::made(const belief::MeshPtr& mesh, std::uint64_t settings,
                                                const std::function<core::Result<Made>()>& make) {
  PRESCENE_TRY(const auto kept, find_or_build(made_, Key{geometry::facts_of(mesh).content, settings}, make));
  return *kept;
}

std::size_t ShapeStore::built() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return built_;
}

}  // namespace prescene::simulation
