// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/raw_color.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/interfaces/ros_messages/image_view.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::ColorImage;
using geometry::DepthImage;

struct Encoding {
  std::string_view name;
  RawColor form;
  int sample_bytes = 1;  ///< Of samples of 16 bits the upper byte is used.
};

// OpenCV's names without colour order (8UC3) hold blue first. `yuv422` and `yuv422_yuy2` are the names of Humble for
// what Jazzy calls `uyvy` and `yuyv`. ROS has no name for NV12 yet, but drivers use `nv12`.
constexpr std::array<Encoding, 23> kColorEncodings = {{{"rgb8", RawColor::kRgb},
                                                       {"bgr8", RawColor::kBgr},
                                                       {"rgba8", RawColor::kRgba},
                                                       {"bgra8", RawColor::kBgra},
                                                       {"8UC3", RawColor::kBgr},
                                                       {"8UC4", RawColor::kBgra},
                                                       {"mono8", RawColor::kGrey},
                                                       {"8UC1", RawColor::kGrey},
                                                       {"mono16", RawColor::kGrey, 2},
                                                       {"bayer_rggb8", RawColor::kBayerRggb},
                                                       {"bayer_bggr8", RawColor::kBayerBggr},
                                                       {"bayer_gbrg8", RawColor::kBayerGbrg},
                                                       {"bayer_grbg8", RawColor::kBayerGrbg},
                                                       {"bayer_rggb16", RawColor::kBayerRggb, 2},
                                                       {"bayer_bggr16", RawColor::kBayerBggr, 2},
                                                       {"bayer_gbrg16", RawColor::kBayerGbrg, 2},
                                                       {"bayer_grbg16", RawColor::kBayerGrbg, 2},
                                                       {"yuv422", RawColor::kUyvy},
                                                       {"uyvy", RawColor::kUyvy},
                                                       {"yuv422_yuy2", RawColor::kYuyv},
                                                       {"yuyv", RawColor::kYuyv},
                                                       {"nv12", RawColor::kNv12},
                                                       {"nv21", RawColor::kNv21}}};

/// `half_rows` are those that follow the image's rows, as the colours of YUV 4:2:0 do.
Status check_layout(const RosImageView& image, std::uint32_t bytes_per_pixel, const ImageRules& rules,
                    std::uint32_t half_rows = 0) {
  const std::string encoding = quote(image.encoding);
  if (image.width == 0 || image.height == 0) {
    return core::invalid_input("width x height: is " + std::to_string(image.width) + " x " +
                               std::to_string(image.height) + "; send nothing instead of an empty image");
  }
  if (image.width > rules.max_side || image.height > rules.max_side) {
    return core::resource_exhausted("width x height: " + std::to_string(image.width) + " x " +
                                    std::to_string(image.height) + " exceeds the limit of " +
                                    std::to_string(rules.max_side) + " pixels a side; send a smaller image");
  }
  if (std::uint64_t{image.width} * image.height > rules.max_pixels) {
    return core::resource_exhausted("width x height: " + std::to_string(image.width) + " x " +
                                    std::to_string(image.height) + " exceeds the limit of " +
                                    std::to_string(rules.max_pixels) + " pixels; send a smaller image");
  }
  const std::uint64_t row_bytes = std::uint64_t{image.width} * bytes_per_pixel;
  if (image.step < row_bytes) {
    return core::invalid_input("step: " + std::to_string(image.step) + " is less than a row of " +
                               std::to_string(image.width) + " pixels of " + encoding + "; set it to at least " +
                               std::to_string(row_bytes));
  }
  const std::uint64_t needed = std::uint64_t{image.step} * (std::uint64_t{image.height} + half_rows - 1) + row_bytes;
  if (image.data.size() < needed) {
    return core::invalid_input("data: has " + std::to_string(image.data.size()) + " bytes, but step " +
                               std::to_string(image.step) + " x height " + std::to_string(image.height) + " of " +
                               encoding + " needs " + std::to_string(needed) +
                               "; the message is cut or its step or height is wrong");
  }
  if (image.is_bigendian > 1) {
    return core::invalid_input("is_bigendian: is " + std::to_string(image.is_bigendian) + "; set it to 0 or 1");
  }
  return core::ok_status();
}

