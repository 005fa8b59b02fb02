// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/validation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/text.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::rounded_text;
using core::Status;

Status check_value(double value, const ScalarRange& range) {
  if (!std::isfinite(value)) return invalid_input(rounded_text(value) + " is not a number: " + range.remedy);
  if (value < range.low || value > range.high)
    return invalid_input(rounded_text(value) + " is out of range: " + range.remedy);
  return {};
}

Status check_length(double value, const char* what) {
  if (!(value > 0.0) || !(value <= 1e4))
    return invalid_input(std::string(what) + " of " + rounded_text(value) +
                         ": give metres, more than 0 and at most 1e4");
  return {};
}

struct PrimitiveCheck {
  Status operator()(const geometry::Sphere& sphere) const { return check_length(sphere.radius, "a radius"); }
  Status operator()(const geometry::BoxShape& box) const {
    for (int i = 0; i < 3; ++i) PRESCENE_RETURN_IF_ERROR(check_length(box.size[i], "a box edge"));
    return {};
  }
  template <class Round>
  Status operator()(const Round& round) const {
    PRESCENE_RETURN_IF_ERROR(check_length(round.radius, "a radius"));
    return check_length(round.length, "a length");
  }
};

Status check_covariance(const Matrix6d& covariance) {
  if (!covariance.allFinite()) return invalid_input("the covariance is not finite: give variances in rad^2 and m^2");
  const double scale = covariance.cwiseAbs().maxCoeff();
  if (scale > kLengthRange.high * kLengthRange.high)
    return invalid_input("the covariance has entries above " + rounded_text(kLengthRange.high * kLengthRange.high) +
                         ": give variances in rad^2 and m^2");
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale)
    return invalid_input("the covariance is not symmetric: give the same value on both sides of the diagonal");
  if (geometry::symmetric_eigenvalues_6(covariance).minCoeff() < -1e-9 * scale)
    return invalid_input("the covariance has a negative eigenvalue: no distribution has it, check its correlations");
  return {};
}

}  // namespace

Status check_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
           c == '.';
  };
  if (name.empty()) return invalid_input("the name is empty: use letters, digits, '_', '-' and '.'");
  if (name.size() > 128) return invalid_input("the name is longer than 128 characters: shorten it");
  if (!std::all_of(name.begin(), name.end(), allowed))
    return invalid_input("the name '" + name +
                         "' has other characters than letters, digits, '_', '-' and '.': rename it");
  return {};
}

Status check_scalar(const ScalarDistribution& distribution, const ScalarRange& range) {
  if (const auto* fixed = std::get_if<FixedScalar>(&distribution)) return check_value(fixed->value, range);
  if (const auto* uniform = std::get_if<UniformScalar>(&distribution)) {
    PRESCENE_RETURN_IF_ERROR(check_value(uniform->low, range));
    PRESCENE_RETURN_IF_ERROR(check_value(uniform->high, range));
    if (uniform->low > uniform->high)
      return invalid_input("the interval from " + rounded_text(uniform->low) + " to " + rounded_text(uniform->high) +
                           " runs backwards: give [lowest, highest]");
    return {};
  }
  if (const auto* sampled = std::get_if<SampledScalar>(&distribution)) {
    if (sampled->samples.empty()) return invalid_input("the list of samples is empty: give at least one");
    for (const double sample : sampled->samples) PRESCENE_RETURN_IF_ERROR(check_value(sample, range));
    return {};
  }
  const auto& normal = std::get<NormalScalar>(distribution);
  if (!std::isfinite(normal.mean) || !std::isfinite(normal.standard_deviation) || normal.standard_deviation < 0.0)
    return invalid_input("normal of mean " + rounded_text(normal.mean) + " and standard deviation " +
                         rounded_text(normal.standard_deviation) +
                         ": both have to be finite, the deviation at least 0");
  if (normal.standard_deviation > range.high - range.low)
    return invalid_input("a standard deviation of " + rounded_text(normal.standard_deviation) +
                         " is out of range: " + range.remedy);
  if (std::isnan(normal.low) || std::isnan(normal.high) || normal.low > normal.high)
    return invalid_input("the cut from " + rounded_text(normal.low) + " to " + rounded_text(normal.high) +
                         " is empty: give a min below the max");
  PRESCENE_RETURN_IF_ERROR(check_value(std::clamp(normal.mean, normal.low, normal.high), range));
  if (normal.standard_deviation == 0.0) return {};
  if (range.hard_low && normal.low < range.low)
    return invalid_input("the normal reaches below " + rounded_text(range.low) + ": cut it there with min");
  if (range.hard_high && normal.high > range.high)
    return invalid_input("the normal reaches above " + rounded_text(range.high) + ": cut it there with max");
  return {};
}

