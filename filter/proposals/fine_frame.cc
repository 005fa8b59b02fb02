// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/fine_frame.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::filter {
namespace {

constexpr float kSameDepth = 0.015F;    // m, of what is measured from a known thing's surface
constexpr float kListedDepth = 0.015F;  // m; a measurement so near to a listed support shows it

/// False where there is nothing to draw or it could not be drawn; of the latter the filter's WatchedRenderer knows.
bool draw(const BeliefView& view, InstanceKind kind, const geometry::PinholeCamera& camera, const Pose& X_WC,
          rendering::Renderer& renderer, geometry::DepthImage* depth) {
  rendering::RenderScene scene;
  for (std::size_t i = 0; i < view.kinds.size(); ++i)
    if (view.kinds[i] == kind) scene.instances.push_back(view.scene.instances[i]);
  if (scene.instances.empty()) return false;
  rendering::RenderedView drawn;
  if (!renderer.render(scene, camera, X_WC, {}, &drawn).ok()) return false;
  *depth = std::move(drawn.depth);
  return true;
}

/// Walls and sides of supports, and if asked supports that the scene does not list, as they are measured.
geometry::DepthImage background_in(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                                   const Surroundings& surroundings, bool with_supports) {
  geometry::DepthImage shown(terms.camera.width, terms.camera.height);
  for (int y = 0; y < shown.height(); ++y)
    for (int x = 0; x < shown.width(); ++x) {
      const bool is_listed =
          terms.absent_peak(x, y) > 0.0f && std::abs(terms.absent_peak(x, y) - terms.depth(x, y)) < kListedDepth;
      if (!(terms.depth(x, y) > 0.0f)) continue;
      const Eigen::Vector2d pixel = sampled.camera.project(terms.camera.unproject(x, y, 1.0));
      const int u = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, sampled.camera.width - 1);
      const int v = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, sampled.camera.height - 1);
      const std::uint8_t what = surroundings.background(u, v);
      if (what == kWall || (with_supports && what == kSupport && !is_listed)) shown(x, y) = terms.depth(x, y);
    }
  return shown;
}

FineFrame sampled_fine(const FilterFrame& frame, const belief::Scene& scene, const belief::Observation& observation,
                       const FilterTools& tools) {
  const belief::RgbdFrame& rgbd = observation.frame;
  FineFrame fine;
  const int step = rendering::pixel_step(rgbd.camera.width, kFineWidth);
  const int offset = rendering::pixel_offset(step, rgbd.camera.width, rgbd.camera.height);
  const geometry::PinholeCamera camera = rgbd.camera.subsampled(step, offset);
  geometry::DepthImage depth(camera.width, camera.height), supports, robot;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) depth(x, y) = (*rgbd.depth)(offset + step * x, offset + step * y);
  if (rgbd.color && rgbd.color->width() == rgbd.camera.width && rgbd.color->height() == rgbd.camera.height) {
    fine.color = geometry::ColorImage(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) fine.color(x, y) = (*rgbd.color)(offset + step * x, offset + step * y);
  }
  const BeliefView known = known_surroundings(scene, frame.X_WG, MeshDetail::kSurroundings, *tools.meshes);
  rendering::FrameTermsInput input;
  input.camera = camera;
  input.depth = depth.view();
  if (!scene.supports.empty() && draw(known, InstanceKind::kSupport, camera, frame.X_WC, *tools.renderer, &supports))
    input.background = supports.view();
  rendering::FrameTermsOptions options;
  options.target_width = camera.width;
  options.tempering = frame.tempering;
  rendering::FrameTerms& terms = fine.terms;
  PRESCENE_CHECK(make_frame_terms(input, options, frame.terms.model, &terms).ok());
  // The frame's own image may be a reduced one.
  const int own = rgbd.camera.width / std::max(1, frame.terms.camera.width);
  terms.step = std::max(1, step * frame.terms.step / std::max(1, own));
  for (std::size_t i = 0; i < terms.absent_peak.size(); ++i)
    if (!(terms.absent_peak.data()[i] > 0.0F)) terms.absent_missing.data()[i] = -1.0F;
  const auto nearest = [](int at, int size, int from) { return std::min(at * size / from, size - 1); };
  for (const geometry::Image<float>& coarse : frame.terms.color_ratio) {
    geometry::Image<float> ratio(camera.width, camera.height);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        ratio(x, y) = coarse(nearest(x, coarse.width(), camera.width), nearest(y, coarse.height(), camera.height));
    terms.color_ratio.push_back(std::move(ratio));
  }
  if (draw(known, InstanceKind::kRobot, camera, frame.X_WC, *tools.renderer, &robot))
    with_known_surfaces(terms, robot, &terms);
  return fine;
}

}  // namespace

FineFrame fine_frame(const FilterFrame& frame, const belief::Scene& scene, const belief::Observation& observation,
                     const FilterTools& tools) {
  return fine_frame(frame, scene, observation, tools,
                    measure_edge_smear(*observation.frame.depth, observation.frame.color.get()));
}

FineFrame fine_frame(const FilterFrame& frame, const belief::Scene& scene, const belief::Observation& observation,
                     const FilterTools& tools, const EdgeSmear& smear) {
  FineFrame fine = sampled_fine(frame, scene, observation, tools);
  fine.smear = smear;
  return fine;
}

FineFrame fine_frame_if_sharp(const FilterFrame& frame, const belief::Scene& scene,
                              const belief::Observation& observation, const FilterTools& tools) {
  const EdgeSmear smear = measure_edge_smear(*observation.frame.depth, observation.frame.color.get());
  FineFrame fine;
  if (smear.is_sharp()) fine = sampled_fine(frame, scene, observation, tools);
  fine.smear = smear;
  return fine;
}

void with_coarse_known(const geometry::DepthImage& known, const geometry::PinholeCamera& camera,
                       rendering::FrameTerms& fine) {
  if (known.empty() || fine.depth.empty()) return;
  geometry::DepthImage depth(fine.camera.width, fine.camera.height);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const Eigen::Vector2d pixel = camera.project(fine.camera.unproject(x, y, 1.0));
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      const float z = fine.depth(x, y);
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) {
          if (u + du < 0 || v + dv < 0 || u + du >= known.width() || v + dv >= known.height()) continue;
          const float surface = known(u + du, v + dv);
          if (surface > 0.0F && z > 0.0F && std::abs(z - surface) < kSameDepth) depth(x, y) = z;
        }
      const bool inside = u >= 0 && v >= 0 && u < known.width() && v < known.height();
      if (depth(x, y) == 0.0F && inside) depth(x, y) = known(u, v);
    }
  with_known_surfaces(fine, depth, &fine);
}

rendering::FrameTerms with_background(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                                      const Surroundings& surroundings) {
  rendering::FrameTerms result;
  with_known_surfaces(terms, background_in(terms, sampled, surroundings, true), &result);
  return result;
}

rendering::FrameTerms with_walls(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                                 const Surroundings& surroundings) {
  rendering::FrameTerms result;
  with_known_surfaces(terms, background_in(terms, sampled, surroundings, false), &result);
  return result;
}

}  // namespace prescene::filter
