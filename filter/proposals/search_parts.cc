// SPDX-License-Identifier: Apache-2.0
// Parts of detect() that others use, too.
#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/filter/proposals/detection.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

// Log odds of a find, see probability_right: logistic regression on simulated rooms (docs/studies/tracking.md).
constexpr double kOddsAtFull = 1.9;         // of an object with the usual log ratio that matches as well as expected
constexpr double kUsualLogRatio = 200.0;    // nats
constexpr double kOddsOfSize = 1.3;         // per factor e of the log ratio
constexpr double kOddsOfLack = 13.8;        // per share of the expected evidence that is missing
constexpr double kLeastSupportArea = 0.05;  // m^2; a smaller flat patch may be a face of an object
constexpr double kFacesOfASupport = 1.4;    // a support or a wall is so much larger than the largest face of an object

}  // namespace

std::vector<Pose> cluster_starts(const Cluster& cluster, const SearchTarget& target, const Vector3d& up_C,
                                 double standing_share, int count, const core::RandomStream& stream) {
  core::RandomStream draws = stream;
  std::vector<Pose> starts;
  for (int i = 0; i < count; ++i) {
    const Vector3d& seen = cluster.points_C[draws.uniform_below(cluster.points_C.size())];
    // The centre lies behind the seen surface by up to the radius.
    const Vector3d centre =
        seen + draws.uniform(0.0, 0.6) * static_cast<double>(target.mesh->radius) * seen.normalized();
    Pose X_CO;
    X_CO.rotation = geometry::uniform_rotation(draws);
    if (draws.uniform() < standing_share) {
      // Turned by the least angle that brings the axis nearest to up there: which axis, and the turn about up, stay
      // uniform.
      const geometry::Matrix3d R = X_CO.rotation.toRotationMatrix();
      Eigen::Index axis = 0;
      (R.transpose() * up_C).cwiseAbs().maxCoeff(&axis);
      const Vector3d nearest = R.col(axis) * (R.col(axis).dot(up_C) < 0.0 ? -1.0 : 1.0);
      X_CO.rotation = (geometry::rotation_between(nearest, up_C) * X_CO.rotation).normalized();
    }
    X_CO.translation = centre - X_CO.rotation * target.centre();
    starts.push_back(X_CO);
  }
  return starts;
}

geometry::Image<std::uint8_t> explained_pixels(const SampledDepth& sampled, const geometry::DepthImage& known,
                                               const geometry::PinholeCamera& camera, double tolerance) {
  geometry::Image<std::uint8_t> explained(sampled.camera.width, sampled.camera.height);
  if (known.empty()) return explained;
  for (int y = 0; y < explained.height(); ++y)
    for (int x = 0; x < explained.width(); ++x) {
      const double z = sampled.depth(x, y);
      if (z == 0.0) continue;
      const Eigen::Vector2d pixel =
          camera.project(sampled.points_C[static_cast<std::size_t>(y * explained.width() + x)]);
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      const double near = tolerance * tolerance_growth(z);
      // The neighbours' surfaces count too: outlines are no sharper than a reduced pixel.
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) {
          if (u + du < 0 || v + dv < 0 || u + du >= known.width() || v + dv >= known.height()) continue;
          const float surface = known(u + du, v + dv);
          if (surface > 0.0f && z > surface - near && z < surface + 2.0 * near) explained(x, y) = 1;
        }
    }
  return explained;
}

double probability_right(const rendering::PoseEvidence& evidence, double expected_evidence) {
  if (!(evidence.log_ratio > 0.0) || !(expected_evidence > 0.0)) return 0.0;
  // Infinite: what to expect is not known.
  const double share =
      std::isfinite(expected_evidence) ? evidence.log_ratio_per_visible_pixel() / expected_evidence : 1.0;
  const double log_odds = kOddsAtFull + kOddsOfSize * std::log(evidence.log_ratio / kUsualLogRatio) -
                          kOddsOfLack * std::max(0.0, 1.0 - share);
  return 1.0 / (1.0 + std::exp(-log_odds));
}

double least_support_area(std::span<const WantedModel> wanted) {
  double largest = 0.0;
  for (const WantedModel& model : wanted) {
    geometry::Box box;
    for (const auto& vertex : model.target.mesh->vertices) box.extend(vertex.cast<double>());
    if (box.isEmpty()) continue;
    const Vector3d size = box.sizes();
    largest = std::max(largest, size.prod() / std::max(size.minCoeff(), 1e-6));
  }
  return std::max(kLeastSupportArea, kFacesOfASupport * largest);
}

}  // namespace prescene::filter
