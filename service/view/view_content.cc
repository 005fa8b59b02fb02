// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/view/view_content.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "json_fields.h"
#include "prescene/belief/json.h"
#include "prescene/core/hash.h"
#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/service/pictures/belief_overlay.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

constexpr int kMostTriangles = 3000;
constexpr int kMostGhosts = 24;
constexpr int kRegionPoints = 160;

/// To so many parts of the unit, a power of ten: divided by it, the number is the one with the shortest text.
double rounded(double value, double parts) { return std::isfinite(value) ? std::round(value * parts) / parts : 0.0; }

/// Tenths of a millimetre are more than a page shows; so are they short as text.
ordered_json pose_numbers(const geometry::Pose& X) {
  const geometry::Vector3d& p = X.translation;
  const geometry::Quaterniond& q = X.rotation;
  return json_numbers({rounded(p.x(), 1e4), rounded(p.y(), 1e4), rounded(p.z(), 1e4), rounded(q.w(), 1e5),
                       rounded(q.x(), 1e5), rounded(q.y(), 1e5), rounded(q.z(), 1e5)});
}

ordered_json color_numbers(const belief::Color& color) {
  return json_numbers({rounded(color.r, 1e3), rounded(color.g, 1e3), rounded(color.b, 1e3)});
}

ordered_json mesh_document(const geometry::TriangleMesh& whole) {
  const geometry::TriangleMesh mesh = geometry::simplified(whole, kMostTriangles);
  // A ten thousandth of the size, rounded to a power of ten.
  const double size = std::max(1e-3, geometry::bounding_box(mesh).sizes().maxCoeff());
  const double parts = std::pow(10.0, std::ceil(4.0 - std::log10(size)));
  std::vector<double> vertices;
  for (const geometry::Vector3d& vertex : mesh.vertices)
    for (Eigen::Index i = 0; i < 3; ++i) vertices.push_back(rounded(vertex[i], parts));
  ordered_json corners = ordered_json::array();
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) corners.push_back(corner);
  return JsonFields().numbers("vertices", vertices).field("triangles", std::move(corners)).take();
}

ordered_json body_document(const std::string& name, const belief::Color& color, const geometry::TriangleMesh& mesh,
                           const geometry::Pose& pose) {
  return JsonFields()
      .text("name", name)
      .field("color", color_numbers(color))
      .field("mesh", mesh_document(mesh))
      .field("pose", pose_numbers(pose))
      .take();
}

/// What a camera sees of a body.
template <class Body>
geometry::TriangleMesh seen_mesh(const Body& body) {
  return body.visual ? *body.visual : belief::collision_mesh(body.collision);
}

/// Particles by their weights, each as often as its share of `count` is: the same ones for the same belief.
template <class Use>
void for_each_by_weight(const std::vector<belief::Particle>& particles, int count, const Use& use) {
  double sum = 0.0, next = 0.5;
  for (const belief::Particle& particle : particles) {
    sum += count * std::exp(particle.log_weight);
    for (; next < sum; next += 1.0) use(particle);
  }
}

/// Without those that could not be told from the mean where it is drawn.
ordered_json ghosts_of(const belief::ObjectBelief& object, const geometry::Pose& mean,
                       const geometry::SymmetryGroup& symmetry) {
  constexpr double kSamePosition = 0.003, kSameTurn = 0.05;  // m, rad
  ordered_json ghosts = ordered_json::array();
  const belief::Particle* last = nullptr;
  for_each_by_weight(object.particles, kMostGhosts, [&](const belief::Particle& particle) {
    const bool repeated = std::exchange(last, &particle) == &particle;
    const geometry::Pose X = geometry::closest_equivalent(particle.X_WO, mean, symmetry);
    if (repeated || ((X.translation - mean.translation).norm() < kSamePosition &&
                     X.rotation.angularDistance(mean.rotation) < kSameTurn))
      return;
    ghosts.push_back(pose_numbers(X));
  });
  return ghosts;
}

