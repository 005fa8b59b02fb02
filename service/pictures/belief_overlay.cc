// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/belief_overlay.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "prescene/filter/proposals/support_tracking.h"
#include "prescene/interfaces/reports/overlay.h"

namespace prescene::service {
namespace {

constexpr double kChiSquared90 = 4.605170186;  // 2 degrees of freedom
constexpr int kDots = 96;

}  // namespace

rendering::RenderScene drawn_belief(const belief::Scene& scene, const BeliefSummary& summary,
                                    const belief::Observation& observation, filter::MeshCache& meshes,
                                    std::vector<std::string>* names) {
  rendering::RenderScene drawn;
  for (const ObjectSummary& object : summary.objects) {
    const auto model =
        std::find_if(scene.models.begin(), scene.models.end(), [&](const auto& m) { return m.name == object.model; });
    if (model == scene.models.end() || object.state == belief::TrackState::kLost) continue;
    drawn.instances.push_back({meshes.get(model->visual, model->collision, filter::MeshDetail::kDisplay), object.X_WO,
                               filter::material_of(model->surface, model->color)});
    names->push_back(object.name);
  }
  std::vector<geometry::Pose> X_WG;
  for (const belief::KinematicBody& body : scene.robot) {
    const auto known = observation.robot.find(body.name);
    X_WG.push_back(known == observation.robot.end() ? belief::pose_at(body, 0.0) : known->second);
  }
  for (const belief::Support& support : scene.supports) {
    if (!filter::is_found_support(support.name)) continue;
    drawn.instances.push_back({meshes.get(support.visual, support.collision, filter::MeshDetail::kDisplay),
                               support.X_WS, filter::material_of(belief::SurfaceKind::kOpaque, support.color)});
    names->push_back(support.name);
  }
  const filter::BeliefView around = filter::known_surroundings(scene, X_WG, filter::MeshDetail::kDisplay, meshes);
  drawn.instances.insert(drawn.instances.end(), around.scene.instances.begin(), around.scene.instances.end());
  return drawn;
}

void draw_region(const ObjectSummary& object, const geometry::PinholeCamera& camera, const geometry::Pose& X_WC,
                 geometry::Rgb color, geometry::ColorImage& picture) {
  const geometry::Vector3d p = X_WC.inverse() * object.X_WO.translation;
  if (!(p.z() > 0.0) || !p.allFinite() || !object.covariance.allFinite()) return;
  const Eigen::Matrix3d R_CW = X_WC.rotation.conjugate().toRotationMatrix();
  const Eigen::Matrix3d spread = R_CW * object.covariance.bottomRightCorner<3, 3>() * R_CW.transpose();
  Eigen::Matrix<double, 2, 3> J;
  J << camera.fx / p.z(), 0.0, -camera.fx * p.x() / (p.z() * p.z()), 0.0, camera.fy / p.z(),
      -camera.fy * p.y() / (p.z() * p.z());
  const Eigen::Matrix2d pixels = kChiSquared90 * J * spread * J.transpose();
  // Its Cholesky root; a region without width stays a line.
  const double a = std::sqrt(std::max(0.0, pixels(0, 0)));
  const double b = a > 0.0 ? pixels(0, 1) / a : 0.0;
  const double c = std::sqrt(std::max(0.0, pixels(1, 1) - b * b));
  const Eigen::Vector2d middle = camera.project(p);
  for (int i = 0; i < kDots; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kDots;
    const double x = middle.x() + a * std::cos(angle), y = middle.y() + b * std::cos(angle) + c * std::sin(angle);
    for (int v = 0; v < 2; ++v)
      for (int u = 0; u < 2; ++u) {
        if (!(x + u >= 0.0 && x + u < picture.width() && y + v >= 0.0 && y + v < picture.height())) continue;
        picture(static_cast<int>(x) + u < picture.width() ? static_cast<int>(x) + u : static_cast<int>(x),
                static_cast<int>(y) + v < picture.height() ? static_cast<int>(y) + v : static_cast<int>(y)) = color;
      }
  }
}

geometry::ColorImage picture_of(const belief::Observation& observation) {
  if (observation.frame.color) return *observation.frame.color;
  return interfaces::depth_picture(*observation.frame.depth, 0.2, 2.0);
}

core::Result<geometry::ColorImage> belief_overlay(const belief::Scene& scene, const BeliefSummary& summary,
                                                  const belief::Observation& observation, Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  std::vector<std::string> names;
  const rendering::RenderScene drawn = drawn_belief(scene, summary, observation, backends.meshes(), &names);
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer->render(drawn, observation.frame.camera, observation.X_WC, {}, &view));
  std::vector<std::optional<geometry::Rgb>> colors;
  for (std::size_t object = 0; object < names.size(); ++object) colors.emplace_back(interfaces::series_color(object));
  geometry::ColorImage picture = picture_of(observation);
  interfaces::tint(view.labels, colors, 0.25, picture);
  interfaces::draw_outlines(view.labels, colors, 2, picture);
  for (const ObjectSummary& object : summary.objects) {
    if (object.state == belief::TrackState::kTracked || object.state == belief::TrackState::kLost) continue;
    const auto name = std::find(names.begin(), names.end(), object.name);
    if (name == names.end()) continue;
    draw_region(object, observation.frame.camera, observation.X_WC, **(colors.begin() + (name - names.begin())),
                picture);
  }
  return picture;
}

}  // namespace prescene::service
