// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/images/rvl.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using geometry::ColorImage;
using geometry::DepthImage;
using Bytes = std::span<const std::uint8_t>;
using Codes = geometry::Image<std::uint16_t>;

constexpr std::size_t kDepthHeaderBytes = 12;

ImageLimits limits_of(const ImageRules& rules) {
  ImageLimits limits;
  limits.max_side = static_cast<int>(std::min<std::uint32_t>(rules.max_side, std::numeric_limits<int>::max()));
  limits.max_pixels = rules.max_pixels;
  return limits;
}

/// "16UC1; compressedDepth png": the encoding of the image, and how it is packed.
struct Format {
  std::string_view encoding;
  std::string_view packing;
};

Format parsed(std::string_view format) {
  const std::size_t end = format.find(';');
  if (end == std::string_view::npos) return {trimmed(format), trimmed(format)};
  return {trimmed(format.substr(0, end)), trimmed(format.substr(end + 1))};
}

bool is_png(Bytes bytes) { return bytes.size() >= 4 && bytes[0] == 0x89 && bytes[1] == 'P' && bytes[2] == 'N'; }
bool is_jpeg(Bytes bytes) { return bytes.size() >= 2 && bytes[0] == 0xff && bytes[1] == 0xd8; }

Result<Codes> decode_codes(Bytes payload, const Format& format, const ImageRules& rules) {
  if (payload.empty()) return core::data_loss("is empty; send nothing instead of an empty image");
  if (is_png(payload)) return decode_png_gray16(payload, limits_of(rules));
  if (is_jpeg(payload))
    return core::invalid_input("is a JPEG, which does not keep depth; send the depth image's compressedDepth");
  if (format.packing.find("rvl") == std::string_view::npos)
    return core::invalid_input("not a PNG image (bad signature), and the format " + quote(format.packing) +
                               " names no other coding; send compressedDepth as png or rvl");
  ByteReader in(payload, std::endian::little);
  const auto columns = in.read<std::uint32_t>();
  const auto rows = in.read<std::uint32_t>();
  if (!in.ok()) return core::data_loss("ends within the size of the image; send it whole");
  if (columns > rules.max_side || rows > rules.max_side)
    return core::resource_exhausted("says it has " + std::to_string(columns) + " x " + std::to_string(rows) +
                                    " pixels; the limit is " + std::to_string(rules.max_side) + " a side");
  return decode_rvl(payload.subspan(8), {static_cast<int>(columns), static_cast<int>(rows)}, limits_of(rules));
}

/// How 32FC1 is quantised: depth = a / (code - b).
struct InverseDepth {
  float a = 0.0F;
  float b = 0.0F;
};

template <class Value>
RosImage raw_image(const std::string& encoding, int width, int height, const Value* values) {
  RosImage image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.encoding = encoding;
  image.is_bigendian = std::endian::native == std::endian::big ? 1 : 0;
  image.step = image.width * static_cast<std::uint32_t>(sizeof(Value));
  image.data.resize(std::size_t{image.step} * image.height);
  std::memcpy(image.data.data(), values, image.data.size());
  return image;
}

Result<DepthImage> from_inverse(const Codes& codes, const InverseDepth& inverse, const ImageRules& rules,
                                DepthImageReport* report) {
  if (!std::isfinite(inverse.a) || !std::isfinite(inverse.b) || !(inverse.a > 0.0F))
    return core::invalid_input(
        "data: its header says depth = a / (code - b) with a = " + number_text(static_cast<double>(inverse.a)) +
        ", b = " + number_text(static_cast<double>(inverse.b)) + ", which is no depth; correct the sender");
  std::vector<float> depths(codes.size(), 0.0F);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const std::uint16_t code = codes.data()[i];
    const float depth = inverse.a / (static_cast<float>(code) - inverse.b);
    if (code != 0 && std::isfinite(depth)) depths[i] = depth;
  }
  return to_depth_image(raw_image("32FC1", codes.width(), codes.height(), depths.data()), rules, report);
}

}  // namespace

Result<DepthImage> to_depth_image(const RosCompressedImage& image, const ImageRules& rules, DepthImageReport* report) {
  const Format format = parsed(image.format);
  const bool has_header = format.packing.find("compressedDepth") != std::string_view::npos;
  Bytes payload = image.data;
  InverseDepth inverse;
  if (has_header) {
    ByteReader in(payload, std::endian::little);
    in.read<std::int32_t>();  // which quantisation: there is one
    inverse.a = in.read<float>();
    inverse.b = in.read<float>();
    if (!in.ok()) return core::data_loss("data: ends within its header of 12 bytes; send it whole");
    payload = payload.subspan(kDepthHeaderBytes);
  }
  const auto codes = decode_codes(payload, format, rules);
  if (!codes) return codes.status().at("data");
  const bool is_inverse = has_header && format.encoding == "32FC1";
  if (is_inverse) return from_inverse(*codes, inverse, rules, report);
  // A sender of plain PNG may name just that.
  const bool unnamed = !has_header && (format.encoding.empty() || format.encoding == "png");
  const std::string encoding = unnamed ? "16UC1" : std::string(format.encoding);
  if (encoding == "32FC1")
    return core::invalid_input("format: " + quote(image.format) +
                               " can't hold 32FC1; send the depth image's compressedDepth");
  return to_depth_image(raw_image(encoding, codes->width(), codes->height(), codes->data()), rules, report);
}

Result<ColorImage> to_color_image(const RosCompressedImage& image, const ImageRules& rules) {
  auto color = decode_color(image.data, limits_of(rules));
  if (!color) return color.status().at("data (format " + quote(image.format) + ")");
  return color;
}

}  // namespace prescene::interfaces
