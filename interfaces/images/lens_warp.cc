// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/lens_warp.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "opencv_calls.h"
#include "prescene/core/check.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using geometry::LensDistortion;
using geometry::PinholeCamera;

static_assert(sizeof(geometry::Rgb) == 3, "a pixel of an image is one of OpenCV's CV_8UC3");

constexpr int kFractions = 32;             // of a pixel, in OpenCV's fixed-point maps
constexpr std::int16_t kOutside = -2;      // so far out that no pixel of the image counts
constexpr int kMostPixelsOfASide = 16384;  // as of validate(camera): whole pixels fit 16 bits

Eigen::Vector2d normalised(const PinholeCamera& camera, int x, int y) {
  return {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy};
}

/// The place in an image in fractions of a pixel; none outside of it, where a pixel reaches half a pixel around its
/// centre.
std::optional<int> fixed_point(double at, int size) {
  if (!(at >= -0.5 && at < size - 0.5)) return std::nullopt;
  return static_cast<int>(std::lround(std::clamp(at, 0.0, size - 1.0) * kFractions));
}

/// A map as OpenCV takes it. Without fractions the pixels are taken as they are.
struct Map {
  int width;
  int height;
  const std::vector<std::int16_t>& pixel;
  const std::vector<std::uint16_t>* fraction;
};

template <class Pixel>
Result<geometry::Image<Pixel>> warped(const geometry::Image<Pixel>& image, int type, const Map& map) {
  const int width = map.width;
  const int height = map.height;
  if (image.width() != width || image.height() != height) {
    return core::invalid_input("the image has " + std::to_string(image.width()) + " x " +
                               std::to_string(image.height()) + " pixels, but the lens was calibrated for " +
                               std::to_string(width) + " x " + std::to_string(height));
  }
  geometry::Image<Pixel> out(width, height);
  PRESCENE_RETURN_IF_ERROR(with_opencv([&] {
    const cv::Mat fraction = map.fraction ? input_matrix(map.fraction->data(), width, height, CV_16UC1) : cv::Mat();
    cv::Mat to = matrix_over(out.data(), width, height, type);
    cv::remap(input_matrix(image.data(), width, height, type), to,
              input_matrix(map.pixel.data(), width, height, CV_16SC2), fraction,
              map.fraction ? cv::INTER_LINEAR : cv::INTER_NEAREST, cv::BORDER_CONSTANT);
    check_in_place(to, out.data());
  }));
  return out;
}

}  // namespace

template <class FromPixel>
LensWarp::LensWarp(const PinholeCamera& camera, const FromPixel& source_of)
    : width_(camera.width), height_(camera.height) {
  PRESCENE_CHECK(width_ <= kMostPixelsOfASide && height_ <= kMostPixelsOfASide);
  const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  pixel_.reserve(2 * size);
  fraction_.reserve(size);
  nearest_.reserve(2 * size);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      std::optional<int> u;
      std::optional<int> v;
      if (const std::optional<Eigen::Vector2d> source = source_of(normalised(camera, x, y))) {
        u = fixed_point(camera.fx * source->x() + camera.cx, width_);
        v = fixed_point(camera.fy * source->y() + camera.cy, height_);
      }
      const bool seen = u && v;
      for (const std::optional<int>& at : {u, v}) {
        pixel_.push_back(seen ? static_cast<std::int16_t>(*at / kFractions) : kOutside);
        nearest_.push_back(seen ? static_cast<std::int16_t>((*at + kFractions / 2) / kFractions) : kOutside);
      }
      fraction_.push_back(seen ? static_cast<std::uint16_t>(*v % kFractions * kFractions + *u % kFractions) : 0);
      visible_ += seen ? 1 : 0;
    }
  }
}

LensWarp LensWarp::undistorting(const PinholeCamera& camera, const LensDistortion& lens) {
  return {camera, [&lens](const Eigen::Vector2d& p) { return lens.distort(p); }};
}

LensWarp LensWarp::distorting(const PinholeCamera& camera, const LensDistortion& lens) {
  return {camera, [&lens](const Eigen::Vector2d& q) { return lens.undistort(q); }};
}

Result<geometry::ColorImage> LensWarp::color(const geometry::ColorImage& image) const {
  return warped(image, CV_8UC3, {width_, height_, pixel_, &fraction_});
}

Result<geometry::DepthImage> LensWarp::depth(const geometry::DepthImage& image) const {
  return warped(image, CV_32FC1, {width_, height_, nearest_, nullptr});
}

Result<geometry::LabelImage> LensWarp::labels(const geometry::LabelImage& image) const {
  return warped(image, CV_16UC1, {width_, height_, nearest_, nullptr});
}

double LensWarp::visible_share() const {
  return fraction_.empty() ? 0.0 : static_cast<double>(visible_) / static_cast<double>(fraction_.size());
}

}  // namespace prescene::interfaces