/// Positions drawn from the mixture of the particles' Gaussians.
ordered_json region_of(const belief::ObjectBelief& object, core::RandomStream stream) {
  std::vector<double> numbers;
  const belief::Particle* last = nullptr;
  geometry::Matrix3d root;
  for_each_by_weight(object.particles, kRegionPoints, [&](const belief::Particle& particle) {
    if (&particle != last) {  // the same one comes several times in a row
      const geometry::SymmetricEigen3 eigen = geometry::symmetric_eigen_3(particle.covariance.block<3, 3>(3, 3));
      root = eigen.vectors;
      for (Eigen::Index i = 0; i < 3; ++i) root.col(i) *= std::sqrt(std::max(0.0, eigen.values[i]));
      last = &particle;
    }
    geometry::Vector3d p = particle.X_WO.translation;
    for (Eigen::Index i = 0; i < 3; ++i) p += stream.normal() * root.col(i);
    for (Eigen::Index i = 0; i < 3; ++i) numbers.push_back(rounded(p[i], 1e3));
  });
  return json_numbers(numbers);
}

ordered_json parameters_of(const ObjectSummary& object) {
  ordered_json parameters = ordered_json::array();
  for (const belief::ParameterEstimate& parameter : object.parameters)
    parameters.push_back(JsonFields()
                             .text("name", parameter.name)
                             .number("mean", rounded(parameter.mean, 1e5))
                             .number("deviation", rounded(parameter.standard_deviation, 1e5))
                             .number("low", rounded(parameter.low, 1e5))
                             .number("high", rounded(parameter.high, 1e5))
                             .take());
  return parameters;
}

ordered_json object_document(const ObjectSummary& summary, const belief::ObjectBelief& object,
                             const belief::Belief& belief, std::size_t index) {
  const auto model = static_cast<std::size_t>(object.model);
  const auto& models = belief.scene->models;
  const geometry::SymmetryGroup symmetry =
      model < models.size() ? models[model].symmetry : geometry::SymmetryGroup::none();
  const double spread = std::sqrt(std::max(0.0, summary.covariance.block<3, 3>(3, 3).trace()));
  JsonFields document;
  document.text("name", summary.name)
      .text("state", belief::to_string(summary.state))
      .field("held_by", summary.held_by ? ordered_json(*summary.held_by) : ordered_json())
      .number("confidence", rounded(summary.confidence, 1e4))
      .number("existence", rounded(summary.existence, 1e4))
      .field("pose", pose_numbers(summary.X_WO))
      .number("spread", rounded(spread, 1e5))
      .number("speed", rounded(summary.V_WO.linear.norm(), 1e4))
      .number("visible_share", rounded(summary.visible_share, 1e3))
      .field("parameters", parameters_of(summary))
      .count("lessons", static_cast<std::uint64_t>(std::max(0, summary.lessons)))
      .field("ghosts", ghosts_of(object, summary.X_WO, symmetry));
  if (summary.state != belief::TrackState::kTracked) {
    const core::RandomStream stream(belief.seed, core::Purpose::kEvaluation, belief.step,
                                    static_cast<std::uint32_t>(index));
    document.field("region", region_of(object, stream));
  }
  return document.take();
}

ordered_json camera_document(const belief::Observation& observation) {
  const geometry::PinholeCamera& camera = observation.frame.camera;
  return JsonFields()
      .field("pose", pose_numbers(observation.X_WC))
      .count("width", static_cast<std::uint64_t>(camera.width))
      .count("height", static_cast<std::uint64_t>(camera.height))
      .number("fx", camera.fx)
      .number("fy", camera.fy)
      .number("cx", camera.cx)
      .number("cy", camera.cy)
      .take();
}

geometry::ColorImage reduced(const geometry::ColorImage& image, int factor) {
  geometry::ColorImage small(image.width() / factor, image.height() / factor);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      std::array<int, 3> sum{};
      for (int v = 0; v < factor; ++v)
        for (int u = 0; u < factor; ++u)
          for (std::size_t c = 0; c < 3; ++c) sum[c] += image(factor * x + u, factor * y + v)[c];
      for (std::size_t c = 0; c < 3; ++c) small(x, y)[c] = static_cast<std::uint8_t>(sum[c] / (factor * factor));
    }
  }
  return small;
}

}  // namespace

