// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/explanation_strip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "prescene/filter/proposals/render_scene.h"
#include "prescene/interfaces/reports/overlay.h"
#include "prescene/queries/camera_name.h"
#include "prescene/service/pictures/belief_overlay.h"

namespace prescene::service {
namespace {

constexpr double kFullDifference = 0.05;  // m
constexpr geometry::Rgb kUnknownDifference = {176, 178, 180}, kStripGap = {255, 255, 255};
constexpr int kStripGapWidth = 4;  // pixels

core::Result<rendering::RenderedView> explained_view(const queries::WindowFrame& frame,
                                                     const queries::DecidingFrame& deciding,
                                                     const queries::ExplainAnswer& answer,
                                                     rendering::Renderer& renderer, filter::MeshCache& meshes) {
  const belief::Belief& belief = *frame.belief;
  const belief::Scene& scene = *belief.scene;
  filter::BeliefView view = filter::known_surroundings(scene, belief.robot, filter::MeshDetail::kDisplay, meshes);
  for (std::size_t i = 0; i < deciding.X_WO.size(); ++i) {
    const auto object = belief::find_object(belief, answer.objects[i].object);
    if (!deciding.X_WO[i] || !object) continue;
    const belief::ObjectModel& model = belief::model_of(belief, belief.objects[static_cast<std::size_t>(*object)]);
    view.scene.instances.push_back({meshes.get(model.visual, model.collision, filter::MeshDetail::kDisplay),
                                    *deciding.X_WO[i], filter::material_of(model.surface, model.color)});
  }
  rendering::RenderOptions options;
  options.color = true;
  rendering::RenderedView drawn;
  PRESCENE_RETURN_IF_ERROR(
      renderer.render(view.scene, frame.observation.frame.camera, frame.observation.X_WC, options, &drawn));
  return drawn;
}

}  // namespace

geometry::ColorImage depth_difference_picture(const geometry::DepthImage& measured,
                                              const geometry::DepthImage& explained) {
  geometry::ColorImage picture(measured.width(), measured.height(), kUnknownDifference);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const float seen = measured(x, y), drawn = explained(x, y);
      if (seen > 0.0F && std::isfinite(seen) && drawn > 0.0F)
        picture(x, y) = interfaces::divergence_color(static_cast<double>(seen - drawn) / kFullDifference);
    }
  return picture;
}

core::Result<std::vector<ExplanationStrip>> explanation_strips(const queries::ExplainWindow& window,
                                                               const queries::ExplainAnswer& answer, std::size_t most,
                                                               Backends& backends) {
  std::vector<std::size_t> order(answer.frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto decides = [&](std::size_t i) {
    return std::abs(answer.frames[i].against_nothing) + std::abs(answer.frames[i].against_second);
  };
  // Of frames that decide as much, as where nothing happened, the later ones.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return decides(a) != decides(b) ? decides(a) > decides(b) : a > b;
  });
  order.resize(std::min(most, order.size()));
  std::sort(order.begin(), order.end());
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  std::vector<ExplanationStrip> strips;
  for (const std::size_t i : order) {
    const queries::DecidingFrame& deciding = answer.frames[i];
    if (deciding.frame >= window.frames.size() || deciding.X_WO.size() != answer.objects.size()) continue;
    const queries::WindowFrame& frame = window.frames[deciding.frame];
    PRESCENE_TRY(rendering::RenderedView drawn, explained_view(frame, deciding, answer, *renderer, backends.meshes()));
    ExplanationStrip strip;
    strip.time = deciding.time;
    strip.camera = queries::camera_name(*frame.belief->scene, frame.observation.camera);
    strip.against_nothing = deciding.against_nothing;
    strip.seen = picture_of(frame.observation);
    strip.difference = depth_difference_picture(*frame.observation.frame.depth, drawn.depth);
    strip.explained = std::move(drawn.color);
    strips.push_back(std::move(strip));
  }
  return strips;
}

geometry::ColorImage side_by_side(const ExplanationStrip& strip) {
  const std::array<const geometry::ColorImage*, 3> parts = {&strip.seen, &strip.explained, &strip.difference};
  int width = -kStripGapWidth, height = 0;
  for (const geometry::ColorImage* part : parts) {
    width += part->width() + kStripGapWidth;
    height = std::max(height, part->height());
  }
  geometry::ColorImage picture(width, height, kStripGap);
  int left = 0;
  for (const geometry::ColorImage* part : parts) {
    for (int y = 0; y < part->height(); ++y)
      for (int x = 0; x < part->width(); ++x) picture(left + x, y) = (*part)(x, y);
    left += part->width() + kStripGapWidth;
  }
  return picture;
}

}  // namespace prescene::service
