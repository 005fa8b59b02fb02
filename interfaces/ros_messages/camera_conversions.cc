// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using geometry::LensDistortion;
using geometry::PinholeCamera;

/// The part of the full image that arrives, in pixels of the full image, and how many of them make one.
struct Readout {
  std::uint32_t x_offset;
  std::uint32_t y_offset;
  std::uint32_t width;
  std::uint32_t height;
  std::uint32_t binning_x;
  std::uint32_t binning_y;
};

Result<Readout> to_readout(const RosCameraInfo& info) {
  if (info.width == 0 || info.height == 0) {
    return core::invalid_input("width x height: is " + std::to_string(info.width) + " x " +
                               std::to_string(info.height) + "; set the size that the camera was calibrated at");
  }
  Readout readout{
      info.roi.x_offset,           info.roi.y_offset, info.roi.width, info.roi.height, std::max(info.binning_x, 1U),
      std::max(info.binning_y, 1U)};
  if (readout.width == 0) readout.width = info.width - std::min(info.width, readout.x_offset);
  if (readout.height == 0) readout.height = info.height - std::min(info.height, readout.y_offset);
  const bool fits = std::uint64_t{readout.x_offset} + readout.width <= info.width &&
                    std::uint64_t{readout.y_offset} + readout.height <= info.height && readout.width > 0 &&
                    readout.height > 0;
  if (!fits) {
    return core::invalid_input("roi: does not lie in the image of " + std::to_string(info.width) + " x " +
                               std::to_string(info.height) + " pixels; give it in pixels of the full image");
  }
  if (readout.binning_x > readout.width || readout.binning_y > readout.height) {
    return core::invalid_input("binning: " + std::to_string(readout.binning_x) + " x " +
                               std::to_string(readout.binning_y) + " leaves no pixel of the image");
  }
  return readout;
}

bool are_zero(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return v == 0.0; });
}

}  // namespace

Result<PinholeCamera> to_camera(const RosCameraInfo& info, const CameraRules& rules, CameraReport* report) {
  CameraReport own_report;
  if (report == nullptr) report = &own_report;
  *report = {};
  PRESCENE_TRY(const Readout readout, to_readout(info));

  const char* field = rules.rectified ? "p" : "k";
  const double fx = rules.rectified ? info.p[0] : info.k[0];
  const double fy = rules.rectified ? info.p[5] : info.k[4];
  const double cx = rules.rectified ? info.p[2] : info.k[2];
  const double cy = rules.rectified ? info.p[6] : info.k[5];
  if (fx == 0.0) {
    return core::invalid_input(std::string(field) + ": is zero, the camera is not calibrated; load its calibration");
  }
  if (!(fx > 0.0 && fy > 0.0) || !std::isfinite(fx + fy + cx + cy)) {
    return core::invalid_input(std::string(field) + ": focal lengths " + number_text(fx) + ", " + number_text(fy) +
                               " and principal point (" + number_text(cx) + ", " + number_text(cy) +
                               ") are no camera; load its calibration");
  }

  PinholeCamera camera;
  camera.width = static_cast<int>(readout.width / readout.binning_x);
  camera.height = static_cast<int>(readout.height / readout.binning_y);
  camera.fx = fx / readout.binning_x;
  camera.fy = fy / readout.binning_y;
  camera.cx = (cx - readout.x_offset) / readout.binning_x;
  camera.cy = (cy - readout.y_offset) / readout.binning_y;
  const bool size_differs = (rules.image_width > 0 && rules.image_width != camera.width) ||
                            (rules.image_height > 0 && rules.image_height != camera.height);
  if (size_differs) {
    return core::invalid_input("width x height: describes images of " + std::to_string(camera.width) + " x " +
                               std::to_string(camera.height) + " pixels, but they have " +
                               std::to_string(rules.image_width) + " x " + std::to_string(rules.image_height) +
                               "; send the calibration of this resolution, or set binning and roi");
  }
  if (const core::Status sensor = geometry::validate_sensor(camera); !sensor.ok()) return sensor.at(field);

  if (rules.rectified && info.p[3] != 0.0) {
    report->warnings.push_back("p: is that of the right camera of a stereo pair, " +
                               number_text(-info.p[3] / info.p[0]) +
                               " m right of the left one; its frame must be the right camera's");
  }
  return camera;
}

Result<LensDistortion> to_lens(const RosCameraInfo& info, const CameraRules& rules, CameraReport* report) {
  CameraReport own_report;
  if (report == nullptr) report = &own_report;
  *report = {};
  const std::span<const double> d = info.d;
  if (rules.rectified || are_zero(d)) return LensDistortion();
  const std::size_t count = d.size();
  Result<LensDistortion> lens = LensDistortion();
  if ((info.distortion_model == "plumb_bob" || info.distortion_model == "rational_polynomial") &&
      (count == 4 || count == 5 || count == 8 || count == 12 || count == 14)) {
    std::array<double, 8> k{};
    std::copy_n(d.begin(), std::min(count, k.size()), k.begin());
    lens = LensDistortion::brown(k);
    if (count > k.size() && !are_zero(d.subspan(k.size()))) {
      report->warnings.push_back(
          "d: coefficients 9 to " + std::to_string(count) +
          " (thin prism and tilted sensor) are ignored, the first 8 are used; send rectified images (image_proc), and "
          "say so (--rectified)");
    }
  } else if ((info.distortion_model == "equidistant" || info.distortion_model == "fisheye") && count == 4) {
    lens = LensDistortion::equidistant({d[0], d[1], d[2], d[3]});
  } else {
    report->warnings.push_back("distortion_model: " + quote(info.distortion_model) + " with " + std::to_string(count) +
                               " coefficients is unknown, the distortion is ignored; send plumb_bob with 5, "
                               "rational_polynomial with 8 or equidistant with 4, or rectified images (--rectified)");
  }
  if (!lens) return lens.status().at("d");
  return lens;
}

}  // namespace prescene::interfaces