Status check_vector(const Vector3Distribution& distribution, const ScalarRange& range) {
  PRESCENE_RETURN_IF_ERROR(check_scalar(distribution.x, range).at("x"));
  PRESCENE_RETURN_IF_ERROR(check_scalar(distribution.y, range).at("y"));
  return check_scalar(distribution.z, range).at("z");
}

Status check_pose(const Pose& pose) {
  if (!pose.is_finite()) return invalid_input("the pose is not finite: give numbers");
  if (std::abs(pose.rotation.norm() - 1.0) > 1e-6)
    return invalid_input("the quaternion has length " + rounded_text(pose.rotation.norm()) +
                         ": give a unit quaternion w, x, y, z");
  for (int i = 0; i < 3; ++i) PRESCENE_RETURN_IF_ERROR(check_value(pose.translation[i], kLengthRange).at("position"));
  return {};
}

Status check_pose(const PoseDistribution& distribution) {
  if (const auto* fixed = std::get_if<FixedPose>(&distribution)) return check_pose(fixed->X_WO);
  if (const auto* normal = std::get_if<NormalPose>(&distribution)) {
    PRESCENE_RETURN_IF_ERROR(check_pose(normal->mean));
    return check_covariance(normal->covariance);
  }
  if (const auto* box = std::get_if<BoxPose>(&distribution)) {
    PRESCENE_RETURN_IF_ERROR(check_pose(Pose{box->rotation, Vector3d::Zero()}));
    return check_vector(box->position, kLengthRange).at("position");
  }
  const auto& sampled = std::get<SampledPose>(distribution);
  if (sampled.samples.empty()) return invalid_input("the list of samples is empty: give at least one pose");
  for (const Pose& sample : sampled.samples) PRESCENE_RETURN_IF_ERROR(check_pose(sample));
  return {};
}

Status check_shapes(const std::vector<CollisionShape>& shapes) {
  if (shapes.empty()) return invalid_input("it has no shape: give a primitive or a mesh");
  for (const CollisionShape& shape : shapes) {
    if (const auto* primitive = std::get_if<PrimitiveShape>(&shape)) {
      PRESCENE_RETURN_IF_ERROR(check_pose(primitive->X_OS));
      PRESCENE_RETURN_IF_ERROR(std::visit(PrimitiveCheck{}, primitive->primitive));
    } else {
      const auto& of_mesh = std::get<MeshShape>(shape);
      PRESCENE_RETURN_IF_ERROR(check_pose(of_mesh.X_OS));
      if (!of_mesh.mesh || of_mesh.mesh->empty())
        return invalid_input("its mesh has no triangles: give a mesh with a surface");
    }
  }
  return {};
}

double thinnest_half(const std::vector<CollisionShape>& shapes) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (CollisionShape shape : shapes) {
    std::visit([](auto& placed) { placed.X_OS = {}; }, shape);
    const geometry::TriangleMesh mesh = collision_mesh({shape});
    if (mesh.vertices.empty()) continue;
    Vector3d low = mesh.vertices.front(), high = low;
    for (const Vector3d& vertex : mesh.vertices) {
      low = low.cwiseMin(vertex);
      high = high.cwiseMax(vertex);
    }
    thinnest = std::min(thinnest, 0.5 * (high - low).minCoeff());
  }
  return thinnest;
}

Status check_contact(const ContactProperties& contact) {
  PRESCENE_RETURN_IF_ERROR(check_scalar(contact.friction, kFrictionRange).at("friction"));
  if (contact.impact_friction)
    PRESCENE_RETURN_IF_ERROR(check_scalar(*contact.impact_friction, kFrictionRange).at("impact_friction"));
  PRESCENE_RETURN_IF_ERROR(check_scalar(contact.restitution, kRestitutionRange).at("restitution"));
  constexpr ScalarRange kLeverRange{0.0, 1.0, "give metres between 0 and 1"};
  PRESCENE_RETURN_IF_ERROR(check_value(contact.rolling_friction, kLeverRange).at("rolling_friction"));
  return check_value(contact.edge_radius, kLeverRange).at("edge_radius");
}

Status check_color(const Color& color) {
  constexpr ScalarRange kShade{0.0, 1.0, "give red, green and blue between 0 and 1"};
  for (const double shade : {color.r, color.g, color.b})
    PRESCENE_RETURN_IF_ERROR(check_value(shade, kShade).at("color"));
  return {};
}

}  // namespace prescene::belief
