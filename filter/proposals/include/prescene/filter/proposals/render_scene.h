// SPDX-License-Identifier: Apache-2.0
// The one conversion from beliefs and world states to what renderers draw: meshes made once and kept by content, looks
// of surfaces, and the order of instances.
//
//   MeshCache meshes;
//   BeliefView view = render_scene(belief, MeshDetail::kDisplay, meshes);
//   renderer->render(view.scene, camera, belief.X_WC, {}, &images);
//   view.names[images.labels(x, y) - 1];            // what a pixel shows
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::filter {

struct RestingShape;  // prescene/filter/proposals/resting_starts.h

/// How fine a mesh is drawn.
enum class MeshDetail {
  kLikelihood,    ///< Simplified: finer meshes gave no better pose on real frames.
  kFine,          ///< For images whose pixels are 3 to 4 mm wide at 1 m: there the simplified one is not exact enough.
  kSurroundings,  ///< For supports and bodies of the robot in what the filter draws of them in each frame.
  kDisplay,       ///< As it is.
};

/// Meshes as renderers want them, made on first use and kept. Safe to call from several threads.
class MeshCache {
 public:
  /// Meshes for likelihoods have at most so many triangles (>= 4), those for fine images five times as many, those of
  /// surroundings fifty times as many. Of meshes with more than the last, the coarsest are made of the fine ones.
  explicit MeshCache(int likelihood_triangles = 400) : likelihood_triangles_(likelihood_triangles) {}

  /// Never null. The cache keeps `mesh` alive, so that its address stays its name.
  rendering::MeshHandle get(const belief::MeshPtr& mesh, MeshDetail detail);
  /// The visual mesh of a model, support or robot body, or the mesh of its collision shapes where it has none.
  rendering::MeshHandle get(const belief::MeshPtr& visual, const std::vector<belief::CollisionShape>& collision,
                            MeshDetail detail);

  /// Of a model, with its look if it is for display.
  rendering::MeshHandle get(const belief::ObjectModel& model, MeshDetail detail);

  /// facet_lever() (facets.h) of a mesh that get() returned.
  double facet_lever(const rendering::RenderMesh& mesh);
  /// resting_shape_of() (resting_starts.h) of a mesh that get() returned. Never null.
  std::shared_ptr<const RestingShape> resting_shape(const rendering::RenderMesh& mesh);

 private:
  struct Entry {
    belief::MeshPtr source;
    geometry::LookPtr look;
    rendering::MeshHandle mesh;
  };
  /// With the mutex held.
  geometry::TriangleMesh simplified(const belief::MeshPtr& mesh, MeshDetail detail);

  int likelihood_triangles_;
  std::mutex mutex_;
  std::map<std::pair<const geometry::TriangleMesh*, MeshDetail>, Entry> by_address_;
  std::map<std::pair<const geometry::TriangleMesh*, const geometry::MeshLook*>, Entry> with_look_;
  std::map<std::pair<std::uint64_t, MeshDetail>, rendering::MeshHandle> by_content_;
  std::map<std::uint64_t, geometry::TriangleMesh> fine_;  // of large meshes, by content
  // By the mesh's unique number.
  std::map<std::uint64_t, double> facet_levers_;
  std::map<std::uint64_t, std::shared_ptr<const RestingShape>> resting_shapes_;
};

rendering::SurfaceMaterial material_of(belief::SurfaceKind kind, const belief::Color& color);

/// What stands at which index of a rendered scene.
enum class InstanceKind { kObject, kSupport, kRobot };
struct BeliefView {
  rendering::RenderScene scene;     ///< Objects in their order, then supports, then robot bodies.
  std::vector<std::string> names;   ///< Of each instance.
  std::vector<InstanceKind> kinds;  ///< Robot bodies are known occluders.
};

/// A world state with robot bodies at `X_WG` (in the order of Scene::robot; empty = where their timelines say at the
/// state's time). state.objects.size() == scene.objects.size().
BeliefView render_scene(const belief::Scene& scene, const belief::WorldState& state, std::span<const belief::Pose> X_WG,
                        MeshDetail detail, MeshCache& meshes);

/// The heaviest particle of each object that is believed to be there (existence >= `min_existence` and not lost), with
/// supports and robot.
BeliefView render_scene(const belief::Belief& belief, MeshDetail detail, MeshCache& meshes, double min_existence = 0.5);

/// Supports and robot bodies alone: what is known without looking.
BeliefView known_surroundings(const belief::Scene& scene, std::span<const belief::Pose> X_WG, MeshDetail detail,
                              MeshCache& meshes);

}  // namespace prescene::filter
