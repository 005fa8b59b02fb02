// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/lens.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

namespace prescene::geometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// 89 degrees off the axis. A pinhole image cannot show more, and none that is of use shows as much.
constexpr double kLargestRadius = 57.29;
// Steps in angle in which the fold is looked for: 0.02 degrees. A fold that is undone within one is not seen.
constexpr int kScanSteps = 4450;

template <std::size_t n>
core::Status check_finite(const std::array<double, n>& coefficients) {
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(coefficients[i]))
      return core::invalid_input("lens coefficient " + std::to_string(i) + " is not finite: give a number");
  }
  return core::ok_status();
}

}  // namespace

struct LensDistortion::Value {
  Vector2d at;
  Matrix2d slope;
};

LensDistortion::LensDistortion(Model model, const std::array<double, 8>& k) : model_(model), k_(k) {
  // Up to the first place where the image's radius does not grow with that of the point.
  const auto grows = [this](double r) {
    double slope = 0.0;
    const double image = radial(r, &slope);
    return std::isfinite(image) && slope > 0.0 && image >= 0.0;
  };
  const double largest_angle = std::atan(kLargestRadius);
  double sound = 0.0;
  double folded = kLargestRadius;
  bool folds = false;
  for (int i = 1; i <= kScanSteps && !folds; ++i) {
    const double r = std::tan(largest_angle * i / kScanSteps);
    folds = !grows(r);
    (folds ? folded : sound) = r;
  }
  for (int i = 0; i < 60 && folds; ++i) {
    const double middle = 0.5 * (sound + folded);
    (grows(middle) ? sound : folded) = middle;
  }
  max_radius_ = sound;
}

core::Result<LensDistortion> LensDistortion::brown(const std::array<double, 8>& coefficients) {
  PRESCENE_RETURN_IF_ERROR(check_finite(coefficients));
  return LensDistortion(Model::kBrown, coefficients);
}

core::Result<LensDistortion> LensDistortion::equidistant(const std::array<double, 4>& coefficients) {
  PRESCENE_RETURN_IF_ERROR(check_finite(coefficients));
  return LensDistortion(Model::kEquidistant, {coefficients[0], coefficients[1], coefficients[2], coefficients[3]});
}

/// The image's radius without decentring.
double LensDistortion::radial(double r, double* slope) const {
  if (model_ == Model::kEquidistant) {
    const double angle = std::atan(r);
    const double a2 = angle * angle;
    *slope = (1.0 + a2 * (3.0 * k_[0] + a2 * (5.0 * k_[1] + a2 * (7.0 * k_[2] + a2 * 9.0 * k_[3])))) / (1.0 + r * r);
    return angle * (1.0 + a2 * (k_[0] + a2 * (k_[1] + a2 * (k_[2] + a2 * k_[3]))));
  }
  const double r2 = r * r;
  const double above = 1.0 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]));
  const double below = 1.0 + r2 * (k_[5] + r2 * (k_[6] + r2 * k_[7]));
  const double above_slope = k_[0] + r2 * (2.0 * k_[1] + r2 * 3.0 * k_[4]);  // by r^2
  const double below_slope = k_[5] + r2 * (2.0 * k_[6] + r2 * 3.0 * k_[7]);
  if (!(below > 0.0)) {
    *slope = 0.0;  // a pole
    return 0.0;
  }
  const double scale = above / below;
  *slope = scale + 2.0 * r2 * (above_slope - scale * below_slope) / below;
  return r * scale;
}

LensDistortion::Value LensDistortion::value(const Vector2d& p) const {
  const double r = p.norm();
  double slope = 1.0;
  const double image = radial(r, &slope);
  const double scale = r > 1e-12 ? image / r : 1.0;
  const Vector2d direction = r > 1e-12 ? Vector2d(p / r) : Vector2d(1.0, 0.0);
  Value value{scale * p, scale * Matrix2d::Identity() + (slope - scale) * direction * direction.transpose()};
  if (model_ == Model::kBrown) {
    const double x = p.x();
    const double y = p.y();
    const double p1 = k_[2];
    const double p2 = k_[3];
    value.at += Vector2d(2.0 * p1 * x * y + p2 * (3.0 * x * x + y * y), p1 * (x * x + 3.0 * y * y) + 2.0 * p2 * x * y);
    Matrix2d decentring;
    decentring << 2.0 * p1 * y + 6.0 * p2 * x, 2.0 * p1 * x + 2.0 * p2 * y,  //
        2.0 * p1 * x + 2.0 * p2 * y, 6.0 * p1 * y + 2.0 * p2 * x;
    value.slope += decentring;
  }
  return value;
}

std::optional<Vector2d> LensDistortion::distort(const Vector2d& p) const {
  if (is_none()) return p;
  if (!(p.norm() <= max_radius_)) return std::nullopt;
  const Value value = this->value(p);
  if (!(value.slope.determinant() > 0.0) || !value.at.allFinite()) return std::nullopt;
  return value.at;
}

/// The radius whose image is `distorted`, by Newton's method kept within a bracket; none beyond the fold.
std::optional<double> LensDistortion::inverse_radial(double distorted) const {
  double slope = 0.0;
  if (!(distorted <= radial(max_radius_, &slope))) return std::nullopt;
  double low = 0.0;
  double high = max_radius_;
  double r = std::min(distorted, 0.5 * high);
  for (int i = 0; i < 200; ++i) {
    const double difference = radial(r, &slope) - distorted;
    (difference > 0.0 ? high : low) = r;
    double next = r - difference / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-15 * (1.0 + r)) return next;
    r = next;
  }
  return r;
}

std::optional<Vector2d> LensDistortion::undistort(const Vector2d& q) const {
  if (is_none()) return q;
  const double distorted = q.norm();
  if (!std::isfinite(distorted)) return std::nullopt;
  if (distorted < 1e-300) return Vector2d(0.0, 0.0);
  std::optional<double> r = inverse_radial(distorted);
  const bool is_decentred = model_ == Model::kBrown && (k_[2] != 0.0 || k_[3] != 0.0);
  if (!is_decentred) {
    if (!r) return std::nullopt;
    return Vector2d(q * (*r / distorted));
  }
  // Decentring may bring in what the radial part alone puts beyond the fold: started at the fold.
  Vector2d p = q * (r.value_or(0.99 * max_radius_) / distorted);
  for (int i = 0; i < 50; ++i) {
    const Value value = this->value(p);
    if (!(std::abs(value.slope.determinant()) > 1e-12)) return std::nullopt;
    const Vector2d step = value.slope.inverse() * (q - value.at);
    p += step;
    if (!p.allFinite()) return std::nullopt;
    if (step.norm() <= 1e-15 * (1.0 + p.norm())) break;
  }
  const std::optional<Vector2d> again = distort(p);
  if (!again || (*again - q).norm() > 1e-10 * (1.0 + distorted)) return std::nullopt;
  return p;
}

}  // namespace prescene::geometry
