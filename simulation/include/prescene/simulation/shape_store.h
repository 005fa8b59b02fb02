// SPDX-License-Identifier: Apache-2.0
// Shapes that are expensive to make, made once: convex parts of meshes, spheres that stand for meshes, and prepared
// static triangle meshes, keyed by the mesh's content and the settings. What comes out is shared and never changes, so
// that any number of simulators and threads may hold it. Meshes do not change any more once they were given.
//
//   ShapeStore shapes(decomposer);  // one is in prescene/simulation/bullet/convex_decomposition.h
//   auto parts = shapes.convex_parts(mesh, belief::MeshUse::kConvexHull, {});
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/simulation/convex_polytope.h"
#include "prescene/simulation/simplified_polytope.h"

namespace prescene::collision {
struct SurfaceSpheres;
}

namespace prescene::simulation {

/// How a mesh is cut into (about) convex parts.
struct DecompositionSettings {
  /// Depth of a dent that may be filled, as a share of the mesh's bounding diagonal, in (0, 1].
  double concavity = 0.01;
  int min_parts = 1;           ///< >= 1
  int max_part_vertices = 64;  ///< >= 8; hulls with more are simplified by the decomposer.
  friend bool operator==(const DecompositionSettings&, const DecompositionSettings&) = default;
};

/// Cuts a mesh into parts that are each nearly convex; the caller takes their hulls.
using Decomposer = std::function<core::Result<std::vector<geometry::TriangleMesh>>(
    const geometry::TriangleMesh& mesh, const DecompositionSettings& settings)>;

/// The convex parts that stand for a mesh in contacts, in the mesh's frame.
using ConvexParts = std::vector<ConvexPolytope>;

/// A static triangle mesh with what contact finding has to know of its edges.
struct StaticMesh {
  geometry::TriangleMesh mesh;
  /// Per triangle a bit k for the edge from corner k to corner k + 1: set when the edge is a ridge (convex) or a
  /// border. Contacts at other edges (flat seams, valleys) must take the triangle's own normal, or bodies trip over
  /// seams.
  std::vector<std::uint8_t> ridges;
};

/// Thread-safe. Two threads that ask for the same shape at once: one makes it, the other waits.
class ShapeStore {
 public:
  /// Without a decomposer, MeshUse::kDecompose fails with kUnsupported.
  explicit ShapeStore(Decomposer decomposer = nullptr) : decomposer_(std::move(decomposer)) {}

  /// The parts of a mesh under kConvexHull, kConvexParts or kDecompose. Fails with kInvalidInput for flat or empty
  /// parts and kUnsupported for kSurface
  /// and kSpheres.
  core::Result<std::shared_ptr<const ConvexParts>> convex_parts(const belief::MeshPtr& mesh, belief::MeshUse use,
                                                                const DecompositionSettings& settings);
  /// Each of convex_parts() with round edges, within `limits`; `radii[i]` (m) is wished for the i-th.
  core::Result<std::shared_ptr<const std::vector<RoundedPolytope>>> rounded_parts(const belief::MeshPtr& mesh,
                                                                                  belief::MeshUse use,
                                                                                  const DecompositionSettings& settings,
                                                                                  const std::vector<double>& radii,
                                                                                  const PolytopeLimits& limits);
  /// The spheres that stand for a mesh under kSpheres (collision/spheres/surface_spheres.h). Fails with kInvalidInput
  /// when the mesh is open, inside out or empty, or a setting is out of range.
  core::Result<std::shared_ptr<const collision::SurfaceSpheres>> surface_spheres(
      const belief::MeshPtr& mesh, const belief::SphereSettings& settings);
  /// Fails with kInvalidInput when the mesh has no triangle.
  core::Result<std::shared_ptr<const StaticMesh>> static_mesh(const belief::MeshPtr& mesh);

  /// What a stepper makes of a mesh for itself, kept like the shapes above. `settings` tells apart whatever else `make`
  /// depends on, what kind of thing it makes included.
  using Made = std::shared_ptr<const void>;
  core::Result<Made> made(const belief::MeshPtr& mesh, std::uint64_t settings,
                          const std::function<core::Result<Made>()>& make);

  /// How many shapes have been made so far (not found), for tests and statistics.
  std::size_t built() const;

 private:
  using Key = std::pair<std::uint64_t, std::uint64_t>;  // content of the mesh, settings
  template <class Value>
  struct Slot {
    std::once_flag once;
    core::Result<std::shared_ptr<const Value>> value = core::Result<std::shared_ptr<const Value>>(nullptr);
  };
  template <class Value>
  using Slots = std::map<Key, std::shared_ptr<Slot<Value>>>;

  template <class Value, class Build>
  core::Result<std::shared_ptr<const Value>> find_or_build(Slots<Value>& slots, const Key& key, const Build& build);

  Decomposer decomposer_;
  mutable std::mutex mutex_;
  Slots<ConvexParts> parts_;
  Slots<std::vector<RoundedPolytope>> rounded_;
  Slots<collision::SurfaceSpheres> spheres_;
  Slots<StaticMesh> meshes_;
  Slots<Made> made_;
  std::size_t built_ = 0;
};

}  // namespace prescene::simulation
