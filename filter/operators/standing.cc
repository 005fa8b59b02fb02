// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/standing.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using geometry::Matrix3d;

constexpr double kContactError = 0.001;  // m, of a mesh's base and of a support's face, over the base
constexpr double kContacts = 3.0;        // points that carry it
constexpr double kSupportTilt = 0.0087;  // rad, standard deviation of how a support is tilted against the camera
constexpr double kNear = 0.015;          // m; a face so near to a support may stand on it
constexpr double kSteepest = 0.766;      // cosine; on what is steeper nothing stands
constexpr double kFlatCosine = 0.9994;   // 2 degrees, ...
constexpr double kFlatHeight = 0.002;    // ... m; within these the support is flat below the base
constexpr double kSameWay = 0.26;        // rad; turns that differ by less are one (kRivalTurn)
// Probabilities of what rests near to a support: that it stands on a face, on it or on something thin on it, ...
constexpr double kOnSupport = 0.7;
constexpr double kOnSomething = 0.2;
constexpr double kLeans = 0.1;      // ... or leans;
constexpr double kTilt = 0.1;       // rad, m; standard deviations of the tilt of what leans ...
constexpr double kLifted = 0.01;    // ... and of the height of both
constexpr double kOpenTurn = 0.35;  // rad, m; standard deviations of what a frame says nothing of
constexpr double kOpenPlace = 0.1;
constexpr double kLeastProbability = 0.003;  // of a face: things are also put down
constexpr double kMostOffset = 0.02;         // m; what is further from a support shows something else
constexpr std::size_t kFewestPixels = 8;     // that show a support
constexpr double kOfMedian = 1.86;           // error of a median by the median of deviations, of normal noise
constexpr double kCalibration = 0.005;       // m, standard deviation of where a scene says that a support is
constexpr double kDeepest = 0.05;            // m; what lies deeper in a support is not looked for

/// The support below the object's middle, as far as it may carry it.
std::optional<SupportSurfaces::Hit> support_below(const rendering::RenderMesh& mesh, const SupportSurfaces& supports,
                                                  const Vector3d& up_W, const Pose& X_WO) {
  // From a little higher: the middle of a thin thing that is believed too low is below the surface.
  const Vector3d start = X_WO * mesh.centre.cast<double>() + kNear * up_W;
  auto hit = supports.first_along(start, -up_W, static_cast<double>(mesh.radius) + 2.0 * kNear);
  if (!hit || hit->normal_W.dot(up_W) < kSteepest) return std::nullopt;
  return hit;
}

/// The way to rest whose up is nearest to a direction in O, and the ways that look like it; null where none is near.
std::pair<const Rest*, const std::vector<Rest>*> nearest_rest(const RestingShape& shape, const Vector3d& up_O) {
  std::pair<const Rest*, const std::vector<Rest>*> nearest = {nullptr, nullptr};
  double largest = std::cos(kSameWay);
  for (const std::vector<Rest>& alike : shape.rests)
    for (const Rest& rest : alike) {
      const double cosine = up_O.dot(rest.R_UO.conjugate() * Vector3d::UnitZ());
      if (cosine > largest) nearest = {&rest, &alike}, largest = cosine;
    }
  return nearest;
}

/// nats, of resting with this direction of O upwards.
double log_standing(const RestingShape& shape, const Vector3d& up_O) {
  double probability = 0.0;
  if (const std::vector<Rest>* alike = nearest_rest(shape, up_O).second)
    for (const Rest& rest : *alike) probability += rest.probability;
  if (std::any_of(shape.rolling.begin(), shape.rolling.end(),
                  [&](const Vector3d& direction) { return direction.dot(up_O) > std::cos(kSameWay); }))
    probability += shape.rolling_probability;
  if (probability > 0.0) return std::log((1.0 - kLeans) * std::max(probability, kLeastProbability));
  // Any rotation is as probable as another: the share of all ups that are within kSameWay of this one.
  return std::log(kLeans * 0.5 * (1.0 - std::cos(kSameWay)));
}

/// Where a plane carries a base whose middle is at p_WB: its height along `normal_W`, m; nothing where it is not flat
/// below the base, whose extent the four points beside the middle show.
std::optional<double> flat_below(const SupportSurfaces& supports, const Vector3d& up_W, const Vector3d& normal_W,
                                 const Vector3d& p_WB, const std::array<Vector3d, 4>& beside) {
  const double steepness = normal_W.dot(up_W);
  const auto height_at = [&](const Vector3d& p_W) -> std::optional<double> {
    const auto hit = supports.first_along(p_W + 2.0 * kNear * up_W, -up_W, 4.0 * kNear);
    if (!hit || hit->normal_W.dot(normal_W) < kFlatCosine) return std::nullopt;
    return normal_W.dot(p_W) + (2.0 * kNear - hit->distance) * steepness;
  };
  const auto plane = height_at(p_WB);
  if (!plane) return std::nullopt;
  int carried = 0;
  for (const Vector3d& side : beside) {
    const auto height = height_at(p_WB + side);
    carried += height && std::abs(*height - *plane) < kFlatHeight ? 1 : 0;
  }
  return carried >= 3 ? plane : std::nullopt;
}

