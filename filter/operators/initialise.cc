// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/initialise.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;

constexpr int kSpreadDraws = 64;  // enough to tell a wide prior from a narrow one
// An object whose start has a larger standard deviation is looked for in the first frame. Chosen.
constexpr double kWideShift = 0.06;         // m
constexpr double kWideTurn = 0.5;           // rad
constexpr double kMissingExistence = 0.2;   // of an object that was looked for and not found
constexpr double kBoxMargin = 0.05;         // m that a find may lie outside of where the scene says
constexpr double kSupportThickness = 0.02;  // m, of a support that is made of a plane of the first frame

std::vector<double> uniforms(int count, core::RandomStream& stream) {
  std::vector<double> u(static_cast<std::size_t>(count));
  for (double& value : u) value = stream.uniform();
  return u;
}

/// Second moment of the prior's poses about its mean, box_plus coordinates.
Matrix6d prior_covariance(const belief::SceneObject& object) {
  const Pose centre = belief::mean(object.pose);
  core::RandomStream stream(0, core::Purpose::kStartBelief);
  Matrix6d covariance = Matrix6d::Zero();
  for (int i = 0; i < kSpreadDraws; ++i) {
    const std::vector<double> u = uniforms(belief::dimensions(object.pose), stream);
    const Vector6d d = geometry::box_minus(belief::draw(object.pose, u), centre);
    covariance += d * d.transpose() / kSpreadDraws;
  }
  return covariance;
}

/// Too wide to start from.
bool is_wide(const Matrix6d& covariance) {
  return std::sqrt(covariance.diagonal().head<3>().maxCoeff()) > kWideTurn ||
         std::sqrt(covariance.diagonal().tail<3>().maxCoeff()) > kWideShift;
}

Matrix6d first_covariance(const InitialiseOptions& options) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal().head<3>().setConstant(options.first_turn * options.first_turn);
  covariance.diagonal().tail<3>().setConstant(options.first_shift * options.first_shift);
  return covariance;
}

bool inside_prior(const belief::SceneObject& object, const Pose& X_WO) {
  const auto* box = std::get_if<belief::BoxPose>(&object.pose);
  if (box == nullptr) return true;
  const belief::ScalarDistribution* axes[] = {&box->position.x, &box->position.y, &box->position.z};
  for (int i = 0; i < 3; ++i) {
    const auto* range = std::get_if<belief::UniformScalar>(axes[i]);
    if (range == nullptr) continue;
    if (X_WO.translation[i] < range->low - kBoxMargin || X_WO.translation[i] > range->high + kBoxMargin) return false;
  }
  return true;
}

void place(const Pose& X_WO, core::TimeNs stamp_ns, const rendering::PoseEvidence& evidence,
           const InitialiseOptions& options, const core::RandomStream& stream, ObjectBelief& object) {
  object.particles =
      particles_about(X_WO, belief::MotionMode::kResting, static_cast<int>(object.particles.size()), options, stream);
  object.existence = kFoundExistence;
  object.state = belief::TrackState::kTracked;
  object.evidence_per_pixel = evidence.log_ratio_per_visible_pixel();
  object.visible_share = evidence.visible_share();
  object.frames_unseen = 0;
  object.last_seen_ns = stamp_ns;
}

/// What up is; without gravity, the normal of the plane that most points lie on, or what the camera takes for it.
Vector3d up_in(const SampledDepth& sampled, const Pose& X_WC, const Vector3d& gravity_W,
               const SegmentationOptions& options, const core::RandomStream& stream) {
  if (gravity_W.norm() > 1e-9) return -gravity_W.normalized();
  const std::optional<SupportPlane> plane = find_support_plane(sampled, options, stream);
  return X_WC.rotation * (plane ? plane->region.plane_C.normal : -Vector3d::UnitY());
}

/// A box under the region, its frame's z along the normal, x along a side of the smallest rectangle about the outline.
belief::Support support_of(const rendering::SupportRegion& region, const Pose& X_WC, double thickness) {
  const Vector3d z = X_WC.rotation * region.plane_C.normal;
  std::vector<Vector3d> corners;
  for (const Vector3d& p : region.outline_C) corners.push_back(X_WC * p);
  double smallest = std::numeric_limits<double>::infinity();
  geometry::Matrix3d R_WS = geometry::Matrix3d::Identity();
  geometry::Box extent;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d edge = corners[(i + 1) % corners.size()] - corners[i];
    const Vector3d x = (edge - z * z.dot(edge)).normalized();
    geometry::Matrix3d R;
    R << x, z.cross(x), z;
    geometry::Box box;
    for (const Vector3d& p : corners) box.extend(Vector3d(R.transpose() * p));
    const double area = box.sizes().x() * box.sizes().y();
    if (area < smallest) smallest = area, R_WS = R, extent = box;
  }
  belief::Support support;
  const Vector3d size(extent.sizes().x(), extent.sizes().y(), thickness);
  support.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{size}, Pose::identity()});
  support.X_WS.rotation = geometry::Quaterniond(R_WS).normalized();
  support.X_WS.translation = R_WS * extent.center() - 0.5 * thickness * z;
  return support;
}

