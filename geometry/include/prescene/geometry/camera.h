// SPDX-License-Identifier: Apache-2.0
// Pinhole camera: frame C is optical (x right, y down, z forward); pixel centres are at integer coordinates.
#pragma once

#include <Eigen/Core>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Focal lengths and principal point in pixels; the centre of the top-left pixel is (0, 0).
struct PinholeCamera {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  friend bool operator==(const PinholeCamera&, const PinholeCamera&) = default;

  /// Pixel of a point with positive z in C.
  Eigen::Vector2d project(const Vector3d& p_CQ) const {
    return {fx * p_CQ.x() / p_CQ.z() + cx, fy * p_CQ.y() / p_CQ.z() + cy};
  }
  /// The point in C at a pixel and depth z (not range), metres.
  Vector3d unproject(double u, double v, double depth) const {
    return {(u - cx) / fx * depth, (v - cy) / fy * depth, depth};
  }
  /// The camera whose pixel (i, j) looks along this camera's pixel (offset + step * i, offset + step * j), so depth
  /// can be subsampled (never averaged: flying pixels): cx' = (cx - offset) / step. Size is rounded up to what fits.
  PinholeCamera subsampled(int step, int offset) const;
};

/// Sizes positive and at most 16384, focal lengths positive, all finite; the message names the field.
core::Status validate(const PinholeCamera& camera);

/// The same of a camera that took an image, and not of one that a picture is drawn with: also focal lengths from 1 to
/// 1e5 pixels, and a principal point within 1e5 pixels of the first one. Intrinsics beyond that are damaged.
core::Status validate_sensor(const PinholeCamera& camera);

}  // namespace prescene::geometry
