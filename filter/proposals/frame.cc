// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::filter {
namespace {

constexpr double kMatch = 0.008;          // m: a measurement so near to the pose's surface is taken for it
constexpr int kColorReachWithin = 4;      // pixels between those whose colours are compared within an object
constexpr int kLeastLight = 90;           // of 3 x 255: what is darker has no colour
constexpr double kOtherColor = 0.12;      // sum over channels of the difference between shares of the light
constexpr double kClearlyInFront = 0.02;  // m: a support nearer to the object than this may be what it stands on

core::Status render_depth(const rendering::RenderScene& scene, const geometry::PinholeCamera& camera, const Pose& X_WC,
                          rendering::Renderer& renderer, geometry::DepthImage* depth) {
  *depth = geometry::DepthImage(camera.width, camera.height);
  if (scene.instances.empty()) return core::ok_status();
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer.render(scene, camera, X_WC, {}, &view));
  *depth = std::move(view.depth);
  return core::ok_status();
}

/// The pixels of `full` that the reduced image of make_frame_terms shows.
geometry::DepthImage sampled_like(const geometry::DepthImage& full, const rendering::FrameTerms& terms) {
  const int offset = rendering::pixel_offset(terms.step, full.width(), full.height());
  geometry::DepthImage reduced(terms.camera.width, terms.camera.height);
  for (int y = 0; y < reduced.height(); ++y)
    for (int x = 0; x < reduced.width(); ++x) reduced(x, y) = full(offset + terms.step * x, offset + terms.step * y);
  return reduced;
}

rendering::RenderScene only(const BeliefView& view, InstanceKind kind) {
  rendering::RenderScene scene;
  for (std::size_t i = 0; i < view.kinds.size(); ++i)
    if (view.kinds[i] == kind) scene.instances.push_back(view.scene.instances[i]);
  return scene;
}

/// Whether two pixels show different colours, whatever the light that falls on them.
bool are_other_colors(const geometry::Rgb& a, const geometry::Rgb& b) {
  const int light_a = a[0] + a[1] + a[2], light_b = b[0] + b[1] + b[2];
  if (light_a < kLeastLight || light_b < kLeastLight) return false;
  double difference = 0.0;
  for (std::size_t c = 0; c < 3; ++c)
    difference += std::abs(static_cast<double>(a[c]) / light_a - static_cast<double>(b[c]) / light_b);
  return difference > kOtherColor;
}

}  // namespace

rendering::SensorModelOptions with_settings(rendering::SensorModelOptions options,
                                            const belief::DepthNoiseSettings& noise) {
  options.sigma_per_depth_squared = noise.sigma_per_depth_squared.value_or(options.sigma_per_depth_squared);
  options.incidence_knee = noise.incidence_knee.value_or(options.incidence_knee);
  options.incidence_missing = noise.incidence_missing.value_or(options.incidence_missing);
  options.outline_missing = noise.outline_missing.value_or(options.outline_missing);
  return options;
}

