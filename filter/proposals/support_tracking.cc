// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/support_tracking.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include "prescene/geometry/pixel_rays.h"

namespace prescene::filter {
namespace {

constexpr double kFaceGate = 0.02;        // m from the believed plane; what is further off belongs to something else
constexpr double kInlier = 0.008;         // m from the fitted plane
constexpr double kGrowth = 1.2;           // 1/m^2; thresholds grow by this times the squared depth, as noise does
constexpr int kFewestFacePixels = 60;     // at the sampled width; less is no measurement
constexpr double kLeastFaceShare = 0.25;  // of the pixels that should show it; less is something else

/// The upper face of a box that is a support: its middle, axes and half sizes.
struct Face {
  Pose X_WF;  ///< z along the normal, origin in the face's middle.
  double half_x, half_y;
};

std::optional<Face> upper_face(const belief::Support& support) {
  if (support.collision.size() != 1) return std::nullopt;
  const auto* primitive = std::get_if<belief::PrimitiveShape>(&support.collision.front());
  if (primitive == nullptr) return std::nullopt;
  const auto* box = std::get_if<geometry::BoxShape>(&primitive->primitive);
  if (box == nullptr) return std::nullopt;
  return Face{support.X_WS * primitive->X_OS * Pose::from_translation({0.0, 0.0, 0.5 * box->size.z()}),
              0.5 * box->size.x(), 0.5 * box->size.y()};
}

/// The sampled points (in C) that the face may have returned, and how many pixels should show it.
struct Candidates {
  std::vector<Vector3d> points_C;
  int expected = 0;  ///< Pixels on the face with a measurement that is not of something nearer.
};

/// What a threshold for near points is at this depth.
double at_depth(double threshold, double z) { return threshold * std::max(1.0, kGrowth * z * z); }

Candidates candidates_of(const SampledDepth& sampled, const Face& face, const Pose& X_CF) {
  Candidates found;
  found.points_C.reserve(sampled.points_C.size());
  const Pose X_FC = X_CF.inverse();
  const geometry::Matrix3d R_FC = X_FC.rotation.toRotationMatrix();
  const Vector3d normal = X_CF.rotation * Vector3d::UnitZ();
  const double offset = normal.dot(X_CF.translation);
  const geometry::PixelRays rays(sampled.camera);
  for (int y = 0; y < sampled.camera.height; ++y)
    for (int x = 0; x < sampled.camera.width; ++x) {
      const double z = sampled.depth(x, y);
      if (z <= 0.0) continue;
      const Vector3d ray = rays.unproject(x, y, 1.0);
      const double along = normal.dot(ray);
      if (std::abs(along) < 1e-9) continue;
      const double expected = offset / along;
      if (expected <= 0.0) continue;
      const Vector3d foot = R_FC * (expected * ray) + X_FC.translation;
      if (std::abs(foot.x()) > face.half_x || std::abs(foot.y()) > face.half_y) continue;
      const Vector3d& p_C = sampled.points_C[static_cast<std::size_t>(y * sampled.camera.width + x)];
      const double above = normal.dot(p_C) - offset;
      const double gate = at_depth(kFaceGate, z);
      if (above > gate) continue;  // something stands on it, or before it
      ++found.expected;
      if (above > -gate) found.points_C.push_back(p_C);
    }
  return found;
}

/// Those of the points that lie on the plane, put into `inliers`, which has room for all.
std::span<const Vector3d> inliers_of(const geometry::Plane& plane_C, std::span<const Vector3d> points_C,
                                     std::vector<Vector3d>& inliers) {
  std::size_t count = 0;
  for (const Vector3d& p : points_C) {
    inliers[count] = p;
    count += std::abs(plane_C.signed_distance(p)) < at_depth(kInlier, p.z()) ? 1 : 0;
  }
  return {inliers.data(), count};
}

}  // namespace

bool is_found_support(const std::string& name) {
  const std::string_view base = kFoundSupport;
  if (name == base) return true;
  const std::size_t digits = base.size() + 1;
  return name.rfind(std::string(base) + "_", 0) == 0 && name.size() > digits &&
         name.find_first_not_of("0123456789", digits) == std::string::npos;
}

std::optional<SupportMeasurement> measure_support(const SampledDepth& sampled, const Pose& X_WC,
                                                  const belief::Support& support) {
  const std::optional<Face> face = upper_face(support);
  if (!face) return std::nullopt;
  const Pose X_CF = X_WC.inverse() * face->X_WF;
  if ((X_CF.inverse().translation).z() <= 0.0) return std::nullopt;  // seen from below
  const Candidates seen = candidates_of(sampled, *face, X_CF);
  if (static_cast<int>(seen.points_C.size()) < kFewestFacePixels) return std::nullopt;

  geometry::Plane plane_C = fit_plane(seen.points_C);
  std::vector<Vector3d> memory(seen.points_C.size());
  std::span<const Vector3d> inliers;
  for (int round = 0; round < 3; ++round) {
    inliers = inliers_of(plane_C, seen.points_C, memory);
    if (static_cast<int>(inliers.size()) < kFewestFacePixels) return std::nullopt;
    plane_C = fit_plane(inliers);
  }
  SupportMeasurement measured;
  measured.support = support.name;
  measured.pixels = static_cast<int>(inliers.size());
  measured.share = static_cast<double>(inliers.size()) / seen.expected;
  if (measured.share < kLeastFaceShare) return std::nullopt;
  double squares = 0.0;
  for (const Vector3d& p : inliers) squares += std::pow(plane_C.signed_distance(p), 2);
  measured.rms = std::sqrt(squares / static_cast<double>(inliers.size()));

  const Vector3d believed = face->X_WF.rotation * Vector3d::UnitZ();
  measured.plane_W.normal = X_WC.rotation * plane_C.normal;
  measured.plane_W.offset = plane_C.offset - measured.plane_W.normal.dot(X_WC.translation);
  const double cosine = measured.plane_W.normal.dot(believed);
  if (cosine < 0.5) return std::nullopt;
  measured.tilt = std::atan2(measured.plane_W.normal.cross(believed).norm(), cosine);
  const Vector3d& middle = face->X_WF.translation;
  measured.height = -measured.plane_W.signed_distance(middle) / cosine;
  measured.p_WQ = middle + measured.height * believed;
  return measured;
}

void correct_support(const SupportMeasurement& measured, double gain, belief::Support& support) {
  const std::optional<Face> face = upper_face(support);
  if (!face) return;
  const Vector3d believed = face->X_WF.rotation * Vector3d::UnitZ();
  const Vector3d axis = believed.cross(measured.plane_W.normal);
  const double sine = axis.norm();
  Vector3d turn = Vector3d::Zero();
  if (sine > 1e-12) turn = gain * measured.tilt / sine * axis;
  // About the face's middle, then up.
  Pose motion;
  motion.rotation = geometry::exp_rotation(turn);
  const Vector3d& middle = face->X_WF.translation;
  motion.translation = middle + gain * (measured.p_WQ - middle) - motion.rotation * middle;
  support.X_WS = geometry::normalized(motion * support.X_WS);
}

}  // namespace prescene::filter
