// SPDX-License-Identifier: Apache-2.0
// Lens distortion: where the ray of an ideal pinhole camera arrives in the image of a real one. Points are in
// normalised image coordinates, (x / z, y / z) in the frame of the camera. The models and the order of their
// coefficients are those of OpenCV's camera calibration and of ROS's CameraInfo:
//
//   - plumb_bob k1 k2 p1 p2 [k3]: radial polynomial and decentring [Brown 1971];
//   - rational_polynomial k1 k2 p1 p2 k3 k4 k5 k6: the radial polynomial is divided by 1 + k4 r^2 + k5 r^4 + k6 r^6;
//   - equidistant k1 k2 k3 k4: a fisheye, the image's radius is a polynomial of the ray's angle [Kannala and Brandt
//   2006].
//
// A polynomial describes a lens only as far as it was fitted to one. Further out it turns round and would put several
// rays at the same place; points there have no image.
//
//   PRESCENE_TRY(const LensDistortion lens, LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0}));
//   if (const auto there = lens.distort({0.3, -0.2})) ...    // where the pixel of that ray is
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>

#include "prescene/core/status.h"

namespace prescene::geometry {

class LensDistortion {
 public:
  enum class Model { kNone, kBrown, kEquidistant };

  /// No distortion.
  LensDistortion() = default;
  /// plumb_bob and rational_polynomial: k1 k2 p1 p2 k3 k4 k5 k6. kInvalidInput where one is not finite.
  static core::Result<LensDistortion> brown(const std::array<double, 8>& coefficients);
  /// k1 k2 k3 k4. All zero is a lens, too: an ideal fisheye. kInvalidInput where one is not finite.
  static core::Result<LensDistortion> equidistant(const std::array<double, 4>& coefficients);

  Model model() const { return model_; }
  /// In the order of the function that made it, then zeros.
  const std::array<double, 8>& coefficients() const { return k_; }
  bool is_none() const { return model_ == Model::kNone; }
  /// Rays further than this from the optical axis have no image: there the lens folds, or they are more than 89 degrees
  /// off. Of undistorted points; infinite without distortion.
  double max_radius() const { return max_radius_; }

  /// Where the ray through the undistorted point `p` arrives; none beyond max_radius() or where the decentring folds.
  std::optional<Eigen::Vector2d> distort(const Eigen::Vector2d& p) const;
  /// The ray that arrives at the distorted point `q`, by Newton's method; none where no ray does.
  std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& q) const;

  friend bool operator==(const LensDistortion&, const LensDistortion&) = default;

 private:
  struct Value;  // an image, and how it changes with the point
  LensDistortion(Model model, const std::array<double, 8>& k);
  double radial(double r, double* slope) const;
  Value value(const Eigen::Vector2d& p) const;
  std::optional<double> inverse_radial(double distorted) const;

  Model model_ = Model::kNone;
  std::array<double, 8> k_{};
  double max_radius_ = std::numeric_limits<double>::infinity();
};

}  // namespace prescene::geometry