/// So much of an information that is certain to be added to a frame's covariance in its direction that the mean moves
/// as the mean of both would: by the probability's share of the step.
double share_of(double probability, double against_frame) {
  return probability / (1.0 + (1.0 - probability) * against_frame);
}

}  // namespace

SupportHeight support_height(const rendering::FrameTerms& terms, const geometry::DepthImage& supports, const Pose& X_CW,
                             const Vector3d& p_WB, const Vector3d& normal_W, double inner, double outer) {
  const geometry::PinholeCamera& camera = terms.camera;
  const Vector3d p_C = X_CW * p_WB, normal_C = X_CW.rotation * normal_W;
  std::vector<double> heights;
  if (p_C.z() > outer) {
    const Eigen::Vector2d middle = camera.project(p_C);
    const auto range = [](double at, double reach, int size) {
      const double last = static_cast<double>(size - 1);
      return std::pair(static_cast<int>(std::ceil(std::clamp(at - reach, 0.0, last + 1.0))),
                       static_cast<int>(std::floor(std::clamp(at + reach, -1.0, last))));
    };
    const auto [first_x, last_x] = range(middle.x(), outer * camera.fx / (p_C.z() - outer), camera.width);
    const auto [first_y, last_y] = range(middle.y(), outer * camera.fy / (p_C.z() - outer), camera.height);
    for (int y = first_y; y <= last_y; ++y)
      for (int x = first_x; x <= last_x; ++x) {
        const double expected = supports(x, y), measured = terms.depth(x, y);
        if (!(expected > 0.0) || !(measured > 0.0)) continue;
        if (!terms.known.empty() && terms.known(x, y) > 0.0F) continue;  // another thing that is known
        const Vector3d on_support = camera.unproject(x, y, expected);
        const double distance = (on_support - p_C).norm();
        if (distance < inner || distance > outer || std::abs(normal_C.dot(on_support - p_C)) > kFlatHeight) continue;
        const double height = normal_C.dot(camera.unproject(x, y, measured) - on_support);
        if (std::abs(height) < kMostOffset) heights.push_back(height);
      }
  }
  const double scene = kCalibration * kCalibration;
  if (heights.size() < kFewestPixels) return {0.0, kCalibration};
  const auto median = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), median, heights.end());
  const double offset = *median;
  for (double& height : heights) height = std::abs(height - offset);
  std::nth_element(heights.begin(), median, heights.end());
  // Neighbouring pixels share their errors.
  const auto pixels = static_cast<double>(heights.size());
  const double independent = pixels * rendering::tempering(terms.tempering.information, pixels, terms.step);
  const double frame = kContactError * kContactError + kOfMedian * kOfMedian * *median * *median / independent;
  return {offset * scene / (scene + frame), std::sqrt(frame * scene / (scene + frame))};
}

