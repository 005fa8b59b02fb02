// SPDX-License-Identifier: Apache-2.0
#include "learn_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/level_camera.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/geometry/sampling.h"

namespace prescene::service {
namespace {

using geometry::Pose;
using geometry::Vector3d;

constexpr geometry::PinholeCamera kViewCamera = {320, 240, 285.0, 285.0, 159.5, 119.5};
constexpr double kLyingShare = 0.8;      // of the views
constexpr double kSpacingShare = 0.22;   // of the model's radius
constexpr double kLeastSpacing = 0.004;  // m
constexpr double kRareRest = 0.01;       // probability of ways to lie that nobody puts a thing down in
constexpr double kAlikeRests = 0.85;     // share of the likeliest probability among ways that are alike
constexpr std::size_t kMostRests = 256;  // of a round model

/// A camera that looks at the origin from above, or from below when the thing lies on nothing.
Pose looking_at_origin(double distance, bool lies, core::RandomStream& draws) {
  const double elevation = (lies ? draws.uniform(8.0, 80.0) : draws.uniform(-60.0, 80.0)) * std::numbers::pi / 180.0;
  const double azimuth = draws.uniform(-std::numbers::pi, std::numbers::pi);
  const Vector3d from = distance * Vector3d(std::cos(elevation) * std::cos(azimuth),
                                            std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  return {geometry::Quaterniond(geometry::level_camera(-from.normalized())).normalized(), from};
}

}  // namespace

std::vector<filter::LearnedRest> rests_of(const belief::ObjectModel& model) {
  std::vector<filter::LearnedRest> rests;
  const geometry::TriangleMesh mesh = model.visual ? *model.visual : belief::collision_mesh(model);
  const auto poses = geometry::resting_poses(mesh, belief::mean(model.center_of_mass));
  if (!poses) return rests;
  for (const geometry::RestingPose& pose : *poses) {
    if (rests.size() == kMostRests) break;
    const Vector3d up = pose.R_WB.conjugate() * Vector3d::UnitZ();
    rests.push_back({{static_cast<float>(up.x()), static_cast<float>(up.y()), static_cast<float>(up.z())},
                     static_cast<float>(pose.probability)});
  }
  return rests;
}

geometry::Quaterniond draw_rest(const std::vector<filter::LearnedRest>& rests, core::RandomStream& draws) {
  if (rests.empty()) return geometry::uniform_rotation(draws);
  // What falls by itself lies by probability; what people put down lies in each way alike. Ways that are about as
  // likely, such as the facets of a round side, are one of these.
  std::vector<std::pair<std::size_t, std::size_t>> alike;
  double likeliest = 0.0;
  for (std::size_t i = 0; i < rests.size() && static_cast<double>(rests[i].probability) > kRareRest; ++i) {
    const auto p = static_cast<double>(rests[i].probability);
    if (alike.empty() || p < kAlikeRests * likeliest) alike.emplace_back(i, i), likeliest = p;
    alike.back().second = i + 1;
  }
  std::size_t chosen = 0;
  if (draws.uniform() < 0.5 && !alike.empty()) {
    const auto& [begin, end] = alike[draws.uniform_below(alike.size())];
    chosen = begin + draws.uniform_below(end - begin);
  } else {
    double left = draws.uniform();
    while (chosen + 1 < rests.size() && (left -= static_cast<double>(rests[chosen].probability)) > 0.0) ++chosen;
  }
  const auto& up = rests[chosen].up_O;
  const geometry::Quaterniond upright = geometry::rotation_between(Vector3d(up[0], up[1], up[2]), Vector3d::UnitZ());
  const double turn = draws.uniform(-std::numbers::pi, std::numbers::pi);
  return (geometry::exp_rotation(turn * Vector3d::UnitZ()) * upright).normalized();
}

core::Result<filter::LearnedModel> learn_model(const belief::ObjectModel& model, const rendering::MeshHandle& mesh,
                                               int views, int places, rendering::Renderer& renderer,
                                               core::RandomStream draws) {
  filter::LearnedModel learned;
  learned.name = model.name;
  learned.mesh = filter::mesh_hash(*mesh);
  const double radius = static_cast<double>(mesh->radius);
  learned.spacing = static_cast<float>(std::max(kLeastSpacing, kSpacingShare * radius));
  learned.rests = rests_of(model);
  const rendering::MeshHandle ground = rendering::make_render_mesh(geometry::transformed(
      geometry::make_mesh(geometry::BoxShape{{8.0, 8.0, 1.0}}), Pose::from_translation({0.0, 0.0, -0.5})));
  for (int i = 0; i < views; ++i) {
    const bool lies = draws.uniform() < kLyingShare && !learned.rests.empty();
    Pose X_VO;  // V: in the middle of the model, z up
    X_VO.rotation = lies ? draw_rest(learned.rests, draws) : geometry::uniform_rotation(draws);
    X_VO.translation = -(X_VO.rotation * mesh->centre.cast<double>());
    double lowest = std::numeric_limits<double>::infinity();
    for (const auto& vertex : mesh->vertices) lowest = std::min(lowest, (X_VO * vertex.cast<double>()).z());
    const Pose X_VC = looking_at_origin(draws.uniform(0.6, 1.4) + 2.0 * radius, lies, draws);
    rendering::RenderScene scene;
    scene.instances.push_back({mesh, X_VO, {}});
    if (lies) scene.instances.push_back({ground, Pose::from_translation({0.0, 0.0, lowest}), {}});
    rendering::RenderedView view;
    PRESCENE_RETURN_IF_ERROR(renderer.render(scene, kViewCamera, X_VC, {}, &view));
    std::vector<int> shown;
    for (std::size_t k = 0; k < view.labels.size(); ++k)
      if (view.labels.data()[k] == 1) shown.push_back(static_cast<int>(k));
    if (shown.empty()) continue;
    const Pose X_CO = X_VC.inverse() * X_VO;
    const Vector3d up_C = X_VC.rotation.conjugate() * Vector3d::UnitZ();
    for (int k = 0; k < places; ++k) {
      const int pixel = shown[draws.uniform_below(shown.size())];
      const int u = pixel % kViewCamera.width, v = pixel / kViewCamera.width;
      const Vector3d place = kViewCamera.unproject(u, v, static_cast<double>(view.depth(u, v)));
      learned.patches.push_back(
          filter::patch_at(view.depth, kViewCamera, place, up_C, static_cast<double>(learned.spacing), true));
      learned.X_AO.push_back(filter::stored(filter::patch_frame(place, up_C).inverse() * X_CO));
    }
  }
  return learned;
}

}  // namespace prescene::service