/// The upper face of a support that was found in a frame, in C.
rendering::SupportRegion upper_face(const belief::Support& support, const Pose& X_CW) {
  const auto& shape = std::get<belief::PrimitiveShape>(support.collision.front());
  const Vector3d half = 0.5 * std::get<geometry::BoxShape>(shape.primitive).size;
  const Pose X_CS = X_CW * support.X_WS;
  rendering::SupportRegion face;
  face.plane_C = geometry::transformed({Vector3d::UnitZ(), -half.z()}, X_CS);
  for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
    face.outline_C.push_back(X_CS * Vector3d(x * half.x(), y * half.y(), half.z()));
  return face;
}

}  // namespace

bool has_wide_prior(const belief::SceneObject& object) { return !object.held_by && is_wide(prior_covariance(object)); }

double turned_log_odds(const belief::SceneObject& object) {
  // Of a normal distribution it is needed in each frame, and known.
  const auto* normal = std::get_if<belief::NormalPose>(&object.pose);
  const Matrix6d covariance = normal != nullptr ? normal->covariance : prior_covariance(object);
  if (!object.held_by && is_wide(covariance)) return 0.0;
  const double deviation = std::sqrt(covariance.diagonal().head<3>().maxCoeff());
  const double turned = deviation > 0.0 ? 2.0 * core::normal_cdf(-kRivalTurn / deviation) : 0.0;
  return turned > 0.0 ? std::max(std::log(turned), kSlipLogOdds) : kSlipLogOdds;
}

std::vector<Particle> particles_about(const Pose& X_WO, belief::MotionMode mode, int count,
                                      const InitialiseOptions& options, core::RandomStream stream) {
  std::vector<Particle> particles;
  for (int i = 0; i < count; ++i) {
    Particle particle;
    particle.log_weight = -std::log(static_cast<double>(count));
    Vector6d d = Vector6d::Zero();
    if (i > 0)
      for (int k = 0; k < 6; ++k) d[k] = stream.normal() * (k < 3 ? options.first_turn : options.first_shift);
    particle.X_WO = geometry::normalized(geometry::box_plus(X_WO, d));
    particle.covariance.topLeftCorner<6, 6>() = first_covariance(options);
    particle.mode = mode;
    particles.push_back(particle);
  }
  return particles;
}

belief::Belief belief_from_priors(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed, core::TimeNs stamp_ns,
                                  const InitialiseOptions& options) {
  PRESCENE_CHECK(options.particles > 0);
  belief::Belief belief;
  belief.seed = seed;
  belief.stamp_ns = stamp_ns;
  for (const belief::KinematicBody& body : scene->robot) belief.robot.push_back(belief::pose_at(body, 0.0));
  if (scene->camera) belief.X_WC = scene->camera->X_WC;
  if (!scene->more_cameras.empty()) belief.cameras.resize(static_cast<std::size_t>(belief::camera_count(*scene)));
  const core::RandomStream stream(seed, core::Purpose::kStartBelief);
  const belief::WorldState middle = belief::mean_start(*scene);
  for (const belief::SceneObject& object : scene->objects) {
    ObjectBelief start;
    start.name = object.name;
    start.model = object.model;
    start.existence = options.prior_existence;
    start.last_seen_ns = stamp_ns;
    start.state = belief::TrackState::kDoubtful;
    start.island = static_cast<int>(belief.objects.size());
    belief.objects.push_back(std::move(start));
  }
  for (int k = 0; k < options.particles; ++k) {
    core::RandomStream mine = stream.at(0, static_cast<std::uint32_t>(k));
    const belief::WorldState state =
        k == 0 ? middle : belief::draw_start(*scene, uniforms(belief::start_dimensions(*scene), mine));
    for (std::size_t i = 0; i < state.objects.size(); ++i) {
      Particle particle;
      particle.log_weight = -std::log(static_cast<double>(options.particles));
      particle.X_WO = state.objects[i].X_WO;
      particle.V_WO = state.objects[i].V_WO;
      particle.mode = state.objects[i].mode;
      particle.covariance.topLeftCorner<6, 6>() =
          first_covariance(options) + 0.25 * prior_covariance(scene->objects[i]);
      belief.objects[i].particles.push_back(particle);
    }
  }
  belief.scene = std::move(scene);
  return belief;
}

Surroundings surroundings_in(const FilterFrame& frame, const SampledDepth& sampled, const belief::Scene& scene,
                             std::span<const WantedModel> wanted, const SegmentationOptions& options,
                             const core::RandomStream& stream) {
  const Vector3d up_W = up_in(sampled, frame.X_WC, scene.gravity_W, options, stream);
  const auto on_supports = pixels_on(sampled, frame.X_WC, up_W, *frame.surfaces, options);
  const std::vector<FlatPatch> patches =
      find_flat_patches(sampled, frame.X_CW.rotation * up_W, on_supports, least_support_area(wanted), options, stream);
  std::vector<rendering::SupportRegion> upper_faces;
  for (const belief::Support& support : scene.supports)
    if (is_found_support(support.name)) upper_faces.push_back(upper_face(support, frame.X_CW));
  return surroundings_of(sampled, frame.X_WC, up_W, *frame.surfaces, on_supports, upper_faces, patches, options);
}