template <class Word>
Word swapped_bytes(Word value) {
  std::array<std::uint8_t, sizeof(Word)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  std::reverse(bytes.begin(), bytes.end());
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

bool needs_swap(const RosImageView& image) {
  return (image.is_bigendian == 1) != (std::endian::native == std::endian::big);
}

template <class Word>
Word word_at(const RosImageView& image, int x, int y, bool swap) {
  Word value;
  std::memcpy(&value,
              image.data.data() + std::size_t{image.step} * static_cast<std::size_t>(y) +
                  sizeof(Word) * static_cast<std::size_t>(x),
              sizeof value);
  return swap ? swapped_bytes(value) : value;
}

/// Depth in metres, 0 for none.
float depth_of(std::uint16_t value, double metres_per_unit) {
  if (value == 0 || value == std::numeric_limits<std::uint16_t>::max()) return 0.0F;
  return static_cast<float>(value * metres_per_unit);
}
float depth_of(float value, double metres_per_unit) {
  const auto depth = static_cast<float>(static_cast<double>(value) * metres_per_unit);
  return std::isfinite(depth) && depth > 0.0F ? depth : 0.0F;
}

/// Pixels between the samples that doubts are judged by: about 4096 of them in all.
int sample_step(const RosImageView& image) {
  return std::max(1, static_cast<int>(std::sqrt(static_cast<double>(image.width) * image.height / 4096.0)));
}

/// Real depth is smooth nearly everywhere; read in the wrong byte order it jumps from pixel to pixel.
bool looks_swapped(const RosImageView& image, std::uint16_t /*word*/, bool swap) {
  double declared = 0.0;
  double other = 0.0;
  int pairs = 0;
  const int step = sample_step(image);
  for (int y = 0; y < static_cast<int>(image.height); y += step) {
    for (int x = 0; x + 1 < static_cast<int>(image.width); x += step) {
      const auto a = word_at<std::uint16_t>(image, x, y, swap);
      const auto b = word_at<std::uint16_t>(image, x + 1, y, swap);
      if (a == 0 || b == 0) continue;
      declared += std::abs(a - b);
      other += std::abs(swapped_bytes(a) - swapped_bytes(b));
      ++pairs;
    }
  }
  return pairs >= 64 && declared > 8.0 * other + 8.0 * pairs;
}

bool looks_swapped(const RosImageView& image, float /*word*/, bool swap) {
  int declared = 0;
  int other = 0;
  int samples = 0;
  const auto plausible = [](float depth) { return depth > 0.01F && depth < 1000.0F; };
  const int step = sample_step(image);
  for (int y = 0; y < static_cast<int>(image.height); y += step) {
    for (int x = 0; x < static_cast<int>(image.width); x += step) {
      const auto value = word_at<float>(image, x, y, swap);
      declared += plausible(value) ? 1 : 0;
      other += plausible(swapped_bytes(value)) ? 1 : 0;
      ++samples;
    }
  }
  return samples >= 64 && other > samples / 2 && declared < samples / 10;
}

double sampled_median(const DepthImage& depth, int step) {
  std::vector<float> values;
  for (int y = 0; y < depth.height(); y += step) {
    for (int x = 0; x < depth.width(); x += step) {
      if (depth(x, y) > 0.0F) values.push_back(depth(x, y));
    }
  }
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// One row of `image`, in metres; how many of its pixels are measured.
template <class Word>
int read_row(const RosImageView& image, int y, double metres_per_unit, bool swap, std::span<float> row) {
  int measured = 0;
  for (std::size_t x = 0; x < row.size(); ++x) {
    row[x] = depth_of(word_at<Word>(image, static_cast<int>(x), y, swap), metres_per_unit);
    measured += row[x] > 0.0F ? 1 : 0;
  }
  return measured;
}

template <class Word>
DepthImage read_depth(const RosImageView& image, double metres_per_unit, DepthImageReport* report) {
  const bool swap = needs_swap(image);
  DepthImage depth(static_cast<int>(image.width), static_cast<int>(image.height));
  for (int y = 0; y < depth.height(); ++y)
    report->measured += read_row<Word>(image, y, metres_per_unit, swap, {depth.view().row(y), image.width});
  report->missing = static_cast<std::int64_t>(depth.size()) - report->measured;
  report->median_depth = sampled_median(depth, sample_step(image));
  if (looks_swapped(image, Word{}, swap)) {
    report->warnings.push_back("the depth looks byte-swapped: is_bigendian is " + std::to_string(image.is_bigendian) +
                               ", but the bytes seem to be in the other order; correct the sender");
  }
  return depth;
}

constexpr double kLeastMedian = 0.03;  // m: no depth camera measures that

void doubt_small_depth(double least, double metres_per_unit, const char* encoding, DepthImageReport& report) {
  if (report.measured == 0 || report.median_depth >= least) return;
  report.warnings.push_back("the median depth is " + core::rounded_text(report.median_depth) + " m: is a unit of " +
                            number_text(metres_per_unit) + " m right for this sender's " + encoding + "?");
}

}  // namespace

RosImageView view_of(const RosImage& image) {
  return {image.header, image.height, image.width, image.encoding, image.is_bigendian, image.step, image.data};
}

Result<DepthImage> to_depth_image(const RosImage& image, const ImageRules& rules, DepthImageReport* report) {
  return to_depth_image(view_of(image), rules, report);
}

Result<ColorImage> to_color_image(const RosImage& image, const ImageRules& rules) {
  return to_color_image(view_of(image), rules);
}

Result<DepthImage> to_depth_image(const RosImageView& image, const ImageRules& rules, DepthImageReport* report) {
  DepthImageReport own_report;
  if (report == nullptr) report = &own_report;
  *report = {};
  if (image.encoding == "16UC1" || (image.encoding == "mono16" && rules.mono16_is_depth)) {
    PRESCENE_RETURN_IF_ERROR(check_layout(image, 2, rules));
    DepthImage depth = read_depth<std::uint16_t>(image, rules.metres_per_unit_16uc1, report);
    // Whole metres in 16 bits look like that.
    doubt_small_depth(30.0 * rules.metres_per_unit_16uc1, rules.metres_per_unit_16uc1, "16UC1", *report);
    return depth;
  }
  if (image.encoding == "32FC1") {
    PRESCENE_RETURN_IF_ERROR(check_layout(image, 4, rules));
    DepthImage depth = read_depth<float>(image, rules.metres_per_unit_32fc1, report);
    if (report->median_depth > 100.0 && report->warnings.empty()) {
      return core::invalid_input(
          "data: the median depth is " + number_text(report->median_depth) +
          " m: does the sender put millimetres into 32FC1? Send metres, or set the unit of 32FC1 "
          "to 0.001");
    }
    if (report->warnings.empty()) doubt_small_depth(kLeastMedian, rules.metres_per_unit_32fc1, "32FC1", *report);
    return depth;
  }
  const std::string remedy = image.encoding == "mono16" ? "allow it with the setting mono16_is_depth, or send 16UC1"
                                                        : "send 16UC1 (millimetres) or 32FC1 (metres)";
  return core::unsupported("encoding: " + quote(image.encoding) + " is no depth image; " + remedy);
}

Result<ColorImage> to_color_image(const RosImageView& image, const ImageRules& rules) {
  const auto* encoding = std::find_if(kColorEncodings.begin(), kColorEncodings.end(),
                                      [&](const Encoding& e) { return e.name == image.encoding; });
  if (encoding == kColorEncodings.end()) {
    std::string names;
    for (const Encoding& e : kColorEncodings) names += (names.empty() ? "" : ", ") + std::string(e.name);
    return core::unsupported("encoding: " + quote(image.encoding) +
                             " is no colour image that can be read; send one of " + names);
  }
  const RawColorLayout layout = layout_of(encoding->form);
  PRESCENE_RETURN_IF_ERROR(check_layout(image,
                                        static_cast<std::uint32_t>(layout.bytes_per_pixel * encoding->sample_bytes),
                                        rules, layout.has_half_rows ? image.height / 2 : 0));
  RawColorView view{image.data, static_cast<int>(image.width), static_cast<int>(image.height), image.step,
                    encoding->sample_bytes};
  // The upper byte of a sample is its first one in big endian order.
  if (encoding->sample_bytes == 2 && image.is_bigendian == 0) view.bytes = view.bytes.subspan(1);
  auto color = to_color(view, encoding->form);
  if (!color) return color.status().at("encoding " + image.encoding);
  return color;
}

}  // namespace prescene::interfaces