ordered_json scene_document(const belief::Scene& scene) {
  const geometry::Vector3d& g = scene.gravity_W;
  ordered_json models = ordered_json::array(), objects = models, supports = models, robot = models;
  for (const belief::ObjectModel& model : scene.models)
    models.push_back(JsonFields()
                         .text("name", model.name)
                         .field("color", color_numbers(model.color))
                         .field("mesh", mesh_document(seen_mesh(model)))
                         .take());
  for (const belief::SceneObject& object : scene.objects)
    objects.push_back(JsonFields().text("name", object.name).text("model", scene.model_of(object).name).take());
  for (const belief::Support& support : scene.supports)
    supports.push_back(body_document(support.name, support.color, seen_mesh(support), support.X_WS));
  for (const belief::KinematicBody& body : scene.robot)
    robot.push_back(body_document(body.name, body.color, seen_mesh(body), belief::pose_at(body, 0.0)));
  std::vector<std::string> cameras;
  for (int i = 0; !scene.more_cameras.empty() && i < belief::camera_count(scene); ++i)
    cameras.push_back(belief::camera_at(scene, i)->name);
  return JsonFields()
      .text("op", "scene")
      .text("name", scene.name)
      .texts("cameras", cameras)
      .numbers("gravity", {g.x(), g.y(), g.z()})
      .field("models", std::move(models))
      .field("objects", std::move(objects))
      .field("supports", std::move(supports))
      .field("robot", std::move(robot))
      .take();
}

std::uint64_t scene_shape_hash(const belief::Scene& scene) {
  core::Hasher hasher;
  // Meshes are shared and never changed: the same one is at the same place as long as the scene lives.
  const auto add = [&hasher](const auto& named) { hasher.text(named.name).value(named.collision.size()); };
  for (const belief::ObjectModel& model : scene.models) add(model);
  for (const belief::SceneObject& object : scene.objects) hasher.text(object.name).value(object.model);
  for (const belief::Support& support : scene.supports) {
    add(support);
    for (const belief::CollisionShape& shape : support.collision) {
      const geometry::Box box = geometry::bounding_box(belief::collision_mesh({shape}));
      for (Eigen::Index i = 0; i < 3; ++i) hasher.value(rounded(box.sizes()[i], 50.0));
    }
  }
  for (const belief::KinematicBody& body : scene.robot) add(body);
  return hasher.digest();
}

BeliefSummary summary_of(const ShownStep& step) { return step.summary ? *step.summary : summary_of(*step.belief); }

ordered_json step_document(const ShownStep& step, const BeliefSummary& summary, std::uint64_t index) {
  const belief::Belief& belief = *step.belief;
  ordered_json objects = ordered_json::array();
  for (std::size_t i = 0; i < summary.objects.size(); ++i)
    objects.push_back(object_document(summary.objects[i], belief.objects[i], belief, i));
  ordered_json robot = ordered_json::array(), supports = ordered_json::array();
  for (const geometry::Pose& X_WG : belief.robot) robot.push_back(pose_numbers(X_WG));
  for (const belief::Support& support : belief.scene->supports) supports.push_back(pose_numbers(support.X_WS));
  ordered_json cameras = ordered_json::array();
  for (int i = 0; !step.frames.empty() && i <= step.frames.rbegin()->first; ++i) {
    const auto frame = step.frames.find(i);
    cameras.push_back(frame == step.frames.end() ? ordered_json() : camera_document(frame->second));
  }
  JsonFields document;
  document.text("op", "step")
      .count("index", index)
      .count("step", belief.step)
      .field("stamp_ns", ordered_json(belief.stamp_ns))
      .field("objects", std::move(objects))
      .field("camera", camera_document(step.observation))
      .field("robot", std::move(robot))
      .field("supports", std::move(supports))
      .number("seconds", rounded(step.seconds, 1e5))
      .texts("degraded", step.degraded);
  if (!cameras.empty()) document.field("cameras", std::move(cameras));
  return document.take();
}

std::string picture_jpeg(const belief::Observation& observation, int most_width, int quality) {
  if (!observation.frame.color && !observation.frame.depth) return "";
  const geometry::ColorImage whole = picture_of(observation);
  const int factor = (whole.width() + most_width - 1) / most_width;
  if (whole.height() < factor) return "";
  const geometry::ColorImage small = factor > 1 ? reduced(whole, factor) : geometry::ColorImage();
  const auto bytes = interfaces::encode_jpeg(factor > 1 ? small.view() : whole.view(), quality);
  return {bytes.begin(), bytes.end()};
}

}  // namespace prescene::service