core::Status prepare_frame(const std::shared_ptr<const belief::Scene>& scene, const belief::Observation& observation,
                           std::span<const Pose> X_WG, const FrameColors& colors, const FrameOptions& options,
                           const FilterTools& tools, FrameCache& cache, FilterFrame* frame,
                           const FrameSampling* sampling) {
  const belief::RgbdFrame& rgbd = observation.frame;
  if (!rgbd.depth || rgbd.depth->empty())
    return core::invalid_input("the frame has no depth image: the filter needs one, colour is optional");
  if (!observation.X_WC.is_finite())
    return core::invalid_input("the camera's pose is not finite: check the transform of its frame");
  if (rgbd.color && !rgbd.color->empty() &&
      (rgbd.color->width() != rgbd.depth->width() || rgbd.color->height() != rgbd.depth->height()))
    return core::invalid_input("colour of " + std::to_string(rgbd.color->width()) + " x " +
                               std::to_string(rgbd.color->height()) + " pixels with depth of " +
                               std::to_string(rgbd.depth->width()) + " x " + std::to_string(rgbd.depth->height()) +
                               ": the filter needs colour registered to the depth image");
  for (const Pose& pose : X_WG)
    if (!pose.is_finite()) return core::invalid_input("a robot body's pose is not finite: check its transforms");
  PRESCENE_RETURN_IF_ERROR(geometry::validate_sensor(rgbd.camera).at("the frame's camera"));

  const BeliefView known = known_surroundings(*scene, X_WG, MeshDetail::kSurroundings, *tools.meshes);
  // Scenes are copied where one thing of them changes.
  const bool has_scene = cache.scene != nullptr;
  const bool same_supports = has_scene && (cache.scene == scene || cache.scene->supports == scene->supports);
  const bool same_robot = has_scene && (cache.scene == scene || cache.scene->robot == scene->robot);
  if (!same_supports) cache.surfaces = std::make_shared<const SupportSurfaces>(*scene, *tools.meshes);
  if (!same_robot) {
    cache.robot.assign(scene->robot.size(), {});
    for (std::size_t i = 0; i < scene->robot.size(); ++i) {
      const belief::KinematicBody& body = scene->robot[i];
      cache.robot[i].add(*tools.meshes->get(body.visual, body.collision, MeshDetail::kLikelihood), Pose::identity());
    }
  }
  cache.scene = nullptr;  // until it is known that all of it could be made
  if (!same_supports || !(cache.camera == rgbd.camera) || !(cache.X_WC == observation.X_WC)) {
    PRESCENE_RETURN_IF_ERROR(render_depth(only(known, InstanceKind::kSupport), rgbd.camera, observation.X_WC,
                                          *tools.renderer, &cache.supports));
    cache.camera = rgbd.camera;
    cache.X_WC = observation.X_WC;
  }
  cache.scene = scene;

  frame->surfaces = cache.surfaces;
  frame->solids = *cache.surfaces;
  for (std::size_t i = 0; i < X_WG.size(); ++i) frame->solids.place(cache.robot[i], X_WG[i]);
  frame->stamp_ns = observation.stamp_ns;
  frame->density = sampling != nullptr ? sampling->density : 1.0;
  frame->tempering = options.terms.tempering;
  frame->X_WC = observation.X_WC;
  frame->X_CW = observation.X_WC.inverse();
  frame->up_W = scene->gravity_W.norm() > 1e-9 ? Vector3d(-scene->gravity_W.normalized()) : Vector3d::UnitZ();
  frame->X_WG.assign(X_WG.begin(), X_WG.end());
  frame->color_models.clear();
  frame->color_objects.clear();
  std::vector<rendering::ColorModel> color_models;
  if (rgbd.color) {
    for (const auto& [name, model] : colors.of_models) {
      frame->color_models.push_back(name);
      color_models.push_back(model);
    }
    for (const auto& [name, model] : colors.of_objects) {
      frame->color_objects.push_back(name);
      color_models.push_back(model);
    }
  }
  rendering::FrameTermsInput input;
  input.camera = rgbd.camera;
  input.depth = rgbd.depth->view();
  if (rgbd.color && !color_models.empty()) input.color = rgbd.color->view();
  if (!scene->supports.empty()) input.background = cache.supports.view();
  input.color_models = color_models;
  PRESCENE_RETURN_IF_ERROR(make_frame_terms(
      input, sampling != nullptr ? sampling->terms : options.terms,
      rendering::SensorModel(with_settings(options.sensor, belief::depth_noise_of(*scene, observation.camera))),
      &frame->terms));
  // Only where supports are known is a missing return there evidence; elsewhere the view is open.
  for (int y = 0; y < frame->terms.camera.height; ++y)
    for (int x = 0; x < frame->terms.camera.width; ++x)
      if (!(frame->terms.absent_peak(x, y) > 0.0f)) frame->terms.absent_missing(x, y) = -1.0f;
  frame->supports = sampled_like(cache.supports, frame->terms);
  return render_depth(only(known, InstanceKind::kRobot), frame->terms.camera, observation.X_WC, *tools.renderer,
                      &frame->robot);
}

