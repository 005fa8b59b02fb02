// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/render_scene.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/filter/proposals/facets.h"
#include "prescene/filter/proposals/resting_starts.h"
#include "prescene/geometry/mesh_facts.h"

namespace prescene::filter {
namespace {

// Times as many as for likelihoods.
constexpr int kFineTriangles = 5;
constexpr int kSurroundingsTriangles = 50;

geometry::Rgb rgb_of(const belief::Color& color) {
  const auto channel = [](double value) {
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0)));
  };
  return {channel(color.r), channel(color.g), channel(color.b)};
}

void add(BeliefView& view, const std::string& name, InstanceKind kind, rendering::MeshHandle mesh,
         const belief::Pose& X_WM, const rendering::SurfaceMaterial& material) {
  view.scene.instances.push_back({std::move(mesh), X_WM, material});
  view.names.push_back(name);
  view.kinds.push_back(kind);
}

void add_surroundings(BeliefView& view, const belief::Scene& scene, std::span<const belief::Pose> X_WG,
                      MeshDetail detail, MeshCache& meshes) {
  PRESCENE_CHECK(X_WG.size() == scene.robot.size());
  for (const belief::Support& support : scene.supports)
    add(view, support.name, InstanceKind::kSupport, meshes.get(support.visual, support.collision, detail), support.X_WS,
        material_of(belief::SurfaceKind::kOpaque, support.color));
  for (std::size_t i = 0; i < scene.robot.size(); ++i) {
    const belief::KinematicBody& body = scene.robot[i];
    add(view, body.name, InstanceKind::kRobot, meshes.get(body.visual, body.collision, detail), X_WG[i],
        material_of(belief::SurfaceKind::kOpaque, body.color));
  }
}

void add_object(BeliefView& view, const std::string& name, const belief::ObjectModel& model, const belief::Pose& X_WO,
                MeshDetail detail, MeshCache& meshes) {
  add(view, name, InstanceKind::kObject, meshes.get(model, detail), X_WO, material_of(model.surface, model.color));
}

}  // namespace

rendering::MeshHandle MeshCache::get(const belief::MeshPtr& mesh, MeshDetail detail) {
  PRESCENE_CHECK(mesh != nullptr);
  const std::lock_guard lock(mutex_);
  Entry& entry = by_address_[{mesh.get(), detail}];
  if (entry.mesh) return entry.mesh;
  entry.source = mesh;
  rendering::MeshHandle& handle = by_content_[{geometry::facts_of(mesh).content, detail}];
  if (!handle) {
    handle = detail == MeshDetail::kDisplay ? rendering::make_render_mesh(*mesh)
                                            : rendering::make_render_mesh(simplified(mesh, detail));
  }
  entry.mesh = handle;
  return handle;
}

geometry::TriangleMesh MeshCache::simplified(const belief::MeshPtr& mesh, MeshDetail detail) {
  const std::uint64_t content = geometry::facts_of(mesh).content;
  const auto at_most = [this](int times) { return times * likelihood_triangles_; };
  const bool is_large = mesh->triangles.size() > static_cast<std::size_t>(at_most(kSurroundingsTriangles));
  if (detail == MeshDetail::kSurroundings) return geometry::simplified(*mesh, at_most(kSurroundingsTriangles));
  if (!is_large) return geometry::simplified(*mesh, at_most(detail == MeshDetail::kFine ? kFineTriangles : 1));
  // Of a scan of 100,000 triangles that takes a second: once will do.
  geometry::TriangleMesh& fine = fine_[content];
  if (fine.empty()) fine = geometry::simplified(*mesh, at_most(kFineTriangles));
  return detail == MeshDetail::kFine ? fine : geometry::simplified(fine, at_most(1));
}

rendering::MeshHandle MeshCache::get(const belief::ObjectModel& model, MeshDetail detail) {
  if (detail != MeshDetail::kDisplay || !model.visual || !model.look) return get(model.visual, model.collision, detail);
  const std::lock_guard lock(mutex_);
  Entry& entry = with_look_[{model.visual.get(), model.look.get()}];
  if (!entry.mesh) entry = {model.visual, model.look, rendering::make_render_mesh(*model.visual, *model.look)};
  return entry.mesh;
}

rendering::MeshHandle MeshCache::get(const belief::MeshPtr& visual,
                                     const std::vector<belief::CollisionShape>& collision, MeshDetail detail) {
  if (visual) return get(visual, detail);
  belief::ObjectModel shapes;
  shapes.collision = collision;
  const geometry::TriangleMesh mesh = belief::collision_mesh(shapes);
  const std::lock_guard lock(mutex_);
  // Collision shapes are parts that simplification would pull apart; they are small enough as they are.
  rendering::MeshHandle& handle = by_content_[{geometry::content_hash(mesh), MeshDetail::kDisplay}];
  if (!handle) handle = rendering::make_render_mesh(mesh);
  return handle;
}

double MeshCache::facet_lever(const rendering::RenderMesh& mesh) {
  const std::lock_guard lock(mutex_);
  const auto [entry, is_new] = facet_levers_.try_emplace(mesh.number.value(), 0.0);
  if (is_new) entry->second = filter::facet_lever(mesh);
  return entry->second;
}

std::shared_ptr<const RestingShape> MeshCache::resting_shape(const rendering::RenderMesh& mesh) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<const RestingShape>& shape = resting_shapes_[mesh.number.value()];
  if (!shape) shape = std::make_shared<const RestingShape>(resting_shape_of(mesh));
  return shape;
}

rendering::SurfaceMaterial material_of(belief::SurfaceKind kind, const belief::Color& color) {
  switch (kind) {
    case belief::SurfaceKind::kTransparent:
      return rendering::SurfaceMaterial::transparent(rgb_of(color));
    case belief::SurfaceKind::kMirror:
      return rendering::SurfaceMaterial::mirror(rgb_of(color));
    case belief::SurfaceKind::kOpaque:
      break;
  }
  return rendering::SurfaceMaterial::opaque(rgb_of(color));
}

BeliefView render_scene(const belief::Scene& scene, const belief::WorldState& state, std::span<const belief::Pose> X_WG,
                        MeshDetail detail, MeshCache& meshes) {
  PRESCENE_CHECK(state.objects.size() == scene.objects.size());
  BeliefView view;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    add_object(view, scene.objects[i].name, scene.model_of(scene.objects[i]), state.objects[i].X_WO, detail, meshes);
  std::vector<belief::Pose> on_timeline;
  if (X_WG.empty()) {
    for (const belief::KinematicBody& body : scene.robot) on_timeline.push_back(belief::pose_at(body, state.time));
    X_WG = on_timeline;
  }
  add_surroundings(view, scene, X_WG, detail, meshes);
  return view;
}

BeliefView render_scene(const belief::Belief& belief, MeshDetail detail, MeshCache& meshes, double min_existence) {
  BeliefView view;
  const belief::Scene& scene = *belief.scene;
  for (const belief::ObjectBelief& object : belief.objects) {
    if (object.existence < min_existence || object.state == belief::TrackState::kLost) continue;
    add_object(view, object.name, scene.models[static_cast<std::size_t>(object.model)],
               belief::heaviest(object.particles).X_WO, detail, meshes);
  }
  add_surroundings(view, scene, belief.robot, detail, meshes);
  return view;
}

BeliefView known_surroundings(const belief::Scene& scene, std::span<const belief::Pose> X_WG, MeshDetail detail,
                              MeshCache& meshes) {
  BeliefView view;
  add_surroundings(view, scene, X_WG, detail, meshes);
  return view;
}

}  // namespace prescene::filter
