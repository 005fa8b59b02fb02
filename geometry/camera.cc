// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/camera.h"

#include <limits>
#include <string>

#include "prescene/core/check.h"
#include "prescene/core/text.h"

namespace prescene::geometry {
namespace {

constexpr int kMaxImageSize = 16384;

/// What the fields of a camera may be, and what to give instead.
struct Bounds {
  double least_focal;
  double most_focal;
  const char* focal_remedy;
  double most_centre;  // to both sides
  const char* centre_remedy;
};
constexpr Bounds kAnyCamera = {std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(),
                               "give a positive focal length in pixels", std::numeric_limits<double>::max(),
                               "give a finite principal point in pixels"};
// Of the cameras of robots: a view of 1 degree over 1600 pixels has 9e4. Beyond it, pixels across a thing of a metre
// are too many for an int.
constexpr Bounds kSensor = {1.0, 1e5, "no camera has that; give the focal length in pixels, from 1 to 1e5", 1e5,
                            "no camera has that; give the principal point in pixels, from -1e5 to 1e5"};

/// Of the first field that is out of bounds.
core::Status check(const PinholeCamera& camera, const Bounds& bounds) {
  constexpr const char* kSizeRemedy = "give a number of pixels from 1 to 16384";
  struct Field {
    const char* name;
    double value, low, high;
    const char* remedy;
  };
  const Field fields[] = {
      {"width", static_cast<double>(camera.width), 1.0, kMaxImageSize, kSizeRemedy},
      {"height", static_cast<double>(camera.height), 1.0, kMaxImageSize, kSizeRemedy},
      {"fx", camera.fx, bounds.least_focal, bounds.most_focal, bounds.focal_remedy},
      {"fy", camera.fy, bounds.least_focal, bounds.most_focal, bounds.focal_remedy},
      {"cx", camera.cx, -bounds.most_centre, bounds.most_centre, bounds.centre_remedy},
      {"cy", camera.cy, -bounds.most_centre, bounds.most_centre, bounds.centre_remedy},
  };
  for (const Field& field : fields) {
    if (field.low <= field.value && field.value <= field.high) continue;
    return core::invalid_input(std::string("camera ") + field.name + " is " + core::rounded_text(field.value) + ": " +
                               field.remedy);
  }
  return core::ok_status();
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

core::Status validate(const PinholeCamera& camera) { return check(camera, kAnyCamera); }

core::Status validate_sensor(const PinholeCamera& camera) { return check(camera, kSensor); }

}  // namespace prescene::geometry