std::vector<belief::Support> supports_from_frame(const SampledDepth& sampled, const Pose& X_WC,
                                                 const belief::Scene& scene, const InitialiseOptions& options,
                                                 MeshCache& meshes, const core::RandomStream& stream) {
  std::vector<WantedModel> models;
  for (const belief::ObjectModel& model : scene.models)
    models.push_back({{meshes.get(model.visual, model.collision, MeshDetail::kLikelihood), {}, -1}, 1});
  const SegmentationOptions& segmentation = options.detection.segmentation;
  const Vector3d up_W = up_in(sampled, X_WC, scene.gravity_W, segmentation, stream);
  const SupportSurfaces known(scene, meshes);
  const auto on_supports = pixels_on(sampled, X_WC, up_W, known, segmentation);
  std::vector<belief::Support> supports;
  for (const FlatPatch& patch : find_flat_patches(sampled, X_WC.rotation.conjugate() * up_W, on_supports,
                                                  least_support_area(models), segmentation, stream)) {
    if (!patch.level || !patch.large) continue;
    belief::Support support = support_of(patch.region, X_WC, kSupportThickness);
    support.name = kFoundSupport;
    const auto taken = [&](const std::string& name) {
      return belief::find_support(scene, name).has_value() ||
             std::any_of(supports.begin(), supports.end(), [&](const auto& other) { return other.name == name; });
    };
    for (int number = 2; taken(support.name); ++number)
      support.name = std::string(kFoundSupport) + "_" + std::to_string(number);
    supports.push_back(std::move(support));
  }
  return supports;
}

FindReport find_in_frame(const FilterFrame& frame, const belief::Observation& observation,
                         const InitialiseOptions& options, const FilterTools& tools, const core::RandomStream& stream,
                         belief::Belief& belief, FindWhich which) {
  FindReport report;
  const belief::Scene& scene = *belief.scene;
  std::vector<std::size_t> wide;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (has_wide_prior(scene.objects[i]) &&
        (which == FindWhich::kAll || belief.objects[i].state == belief::TrackState::kLost))
      wide.push_back(i);
  report.looked_for = static_cast<int>(wide.size());
  if (wide.empty()) return report;
  FineFrame fine = fine_frame_if_sharp(frame, scene, observation, tools);
  geometry::DepthImage known = frame.robot;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    if (std::find(wide.begin(), wide.end(), i) != wide.end()) continue;
    const SearchTarget target = target_of(scene.model_of(scene.objects[i]), frame, tools);
    const std::vector<Particle>& particles = belief.objects[i].particles;
    const Particle& there = which == FindWhich::kAll ? particles.front() : belief::heaviest(particles);
    const Pose X_CO = frame.X_CW * there.X_WO;
    merge_nearest(depth_of(target, X_CO, frame.terms.camera, *tools.renderer), &known);
    if (fine.smear.is_sharp())
      with_known_surfaces(fine.terms, depth_of(target, X_CO, fine.terms.camera, *tools.renderer), &fine.terms);
  }

  const SegmentationOptions& segmentation = options.detection.segmentation;
  const SampledDepth sampled = sample_depth(*observation.frame.depth, observation.frame.camera, segmentation);
  std::vector<WantedModel> wanted;
  std::vector<int> model_of_wanted;
  for (const std::size_t i : wide) {
    const auto known_model = std::find(model_of_wanted.begin(), model_of_wanted.end(), scene.objects[i].model);
    if (known_model != model_of_wanted.end()) {
      ++wanted[static_cast<std::size_t>(known_model - model_of_wanted.begin())].count;
      continue;
    }
    model_of_wanted.push_back(scene.objects[i].model);
    wanted.push_back({target_of(scene.model_of(scene.objects[i]), frame, tools), 1});
  }
  const Surroundings surroundings = surroundings_in(frame, sampled, scene, wanted, segmentation, stream);
  report.no_support = surroundings.solid.empty() && surroundings.steps.empty();
  rendering::FrameTerms terms;
  with_known_surfaces(frame.terms, known, &terms);
  const std::vector<Detection> found =
      detect(terms, fine, known, sampled, surroundings, wanted, options.detection, tools, stream);
  std::vector<bool> used(found.size(), false);
  for (const std::size_t i : wide) {
    ObjectBelief& object = belief.objects[i];
    object.state = belief::TrackState::kLost;
    object.existence = kMissingExistence;
    object.frames_unseen = 1000;
    for (std::size_t k = 0; k < found.size(); ++k) {
      const Pose X_WO = frame.X_WC * found[k].X_CO;
      if (used[k] || model_of_wanted[static_cast<std::size_t>(found[k].model)] != object.model ||
          !inside_prior(scene.objects[i], X_WO))
        continue;
      used[k] = true;
      ++report.found;
      place(X_WO, frame.stamp_ns, found[k].evidence, options, stream.at(1, static_cast<std::uint32_t>(i)), object);
      object.existence *= found[k].probability;
      break;
    }
  }
  return report;
}

}  // namespace prescene::filter
