// SPDX-License-Identifier: Apache-2.0
// Images with strides: an owning image and views of anybody's memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::geometry {

/// A view of row-major pixels; `stride` is in elements from one row to the next (>= width). Does not own: the memory
/// must outlive it.
template <class Pixel>
class ImageView {
 public:
  ImageView() = default;
  ImageView(Pixel* data, int width, int height, std::ptrdiff_t stride)
      : data_(data), width_(width), height_(height), stride_(stride) {}
  /// A view of const pixels from one of mutable pixels.
  operator ImageView<const Pixel>() const {
    return {data_, width_, height_, stride_};
  }  // NOLINT(google-explicit-constructor)

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return stride_; }
  bool empty() const { return width_ == 0 || height_ == 0; }
  Pixel* row(int y) const { return data_ + y * stride_; }
  Pixel& operator()(int x, int y) const {
    PRESCENE_DCHECK(x >= 0 && x < width_ && y >= 0 && y < height_);
    return data_[y * stride_ + x];
  }

 private:
  Pixel* data_ = nullptr;
  int width_ = 0;
  int height_ = 0;
  std::ptrdiff_t stride_ = 0;
};

/// An owning image without row padding.
template <class Pixel>
class Image {
 public:
  Image() = default;
  Image(int width, int height, Pixel value = Pixel{})
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), value) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return pixels_.empty(); }
  Pixel* data() { return pixels_.data(); }
  const Pixel* data() const { return pixels_.data(); }
  std::size_t size() const { return pixels_.size(); }
  Pixel& operator()(int x, int y) { return view()(x, y); }
  const Pixel& operator()(int x, int y) const { return view()(x, y); }
  ImageView<Pixel> view() { return {pixels_.data(), width_, height_, width_}; }
  ImageView<const Pixel> view() const { return {pixels_.data(), width_, height_, width_}; }

  friend bool operator==(const Image&, const Image&) = default;

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<Pixel> pixels_;
};

/// Gives an image that size; its pixels are kept only where it has it already.
template <class Pixel>
void resize(Image<Pixel>* image, int width, int height) {
  if (image->width() != width || image->height() != height) *image = Image<Pixel>(width, height);
}

using Rgb = std::array<std::uint8_t, 3>;
using DepthImage = Image<float>;  ///< z in the camera frame, metres; 0 = no measurement or nothing there.
using ColorImage = Image<Rgb>;
using LabelImage = Image<std::uint16_t>;  ///< 0 = background, otherwise 1 + index of the instance.

}  // namespace prescene::geometry
