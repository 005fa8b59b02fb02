// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/fit_judgement.h"

#include <algorithm>
#include <cmath>

#include "detection_parts.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

constexpr double kFarThrough = 0.03;  // m behind the surface
constexpr double kNearPoint = 0.015;  // m between a cluster's point and the surface that explains it
constexpr double kOneSurface = 0.03;  // m between neighbouring pixels of which a normal is made
constexpr double kMatchSigma = 3.0;   // standard deviations
constexpr double kSameRest = 0.25;    // rad: ways to lie that round things pass through count together
constexpr double kMostRatio = 3.0;    // of ln ratios to rivals: beyond, they are none

// Log odds that a pose is right (probability_of_fit), fitted to the 1,151 finds in 260 simulated rooms.
constexpr double kOddsAtBest = 9.1;    // of one that explains all that is expected, without residual and as rivals go
constexpr double kOddsOfShare = -9.6;  // per share of the expected evidence that is missing
constexpr double kOddsOfOutline = -12.5;  // per share of the outline past which the surface goes on
constexpr double kOddsOfResidual = -6.9;  // per standard deviation of the root mean square residual
constexpr double kOddsOfModels = 0.62;    // per factor e between its log ratio and that of the best other model ...
constexpr double kOddsOfPoses = 0.37;     // ... and of its own model elsewhere, ...
constexpr double kMostOfRivals = 1.0;     // ... up to so many

// Log odds that a find is right (probability_of_find), fitted to 1,251 finds in the same rooms.
constexpr double kFindOddsOfFit = 1.25;     // per log odds of its fit
constexpr double kFindOddsOfMargin = 1.23;  // per factor e of the margin ...
constexpr double kLeastMargin = 0.01;       // ... which is at least that: errors that pixels share make this much

float ln_ratio(double own, double rival) {
  if (!(rival > 1.0)) return static_cast<float>(kMostRatio);
  return static_cast<float>(std::clamp(std::log(std::max(1.0, own) / rival), -kMostRatio, kMostRatio));
}

/// The measured normal at a pixel, turned to the camera; zero where there is none.
Vector3d measured_normal(const rendering::FrameTerms& terms, int x, int y) {
  if (x + 1 >= terms.camera.width || y + 1 >= terms.camera.height) return Vector3d::Zero();
  const auto at = [&](int u, int v) -> Vector3d {
    return terms.camera.unproject(u, v, static_cast<double>(terms.depth(u, v)));
  };
  const Vector3d p = at(x, y), right = at(x + 1, y), below = at(x, y + 1);
  if (!(right.z() > 0.0) || !(below.z() > 0.0) || std::abs(right.z() - p.z()) > kOneSurface ||
      std::abs(below.z() - p.z()) > kOneSurface)
    return Vector3d::Zero();
  const Vector3d n = (below - p).cross(right - p);
  if (n.norm() < 1e-12) return Vector3d::Zero();
  return n.normalized() * (n.dot(p) > 0.0 ? -1.0 : 1.0);
}

}  // namespace

double probability_of_fit(const FitNumbers& numbers) {
  const auto number = [&](FitNumber which) { return static_cast<double>(numbers[which]); };
  const double log_odds = kOddsAtBest + kOddsOfShare * std::max(0.0, 1.0 - number(kFitEvidenceShare)) +
                          kOddsOfOutline * (1.0 - number(kFitOutline)) + kOddsOfResidual * number(kFitResidual) +
                          kOddsOfModels * std::min(kMostOfRivals, number(kFitRivalModels)) +
                          kOddsOfPoses * std::min(kMostOfRivals, number(kFitRivalPoses));
  return 1.0 / (1.0 + std::exp(-log_odds));
}

double probability_of_find(double probability, double margin) {
  const double p = std::clamp(probability, 1e-6, 1.0 - 1e-6);
  const double log_odds =
      kFindOddsOfFit * std::log(p / (1.0 - p)) + kFindOddsOfMargin * std::log(std::clamp(margin, kLeastMargin, 1.0));
  return 1.0 / (1.0 + std::exp(-log_odds));
}

void set_rivals(const Fit& fit, FitNumbers& numbers) {
  numbers[kFitRivalModels] = ln_ratio(fit.evidence.log_ratio, fit.rival_models);
  numbers[kFitRivalPoses] = ln_ratio(fit.evidence.log_ratio, fit.rival_poses);
}

