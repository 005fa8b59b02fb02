// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/camera.h"

#include <cmath>
#include <string>

#include "prescene/core/check.h"
#include "prescene/core/text.h"

namespace prescene::geometry {
namespace {

constexpr int kMaxImageSize = 16384;
// Of the cameras of robots: a view of 1 degree over 1600 pixels has 9e4. Beyond it, pixels across a thing of a metre
// are too many for an int.
constexpr double kLeastFocal = 1.0;
constexpr double kMostFocal = 1e5;
constexpr double kMostCentre = 1e5;

core::Status field_error(const char* field, double value, const char* remedy) {
  return core::invalid_input(std::string("camera ") + field + " is " + core::rounded_text(value) + ": " + remedy);
}

}  // namespace

PinholeCamera PinholeCamera::subsampled(int step, int offset) const {
  PRESCENE_CHECK(step >= 1 && offset >= 0 && offset < width && offset < height);
  PinholeCamera small;
  small.width = (width - 1 - offset) / step + 1;
  small.height = (height - 1 - offset) / step + 1;
  small.fx = fx / step;
  small.fy = fy / step;
  small.cx = (cx - offset) / step;
  small.cy = (cy - offset) / step;
  return small;
}

core::Status validate(const PinholeCamera& camera) {
  const auto size_ok = [](int size) { return size >= 1 && size <= kMaxImageSize; };
  const auto focal_ok = [](double f) { return std::isfinite(f) && f > 0.0; };
  constexpr const char* kSizeRemedy = "give a number of pixels from 1 to 16384";
  constexpr const char* kFocalRemedy = "give a positive focal length in pixels";
  constexpr const char* kCentreRemedy = "give a finite principal point in pixels";
  if (!size_ok(camera.width)) return field_error("width", camera.width, kSizeRemedy);
  if (!size_ok(camera.height)) return field_error("height", camera.height, kSizeRemedy);
  if (!focal_ok(camera.fx)) return field_error("fx", camera.fx, kFocalRemedy);
  if (!focal_ok(camera.fy)) return field_error("fy", camera.fy, kFocalRemedy);
  if (!std::isfinite(camera.cx)) return field_error("cx", camera.cx, kCentreRemedy);
  if (!std::isfinite(camera.cy)) return field_error("cy", camera.cy, kCentreRemedy);
  return core::ok_status();
}

core::Status validate_sensor(const PinholeCamera& camera) {
  PRESCENE_RETURN_IF_ERROR(validate(camera));
  const auto focal_ok = [](double f) { return f >= kLeastFocal && f <= kMostFocal; };
  const auto centre_ok = [](double c) { return std::abs(c) <= kMostCentre; };
  constexpr const char* kFocalRemedy = "no camera has that; give the focal length in pixels, from 1 to 1e5";
  constexpr const char* kCentreRemedy = "no camera has that; give the principal point in pixels, from -1e5 to 1e5";
  if (!focal_ok(camera.fx)) return field_error("fx", camera.fx, kFocalRemedy);
  if (!focal_ok(camera.fy)) return field_error("fy", camera.fy, kFocalRemedy);
  if (!centre_ok(camera.cx)) return field_error("cx", camera.cx, kCentreRemedy);
  if (!centre_ok(camera.cy)) return field_error("cy", camera.cy, kCentreRemedy);
  return core::ok_status();
}

}  // namespace prescene::geometry
