// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using geometry::DepthImage;

RosImage empty_image(const RosHeader& header, int width, int height, const char* encoding,
                     std::uint32_t bytes_per_pixel) {
  RosImage image;
  image.header = header;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.encoding = encoding;
  image.is_bigendian = std::endian::native == std::endian::big ? 1 : 0;
  image.step = image.width * bytes_per_pixel;
  image.data.resize(std::size_t{image.step} * image.height);
  return image;
}

template <class Word, class Convert>
RosImage depth_image(const DepthImage& depth, const RosHeader& header, const char* encoding, Convert convert) {
  RosImage image = empty_image(header, depth.width(), depth.height(), encoding, sizeof(Word));
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const Word value = convert(depth.data()[i]);
    std::memcpy(image.data.data() + i * sizeof(Word), &value, sizeof value);
  }
  return image;
}

}  // namespace

RosImage to_ros_image_16uc1(const DepthImage& depth, const RosHeader& header) {
  return depth_image<std::uint16_t>(depth, header, "16UC1", [](float metres) {
    const double millimetres = std::round(static_cast<double>(metres) * 1000.0);
    return millimetres >= 1.0 && millimetres < 65535.0 ? static_cast<std::uint16_t>(millimetres) : std::uint16_t{0};
  });
}

RosImage to_ros_image_32fc1(const DepthImage& depth, const RosHeader& header) {
  return depth_image<float>(depth, header, "32FC1", [](float metres) {
    return metres > 0.0F ? metres : std::numeric_limits<float>::quiet_NaN();
  });
}

RosImage to_ros_image(const geometry::ColorImage& color, const RosHeader& header) {
  RosImage image = empty_image(header, color.width(), color.height(), "rgb8", 3);
  image.is_bigendian = 0;
  for (std::size_t i = 0; i < color.size(); ++i) {
    std::memcpy(image.data.data() + 3 * i, color.data()[i].data(), 3);
  }
  return image;
}

RosCameraInfo to_ros_camera_info(const geometry::PinholeCamera& camera, const RosHeader& header,
                                 const geometry::LensDistortion& lens) {
  RosCameraInfo info;
  info.header = header;
  info.width = static_cast<std::uint32_t>(camera.width);
  info.height = static_cast<std::uint32_t>(camera.height);
  const auto& k = lens.coefficients();
  if (lens.model() == geometry::LensDistortion::Model::kEquidistant) {
    info.distortion_model = "equidistant";
    info.d.assign(k.begin(), k.begin() + 4);
  } else {
    const bool divides = std::any_of(k.begin() + 5, k.end(), [](double v) { return v != 0.0; });
    info.distortion_model = divides ? "rational_polynomial" : "plumb_bob";
    info.d.assign(k.begin(), k.begin() + (divides ? 8 : 5));
  }
  info.k = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  info.r = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.p = {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

}  // namespace prescene::interfaces