SearchTarget target_of(const belief::ObjectModel& model, const FilterFrame& frame, const FilterTools& tools) {
  SearchTarget target;
  target.mesh = tools.meshes->get(model.visual, model.collision, MeshDetail::kLikelihood);
  target.material = material_of(model.surface, model.color);
  target.facet_lever = tools.meshes->facet_lever(*target.mesh);
  if (tools.learned != nullptr) target.learned = find(*tools.learned, *target.mesh);
  const auto color = std::find(frame.color_models.begin(), frame.color_models.end(), model.name);
  if (color != frame.color_models.end()) target.color_model = static_cast<int>(color - frame.color_models.begin());
  return target;
}

SearchTarget target_of(const belief::ObjectBelief& object, const belief::Scene& scene, const FilterFrame& frame,
                       const FilterTools& tools) {
  SearchTarget target = target_of(scene.models[static_cast<std::size_t>(object.model)], frame, tools);
  const auto own = std::find(frame.color_objects.begin(), frame.color_objects.end(), object.name);
  if (own != frame.color_objects.end())
    target.color_model =
        static_cast<int>(frame.color_models.size()) + static_cast<int>(own - frame.color_objects.begin());
  return target;
}

SearchTarget in_fine(SearchTarget target, const belief::ObjectModel& model, const FilterTools& tools) {
  target.mesh = tools.meshes->get(model.visual, model.collision, MeshDetail::kFine);
  target.facet_lever = tools.meshes->facet_lever(*target.mesh);
  return target;
}

geometry::DepthImage depth_of(const SearchTarget& target, const Pose& X_CO, const geometry::PinholeCamera& camera,
                              rendering::Renderer& renderer) {
  rendering::RenderScene scene;
  scene.instances.push_back({target.mesh, X_CO, target.material});
  geometry::DepthImage depth;
  // The camera was checked when the frame was prepared, so a failure is a lost device: the object then hides nothing,
  // and the filter's WatchedRenderer knows of it.
  if (!render_depth(scene, camera, Pose::identity(), renderer, &depth).ok())
    depth = geometry::DepthImage(camera.width, camera.height);
  return depth;
}

rendering::ExpectedEvidence expected_evidence_of(const rendering::FrameTerms& terms, const SearchTarget& target,
                                                 const Pose& X_CO, rendering::Renderer& renderer) {
  rendering::RenderScene scene;
  scene.instances.push_back({target.mesh, X_CO, target.material});
  rendering::RenderOptions options;
  options.normals = true;
  rendering::RenderedView view;
  // As above; nothing is expected less of it then.
  if (!renderer.render(scene, terms.camera, Pose::identity(), options, &view).ok())
    return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 0.0};
  return rendering::expected_evidence(terms, target.material, view.depth, view.normals);
}

rendering::FrameTerms terms_for_object(const FilterFrame& frame, std::span<const geometry::DepthImage* const> others,
                                       const Vector3d& p_CQ, double radius) {
  geometry::DepthImage known = frame.robot;
  for (const geometry::DepthImage* other : others) merge_nearest(*other, &known);
  const auto front = static_cast<float>(p_CQ.z() - radius - kClearlyInFront);
  for (std::size_t i = 0; i < known.size(); ++i) {
    const float support = frame.supports.data()[i];
    if (support > 0.0f && support < front && (known.data()[i] == 0.0f || support < known.data()[i]))
      known.data()[i] = support;
  }
  rendering::FrameTerms terms;
  with_known_surfaces(frame.terms, known, &terms);
  return terms;
}

