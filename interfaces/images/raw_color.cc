// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/raw_color.h"

#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "opencv_calls.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

/// The call of OpenCV's cvtColor(); -1 where the pixels are RGB already.
int code_of(RawColor form) {
  switch (form) {
    case RawColor::kRgb:
      return -1;
    case RawColor::kBgr:
      return cv::COLOR_BGR2RGB;
    case RawColor::kRgba:
      return cv::COLOR_RGBA2RGB;
    case RawColor::kBgra:
      return cv::COLOR_BGRA2RGB;
    case RawColor::kGrey:
      return cv::COLOR_GRAY2RGB;
    case RawColor::kBayerRggb:
      return cv::COLOR_BayerRGGB2RGB;
    case RawColor::kBayerBggr:
      return cv::COLOR_BayerBGGR2RGB;
    case RawColor::kBayerGbrg:
      return cv::COLOR_BayerGBRG2RGB;
    case RawColor::kBayerGrbg:
      return cv::COLOR_BayerGRBG2RGB;
    case RawColor::kUyvy:
      return cv::COLOR_YUV2RGB_UYVY;
    case RawColor::kYuyv:
      return cv::COLOR_YUV2RGB_YUY2;
    case RawColor::kNv12:
      return cv::COLOR_YUV2RGB_NV12;
    case RawColor::kNv21:
      return cv::COLOR_YUV2RGB_NV21;
  }
  return -1;
}

std::string size_text(const RawColorView& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels";
}

Status check(const RawColorView& image, const RawColorLayout& layout) {
  if (image.width < 1 || image.height < 1) return core::invalid_input("an image of " + size_text(image) + " is empty");
  if (layout.even_width && image.width % 2 != 0)
    return core::invalid_input("the width of YUV images is even, as two pixels share their colour; this one has " +
                               size_text(image));
  if (layout.even_height && image.height % 2 != 0)
    return core::invalid_input(
        "the height of YUV 4:2:0 images is even, as two rows share their colours; this one has " + size_text(image));
  if (image.width < layout.min_side || image.height < layout.min_side)
    return core::invalid_input("a Bayer image has at least 3 x 3 pixels; this one has " + size_text(image));
  const std::size_t row = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(layout.bytes_per_pixel) *
                          static_cast<std::size_t>(image.sample_bytes);
  const std::size_t rows = static_cast<std::size_t>(image.height) + (layout.has_half_rows ? image.height / 2 : 0);
  // Of a last sample only the first byte is read.
  const std::size_t needed = image.step * (rows - 1) + row - static_cast<std::size_t>(image.sample_bytes - 1);
  if (image.step < row || image.bytes.size() < needed)
    return core::invalid_input("rows of " + std::to_string(image.step) + " bytes and " +
                               std::to_string(image.bytes.size()) + " bytes in all are too few for " +
                               size_text(image));
  return core::ok_status();
}

/// The first byte of each sample.
std::vector<std::uint8_t> first_bytes(const RawColorView& image) {
  std::vector<std::uint8_t> out;
  out.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* in = image.bytes.data() + image.step * static_cast<std::size_t>(y);
    for (int x = 0; x < image.width; ++x) out.push_back(in[static_cast<std::size_t>(x * image.sample_bytes)]);
  }
  return out;
}

}  // namespace

RawColorLayout layout_of(RawColor form) {
  RawColorLayout layout;
  switch (form) {
    case RawColor::kRgb:
    case RawColor::kBgr:
      layout.bytes_per_pixel = 3;
      break;
    case RawColor::kRgba:
    case RawColor::kBgra:
      layout.bytes_per_pixel = 4;
      break;
    case RawColor::kGrey:
      break;
    case RawColor::kBayerRggb:
    case RawColor::kBayerBggr:
    case RawColor::kBayerGbrg:
    case RawColor::kBayerGrbg:
      layout.min_side = 3;
      break;
    case RawColor::kUyvy:
    case RawColor::kYuyv:
      layout.bytes_per_pixel = 2;
      layout.even_width = true;
      break;
    case RawColor::kNv12:
    case RawColor::kNv21:
      layout.even_width = layout.even_height = layout.has_half_rows = true;
      break;
  }
  return layout;
}

Result<geometry::ColorImage> to_color(const RawColorView& image, RawColor form) {
  const RawColorLayout layout = layout_of(form);
  PRESCENE_CHECK(image.sample_bytes == 1 || (layout.bytes_per_pixel == 1 && !layout.has_half_rows));
  PRESCENE_RETURN_IF_ERROR(check(image, layout));
  RawColorView samples = image;
  std::vector<std::uint8_t> memory;
  if (image.sample_bytes > 1) {
    memory = first_bytes(image);
    samples = {memory, image.width, image.height, static_cast<std::size_t>(image.width)};
  }
  geometry::ColorImage color(image.width, image.height);
  PRESCENE_RETURN_IF_ERROR(with_opencv([&] {
    const cv::Mat from = input_matrix(samples.bytes.data(), samples.width,
                                      samples.height + (layout.has_half_rows ? samples.height / 2 : 0),
                                      CV_8UC(layout.bytes_per_pixel), samples.step);
    cv::Mat to = matrix_over(color.data(), image.width, image.height, CV_8UC3);
    if (const int code = code_of(form); code >= 0) {
      cv::cvtColor(from, to, code);
    } else {
      from.copyTo(to);
    }
    check_in_place(to, color.data());
  }));
  return color;
}

}  // namespace prescene::interfaces
