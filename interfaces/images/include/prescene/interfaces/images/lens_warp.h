// SPDX-License-Identifier: Apache-2.0
// Images seen through a lens, as the pinhole camera alone would have taken them, and the other way round. The map from
// pixel to pixel is worked out once for a camera; OpenCV's remap() applies it.
//
//   const LensWarp straight = LensWarp::undistorting(camera, lens);      // once per calibration, then kept
//   PRESCENE_TRY(const geometry::DepthImage depth, straight.depth(raw_depth));
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/lens.h"

namespace prescene::interfaces {

class LensWarp {
 public:
  /// From images of a valid `camera` with that lens to those of the camera alone, which has the same K and size: what
  /// lies outside of the frame is cut off, and pixels that the lens shows nothing of are black and without depth.
  static LensWarp undistorting(const geometry::PinholeCamera& camera, const geometry::LensDistortion& lens);
  /// What the lens would have made of images of the camera alone: for simulated cameras.
  static LensWarp distorting(const geometry::PinholeCamera& camera, const geometry::LensDistortion& lens);

  /// Colour is interpolated bilinearly, at steps of 1/32 pixel. Depth and labels are those of the nearest pixel: a mean
  /// of two depths is on neither surface. kInvalidInput when the size is not the camera's.
  core::Result<geometry::ColorImage> color(const geometry::ColorImage& image) const;
  core::Result<geometry::DepthImage> depth(const geometry::DepthImage& image) const;
  core::Result<geometry::LabelImage> labels(const geometry::LabelImage& image) const;

  /// Of the pixels of the image that comes out, those that show anything.
  double visible_share() const;

 private:
  template <class FromPixel>
  LensWarp(const geometry::PinholeCamera& camera, const FromPixel& source_of);

  int width_ = 0;
  int height_ = 0;
  // The forms of OpenCV's fixed-point maps: whole pixels x, y with the number of the 32 x 32 fractions, and the nearest
  // pixels. (Given the fractions, OpenCV 4.6 takes the pixel on the other side for the nearest.)
  std::vector<std::int16_t> pixel_;
  std::vector<std::uint16_t> fraction_;
  std::vector<std::int16_t> nearest_;
  std::int64_t visible_ = 0;
};

}  // namespace prescene::interfaces