double outline_support(const rendering::FrameTerms& terms, const geometry::DepthImage& object_depth, double step,
                       OutlineHoles holes, const geometry::ColorImage* color) {
  const int width = terms.camera.width, height = terms.camera.height;
  // What is further than two pixels from the object is no matter of its outline.
  int left = width, right = -1, top = height, bottom = -1;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!(object_depth(x, y) > 0.0F)) continue;
      left = std::min(left, x), right = std::max(right, x);
      top = std::min(top, y), bottom = std::max(bottom, y);
    }
  if (right < 0) return 1.0;
  left = std::max(0, left - 2), right = std::min(width - 1, right + 2);
  top = std::max(0, top - 2), bottom = std::min(height - 1, bottom + 2);
  geometry::Image<std::uint8_t> matched(width, height, 0);
  int covered = 0, measured = 0;
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      const double z = terms.depth(x, y), d = object_depth(x, y);
      covered += d > 0.0;
      measured += d > 0.0 && z > 0.0;
      matched(x, y) = d > 0.0 && z > 0.0 && std::abs(z - d) < std::max(kMatch, 3.0 * terms.model.hit_sigma(d, 1.0));
    }
  const auto matches = [&](int x, int y) { return matched(x, y) != 0; };
  int ends = 0, goes_on = 0, nothing = 0;
  int others = 0, compared = 0;  // of `goes_on`, where the colour is another one than within
  for (int y = top; y <= bottom; ++y)
    for (int x = left; x <= right; ++x) {
      const double z = terms.depth(x, y);
      if (matches(x, y)) continue;
      // The matched surface nearest to this pixel, at most two pixels away. The pixels next to it belong to either side
      // as often as not: judge by those two away.
      double edge = 0.0;
      int nearest = 9, edge_x = x, edge_y = y;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= width || y + dy >= height || !matches(x + dx, y + dy)) continue;
          const int distance = dx * dx + dy * dy;
          if (distance < nearest)
            nearest = distance, edge = terms.depth(x + dx, y + dy), edge_x = x + dx, edge_y = y + dy;
        }
      if (edge == 0.0 || nearest < 4) continue;
      if (z == 0.0) {
        nothing += holes == OutlineHoles::kMayEnd && !(object_depth(x, y) > 0.0F);
        continue;
      }
      if (z < edge - step) continue;
      const double expected = terms.absent_peak(x, y);
      const bool known = expected > 0.0 && std::abs(z - expected) < 0.5 * step;
      const bool is_end = known || z > edge + step;
      (is_end ? ends : goes_on)++;
      if (is_end || color == nullptr || color->empty()) continue;
      // As far inside of the edge as this pixel is outside.
      const int in_x = 2 * edge_x - x, in_y = 2 * edge_y - y;
      if (in_x < 0 || in_y < 0 || in_x >= width || in_y >= height || !matches(in_x, in_y)) continue;
      ++compared;
      others += are_other_colors((*color)(x, y), (*color)(in_x, in_y)) ? 1 : 0;
    }
  if (ends + goes_on == 0) return 1.0;
  // A surface that goes on returns as much beyond the outline as within it.
  const double returned = covered > 0 ? static_cast<double>(measured) / covered : 0.0;
  const double surplus = std::max(0.0, nothing - (1.0 - returned) * (ends + goes_on + nothing));
  double ended = ends;
  if (compared > 0) {
    // Colours change within an object, too, where it is printed: with a share b of the places within, they change at
    // q + (1 - q) b of an outline at which a share q ends.
    int changes = 0, pairs = 0;
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) {
        if (!matches(x, y)) continue;
        for (const auto& [u, v] : {std::pair{x + kColorReachWithin, y}, {x, y + kColorReachWithin}}) {
          if (u >= width || v >= height || !matches(u, v)) continue;
          ++pairs;
          changes += are_other_colors((*color)(x, y), (*color)(u, v)) ? 1 : 0;
        }
      }
    const double within = pairs > 0 ? static_cast<double>(changes) / pairs : 1.0;
    const double at_outline = static_cast<double>(others) / compared;
    if (within < 1.0) ended += goes_on * std::max(0.0, (at_outline - within) / (1.0 - within));
  }
  return (ended + surplus) / (ends + goes_on + surplus);
}

}  // namespace prescene::filter