FitNumbers fit_numbers(const Fit& fit, const rendering::FrameTerms& terms, rendering::Renderer& renderer) {
  FitNumbers numbers{};
  const auto set = [&](FitNumber which, double value) { numbers[which] = static_cast<float>(value); };
  set_rivals(fit, numbers);
  rendering::RenderScene scene;
  scene.instances.push_back({fit.target->mesh, fit.X_CO, fit.target->material});
  rendering::RenderOptions options;
  options.normals = true;
  rendering::RenderedView view;
  // The camera was checked when the frame was prepared: a failure is a lost device, which the filter's renderer counts.
  if (!renderer.render(scene, terms.camera, Pose::identity(), options, &view).ok()) return numbers;

  const rendering::PoseEvidence& e = fit.evidence;
  const double expected = rendering::expected_evidence(terms, fit.target->material, view.depth, view.normals).of_all;
  set(kFitEvidence, std::log(std::max(1.0, e.log_ratio)));
  set(kFitEvidencePerPixel, e.log_ratio_per_visible_pixel());
  set(kFitEvidenceShare, expected > 0.0 ? std::clamp(e.log_ratio_per_visible_pixel() / expected, -2.0, 2.0) : 0.0);
  set(kFitExpected, expected);
  set(kFitHits, e.hit_share());
  set(kFitVisible, e.in_view > 0 ? static_cast<double>(e.visible) / e.in_view : 0.0);
  set(kFitPixels, std::log(1.0 + e.visible));
  set(kFitOutline, outline_support(terms, view.depth, kOutlineStep, OutlineHoles::kSayNothing, fit.color));
  set(kFitStands, fit.stands ? 1.0 : 0.0);

  int covered = 0, hidden = 0, behind = 0, far_behind = 0, front = 0, missing = 0, hits = 0, normals = 0, border = 0;
  double sum = 0.0, squares = 0.0, cosines = 0.0;
  geometry::Matrix3d scatter = geometry::Matrix3d::Zero();
  Vector3d mean_normal = Vector3d::Zero();
  for (int y = 0; y < terms.camera.height; ++y)
    for (int x = 0; x < terms.camera.width; ++x) {
      const double d = static_cast<double>(view.depth(x, y));
      if (!(d > 0.0)) continue;
      border += x == 0 || y == 0 || x + 1 == terms.camera.width || y + 1 == terms.camera.height ? 1 : 0;
      const double known = static_cast<double>(terms.known(x, y));
      if (known > 0.0 && known < d) {
        ++hidden;
        continue;
      }
      ++covered;
      const double z = static_cast<double>(terms.depth(x, y));
      if (!(z > 0.0)) {
        ++missing;
        continue;
      }
      const Vector3d normal = view.normals(x, y).cast<double>();
      const Vector3d ray = terms.camera.unproject(x, y, 1.0).normalized();
      const double t = (z - d) / terms.model.hit_sigma(d, std::abs(normal.dot(ray)));
      if (t > kMatchSigma) {
        ++behind;
        far_behind += z > d + kFarThrough ? 1 : 0;
      } else if (t < -kMatchSigma) {
        ++front;
      } else {
        ++hits;
        sum += t;
        squares += t * t;
        scatter += normal * normal.transpose();
        mean_normal += normal;
        const Vector3d measured = measured_normal(terms, x, y);
        if (measured.squaredNorm() > 0.5) ++normals, cosines += measured.dot(normal);
      }
    }
  const double all = std::max(1, covered), matching = std::max(1, hits);
  set(kFitBehind, behind / all);
  set(kFitFarBehind, far_behind / all);
  set(kFitInFront, front / all);
  set(kFitMissing, missing / all);
  set(kFitMeanResidual, sum / matching);
  set(kFitResidual, std::sqrt(squares / matching));
  set(kFitNormals, normals > 0 ? cosines / normals : 0.0);
  mean_normal /= matching;
  set(kFitNormalSpread, hits > 0 ? (scatter / matching - mean_normal * mean_normal.transpose()).trace() : 0.0);
  set(kFitHidden, hidden / std::max(1.0, static_cast<double>(covered + hidden)));
  set(kFitBorder, border / std::max(1.0, static_cast<double>(covered + hidden)));

  int explained = 0;
  for (const Vector3d& p : fit.cluster_C) {
    const Eigen::Vector2d pixel = terms.camera.project(p);
    const int u = std::clamp(static_cast<int>(std::lround(pixel.x())), 0, terms.camera.width - 1);
    const int v = std::clamp(static_cast<int>(std::lround(pixel.y())), 0, terms.camera.height - 1);
    const double d = static_cast<double>(view.depth(u, v));
    explained += d > 0.0 && std::abs(d - p.z()) < kNearPoint * tolerance_growth(p.z()) ? 1 : 0;
  }
  set(kFitCluster, explained / std::max(1.0, static_cast<double>(fit.cluster_C.size())));
  set(kFitClusterSize, std::log(1.0 + static_cast<double>(fit.cluster_C.size())));

  const Vector3d up_O = fit.X_CO.rotation.conjugate() * fit.up_C;
  double nearest = std::acos(-1.0), probability = 1e-3;
  if (fit.learned != nullptr)
    for (const LearnedRest& rest : fit.learned->rests) {
      const Vector3d up_rest(rest.up_O[0], rest.up_O[1], rest.up_O[2]);
      const double angle = std::acos(std::clamp(up_O.dot(up_rest), -1.0, 1.0));
      nearest = std::min(nearest, angle);
      if (angle < kSameRest) probability += static_cast<double>(rest.probability);
    }
  set(kFitRestAngle, nearest);
  set(kFitRestProbability, std::log(probability));
  set(kFitRadius, static_cast<double>(fit.target->mesh->radius));
  set(kFitDepth, (fit.X_CO * fit.target->centre()).z());
  return numbers;
}

}  // namespace prescene::filter