std::optional<PoseEquations> standing_equations(
    const RestingShape& shape, const rendering::RenderMesh& mesh, const SupportSurfaces& supports, const Vector3d& up_W,
    const Pose& X_WO, const std::function<SupportHeight(const Vector3d& p_WB, const Vector3d& normal_W)>& height_at,
    const PoseEquations& seen, double common) {
  const auto below = support_below(mesh, supports, up_W, X_WO);
  if (!below) return std::nullopt;
  const Vector3d& normal_W = below->normal_W;
  const Vector3d normal_O = X_WO.rotation.conjugate() * normal_W;
  const Rest* rest = nearest_rest(shape, normal_O).first;
  if (rest == nullptr) return std::nullopt;
  const Matrix3d R_UO = rest->R_UO.toRotationMatrix();
  const Vector3d base_O = R_UO.transpose() * Vector3d(rest->base_middle.x(), rest->base_middle.y(), rest->bottom);
  const Vector3d p_WB = X_WO * base_O;
  const auto to_side = [&](double x, double y) -> Vector3d {
    return X_WO.rotation * (R_UO.transpose() * Vector3d(x, y, 0.0));
  };
  const double x = std::sqrt(rest->base_moments(0, 0)), y = std::sqrt(rest->base_moments(1, 1));
  const auto plane = flat_below(supports, up_W, normal_W, p_WB,
                                {to_side(x, 0.0), to_side(-x, 0.0), to_side(0.0, y), to_side(0.0, -y)});
  if (!plane) return std::nullopt;
  const double believed_gap = normal_W.dot(p_WB) - *plane;
  if (std::abs(believed_gap) > kNear) return std::nullopt;
  const SupportHeight height = height_at(p_WB - believed_gap * normal_W, normal_W);

  // Of a step d: two tilts about axes in the base's plane, which raise a point p of it by w_x p_y - w_y p_x, and the
  // height of its middle; each is zero where the object stands.
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.block<2, 3>(0, 0) = R_UO.topRows<2>();
  J.block<1, 3>(2, 0) = base_O.cross(normal_O).transpose();
  J.block<1, 3>(2, 3) = normal_W.transpose();
  Vector3d off;  // as J d
  off.head<2>() = -Vector3d::UnitZ().cross(Vector3d(R_UO * normal_O)).head<2>();
  off[2] = believed_gap - height.offset;
  // How well each is known of what stands.
  const double contacts = kContacts / (kContactError * kContactError);
  Eigen::Matrix2d tilts;
  tilts << rest->base_moments(1, 1), -rest->base_moments(0, 1), -rest->base_moments(0, 1), rest->base_moments(0, 0);
  tilts *= contacts;
  tilts.diagonal().array() += 1.0 / (kOpenTurn * kOpenTurn);
  const Eigen::Matrix2d tilts_to = tilts.inverse() + kSupportTilt * kSupportTilt * Eigen::Matrix2d::Identity();
  const double height_to = 1.0 / contacts + height.sigma * height.sigma;

  // How far off frames show it, and how likely that is.
  geometry::Matrix6d frame = seen.information;
  frame.diagonal().head<3>().array() += 1.0 / (kOpenTurn * kOpenTurn);
  frame.diagonal().tail<3>().array() += 1.0 / (kOpenPlace * kOpenPlace);
  const geometry::Matrix6d frame_covariance = geometry::inverse_6(frame);
  const Vector3d seen_off = off + J * (frame_covariance * seen.gradient);
  const Matrix3d seen_to = J * frame_covariance * J.transpose();
  const auto likelihood = [&](const Eigen::Matrix2d& tilt_variance, double height_variance) {
    Matrix3d S = common * seen_to;
    S.topLeftCorner<2, 2>() += tilt_variance;
    S(2, 2) += height_variance;
    return std::exp(-0.5 * seen_off.dot(S.inverse() * seen_off)) / std::sqrt(S.determinant());
  };
  const double lifted = kLifted * kLifted;
  const double on_support = kOnSupport * likelihood(tilts_to, height_to);
  const double on_something = kOnSomething * likelihood(tilts_to, height_to + lifted);
  const double leans = kLeans * likelihood(kTilt * kTilt * Eigen::Matrix2d::Identity(), height_to + lifted);
  const double sum = on_support + on_something + leans;
  PoseEquations stands;
  if (!(sum > 0.0)) return stands;
  const double is_flush = (on_support + on_something) / sum;
  const double is_on_support = on_support / sum;
  Matrix3d information = Matrix3d::Zero();
  const Eigen::Matrix2d flush = tilts_to.inverse();
  const double against_tilt = std::max(flush(0, 0) * seen_to(0, 0), flush(1, 1) * seen_to(1, 1));
  information.topLeftCorner<2, 2>() = share_of(is_flush, against_tilt) * flush;
  information(2, 2) = share_of(is_on_support, seen_to(2, 2) / height_to) / height_to;
  stands.information = J.transpose() * information * J;
  stands.gradient = -J.transpose() * (information * off);
  return stands;
}

double log_sunk(const rendering::RenderMesh& mesh, const SupportSurfaces& supports, const Vector3d& up_W,
                const Pose& X_WO) {
  const Eigen::Vector3f up_O = (X_WO.rotation.conjugate() * up_W).cast<float>();
  const auto lowest = std::min_element(mesh.vertices.begin(), mesh.vertices.end(),
                                       [&](const auto& a, const auto& b) { return up_O.dot(a) < up_O.dot(b); });
  if (lowest == mesh.vertices.end()) return 0.0;
  const auto hit = supports.first_along(X_WO * lowest->cast<double>() + kDeepest * up_W, -up_W, kDeepest);
  const double depth = hit ? (kDeepest - hit->distance) / kCalibration : 0.0;
  return -0.5 * depth * depth;
}

StandingOdds::StandingOdds(const RestingShape& shape, const rendering::RenderMesh& mesh,
                           const SupportSurfaces& supports, const Vector3d& up_W, const Pose& followed_X_WO)
    : shape_(shape), mesh_(mesh), supports_(supports), up_W_(up_W), followed_(log_standing_at(followed_X_WO)) {}

double StandingOdds::log_of(const Pose& X_WO) const {
  const auto turned = followed_ ? log_standing_at(X_WO) : std::nullopt;
  return turned ? std::min(0.0, *turned - *followed_) : 0.0;
}

std::optional<double> StandingOdds::log_standing_at(const Pose& X_WO) const {
  const auto below = support_below(mesh_, supports_, up_W_, X_WO);
  if (!below) return std::nullopt;
  return log_standing(shape_, X_WO.rotation.conjugate() * below->normal_W);
}

}  // namespace prescene::filter
