// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/belief_overlay.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "prescene/filter/proposals/support_tracking.h"
#include "prescene/interfaces/reports/overlay.h"

namespace prescene::service {
namespace {

/// The published objects that are not lost, then supports and the robot, as a scene to draw; supports that were found
/// in the sequence count among the objects that are outlined.
rendering::RenderScene scene_at(const belief::Scene& scene, const BeliefSummary& summary,
                                const belief::Observation& observation, filter::MeshCache& meshes,
                                std::size_t* objects) {
  rendering::RenderScene drawn;
  for (const ObjectSummary& object : summary.objects) {
    const auto model =
        std::find_if(scene.models.begin(), scene.models.end(), [&](const auto& m) { return m.name == object.model; });
    if (model == scene.models.end() || object.state == belief::TrackState::kLost) continue;
    drawn.instances.push_back({meshes.get(model->visual, model->collision, filter::MeshDetail::kDisplay), object.X_WO,
                               filter::material_of(model->surface, model->color)});
  }
  *objects = drawn.instances.size();
  std::vector<geometry::Pose> X_WG;
  for (const belief::KinematicBody& body : scene.robot) {
    const auto known = observation.robot.find(body.name);
    X_WG.push_back(known == observation.robot.end() ? belief::pose_at(body, 0.0) : known->second);
  }
  for (const belief::Support& support : scene.supports) {
    if (!filter::is_found_support(support.name)) continue;
    drawn.instances.push_back({meshes.get(support.visual, support.collision, filter::MeshDetail::kDisplay),
                               support.X_WS, filter::material_of(belief::SurfaceKind::kOpaque, support.color)});
    ++*objects;
  }
  const filter::BeliefView around = filter::known_surroundings(scene, X_WG, filter::MeshDetail::kDisplay, meshes);
  drawn.instances.insert(drawn.instances.end(), around.scene.instances.begin(), around.scene.instances.end());
  return drawn;
}

}  // namespace

geometry::ColorImage picture_of(const belief::Observation& observation) {
  if (observation.frame.color) return *observation.frame.color;
  return interfaces::depth_picture(*observation.frame.depth, 0.2, 2.0);
}

core::Result<geometry::ColorImage> belief_overlay(const belief::Scene& scene, const BeliefSummary& summary,
                                                  const belief::Observation& observation, Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  std::size_t objects = 0;
  const rendering::RenderScene drawn = scene_at(scene, summary, observation, backends.meshes(), &objects);
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer->render(drawn, observation.frame.camera, observation.X_WC, {}, &view));
  std::vector<std::optional<geometry::Rgb>> colors;
  for (std::size_t object = 0; object < objects; ++object) colors.emplace_back(interfaces::series_color(object));
  geometry::ColorImage picture = picture_of(observation);
  interfaces::tint(view.labels, colors, 0.25, picture);
  interfaces::draw_outlines(view.labels, colors, 2, picture);
  return picture;
}

}  // namespace prescene::service
