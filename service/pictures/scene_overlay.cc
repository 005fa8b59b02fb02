// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/scene_overlay.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "prescene/interfaces/reports/lettering.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/service/pictures/belief_overlay.h"

namespace prescene::service {
namespace {

// Depth cameras measure a table within 2 cm at the distances of a table; farther away the error grows with depth.
constexpr double kFits = 0.02;

SurroundingsFit fit_of(const geometry::DepthImage& expected, const geometry::DepthImage& measured) {
  SurroundingsFit fit;
  std::vector<float> differences;
  std::size_t in_view = 0;
  std::size_t fitting = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const float z = expected.data()[i];
    if (!(z > 0.0F)) continue;
    ++in_view;
    if (!(measured.data()[i] > 0.0F)) continue;
    const float difference = measured.data()[i] - z;
    differences.push_back(difference);
    fitting += std::abs(static_cast<double>(difference)) <= kFits * std::max(1.0, static_cast<double>(z)) ? 1 : 0;
  }
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
  };
  fit.in_view = share(in_view, expected.size());
  fit.measured = share(differences.size(), in_view);
  fit.fitting = share(fitting, differences.size());
  if (differences.empty()) return fit;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  fit.median_difference = static_cast<double>(*middle);
  return fit;
}

/// Names at the middles of what is seen of each instance.
void write_names(const geometry::LabelImage& labels, const std::vector<std::string>& names,
                 geometry::ColorImage& picture) {
  struct Middle {
    double x = 0.0, y = 0.0;
    int pixels = 0;
  };
  std::vector<Middle> middles(names.size());
  for (int y = 0; y < labels.height(); ++y) {
    for (int x = 0; x < labels.width(); ++x) {
      if (labels(x, y) == 0 || labels(x, y) > names.size()) continue;
      Middle& middle = middles[labels(x, y) - 1U];
      middle.x += x;
      middle.y += y;
      ++middle.pixels;
    }
  }
  const double height = std::max(8.0, 0.018 * picture.height());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (middles[i].pixels < 20) continue;
    const double n = middles[i].pixels;
    interfaces::draw_label(names[i], {middles[i].x / n, middles[i].y / n}, height, {20, 20, 20}, picture,
                           interfaces::TextAlign::kCenter);
  }
}

}  // namespace

core::Result<SceneOverlay> scene_overlay(const belief::Scene& scene, const belief::Observation& observation,
                                         Backends& backends) {
  std::vector<geometry::Pose> X_WG;
  for (const belief::KinematicBody& body : scene.robot) {
    const auto known = observation.robot.find(body.name);
    X_WG.push_back(known == observation.robot.end() ? belief::pose_at(body, 0.0) : known->second);
  }
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const filter::BeliefView around =
      filter::known_surroundings(scene, X_WG, filter::MeshDetail::kDisplay, backends.meshes());
  SceneOverlay overlay;
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer->render(around.scene, observation.frame.camera, observation.X_WC, {}, &view));
  overlay.fit = fit_of(view.depth, *observation.frame.depth);

  rendering::RenderScene drawn;
  std::vector<std::string> names;
  for (const belief::SceneObject& object : scene.objects) {
    const auto* box = std::get_if<belief::BoxPose>(&object.pose);
    if (box != nullptr && box->any_rotation) continue;  // it may lie anyhow: its mean says nothing
    const belief::ObjectModel& model = scene.model_of(object);
    drawn.instances.push_back({backends.meshes().get(model.visual, model.collision, filter::MeshDetail::kDisplay),
                               mean(object.pose), filter::material_of(model.surface, model.color)});
    names.push_back(object.name);
  }
  drawn.instances.insert(drawn.instances.end(), around.scene.instances.begin(), around.scene.instances.end());
  names.insert(names.end(), around.names.begin(), around.names.end());
  PRESCENE_RETURN_IF_ERROR(renderer->render(drawn, observation.frame.camera, observation.X_WC, {}, &view));
  std::vector<std::optional<geometry::Rgb>> colors;
  for (std::size_t i = 0; i < names.size(); ++i) colors.emplace_back(interfaces::series_color(i));
  overlay.picture = picture_of(observation);
  interfaces::tint(view.labels, colors, 0.2, overlay.picture);
  interfaces::draw_outlines(view.labels, colors, 2, overlay.picture);
  write_names(view.labels, names, overlay.picture);
  return overlay;
}

}  // namespace prescene::service
