// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::DepthImage;

// Of sensor_msgs/PointField.
constexpr std::uint8_t kFloat32 = 7;
constexpr std::uint8_t kFloat64 = 8;
// A lens of 90 degrees that distorts by a tenth still passes; points of a body frame (x forward) are off by far more.
constexpr double kMostOffRay = 0.1;
constexpr int kFewestSamples = 64;
constexpr double kFarthest = 1e9;  // m: what is farther is no measurement

Status check_cloud_layout(const RosPointCloud2& cloud, const ImageRules& rules) {
  const std::string size = std::to_string(cloud.width) + " x " + std::to_string(cloud.height);
  if (cloud.width == 0 || cloud.height == 0)
    return core::invalid_input("width x height: is " + size + "; send nothing instead of an empty cloud");
  if (cloud.height == 1 || cloud.width == 1)
    return core::invalid_input("height: is " + std::to_string(cloud.height) + " and width " +
                               std::to_string(cloud.width) +
                               ", so the cloud is not organised like an image; let the driver publish an organised one "
                               "(ordered), or name the depth image");
  if (cloud.width > rules.max_side || cloud.height > rules.max_side ||
      std::uint64_t{cloud.width} * cloud.height > rules.max_pixels)
    return core::resource_exhausted("width x height: " + size + " exceeds the limit of " +
                                    std::to_string(rules.max_side) + " a side and " + std::to_string(rules.max_pixels) +
                                    " in all; send a smaller cloud");
  const std::uint64_t row_bytes = std::uint64_t{cloud.width} * cloud.point_step;
  if (cloud.point_step == 0) return core::invalid_input("point_step: is 0; set it to the bytes of a point");
  if (cloud.row_step < row_bytes)
    return core::invalid_input("row_step: " + std::to_string(cloud.row_step) + " is less than " +
                               std::to_string(cloud.width) + " points of " + std::to_string(cloud.point_step) +
                               " bytes; set it to at least " + std::to_string(row_bytes));
  const std::uint64_t needed = std::uint64_t{cloud.row_step} * (cloud.height - 1) + row_bytes;
  if (cloud.data.size() < needed)
    return core::invalid_input("data: has " + std::to_string(cloud.data.size()) + " bytes, but " + size +
                               " points need " + std::to_string(needed) + "; the message is cut or a step is wrong");
  return core::ok_status();
}

/// Where in a point a coordinate is.
struct Coordinate {
  std::size_t offset = 0;
  bool is_double = false;
};

Result<Coordinate> find_coordinate(const RosPointCloud2& cloud, std::string_view name) {
  std::optional<Coordinate> found;
  for (const RosPointField& field : cloud.fields) {
    if (field.name != name) continue;
    if (found) return core::invalid_input("fields: there are two named " + quote(name) + "; name each once");
    if (field.datatype != kFloat32 && field.datatype != kFloat64)
      return core::unsupported("fields: " + quote(name) + " has the datatype " + std::to_string(field.datatype) +
                               "; send float32 (7) or float64 (8)");
    if (field.count > 1)  // Old senders write 0 and mean 1.
      return core::invalid_input("fields: " + quote(name) + " has the count " + std::to_string(field.count) +
                                 "; set it to 1");
    const bool is_double = field.datatype == kFloat64;
    if (std::uint64_t{field.offset} + (is_double ? 8U : 4U) > cloud.point_step)
      return core::invalid_input("fields: " + quote(name) + " at byte " + std::to_string(field.offset) +
                                 " does not lie in a point of " + std::to_string(cloud.point_step) +
                                 " bytes; correct offset or point_step");
    found = Coordinate{field.offset, is_double};
  }
  if (!found) return core::invalid_input("fields: there is no " + quote(name) + "; send points with x, y and z");
  return *found;
}

template <class Number>
double number_at(const std::uint8_t* bytes, bool swap) {
  std::uint8_t ordered[sizeof(Number)];
  for (std::size_t i = 0; i < sizeof(Number); ++i) ordered[i] = bytes[swap ? sizeof(Number) - 1 - i : i];
  Number number{};
  std::memcpy(&number, ordered, sizeof(Number));
  return static_cast<double>(number);
}

class Points {
 public:
  Points(const RosPointCloud2& cloud)
      : cloud_(cloud), swap_(cloud.is_bigendian != (std::endian::native == std::endian::big)) {}
  double at(int column, int row, const Coordinate& coordinate) const {
    const std::uint8_t* bytes = cloud_.data.data() + std::size_t{cloud_.row_step} * static_cast<std::size_t>(row) +
                                std::size_t{cloud_.point_step} * static_cast<std::size_t>(column) + coordinate.offset;
    return coordinate.is_double ? number_at<double>(bytes, swap_) : number_at<float>(bytes, swap_);
  }

 private:
  const RosPointCloud2& cloud_;
  bool swap_;
};

/// A line by least squares.
class LineFit {
 public:
  void add(double at, double value) {
    n_ += 1.0;
    sum_at_ += at;
    sum_value_ += value;
    sum_at2_ += at * at;
    sum_both_ += at * value;
    sum_value2_ += value * value;
  }
  double slope() const {
    const double spread = n_ * sum_at2_ - sum_at_ * sum_at_;
    return spread > 0.0 ? (n_ * sum_both_ - sum_at_ * sum_value_) / spread : 0.0;
  }
  /// Root mean square of what the line leaves over.
  double residual() const {
    const double variance_at = sum_at2_ / n_ - (sum_at_ / n_) * (sum_at_ / n_);
    const double variance = sum_value2_ / n_ - (sum_value_ / n_) * (sum_value_ / n_);
    return std::sqrt(std::max(0.0, variance - slope() * slope() * variance_at));
  }

 private:
  double n_ = 0.0, sum_at_ = 0.0, sum_value_ = 0.0, sum_at2_ = 0.0, sum_both_ = 0.0, sum_value2_ = 0.0;
};

/// In the camera's optical frame x / z grows with the column alone, and y / z with the row alone.
Status check_optical(const Points& points, const std::array<Coordinate, 3>& xyz, const DepthImage& depth) {
  LineFit columns;
  LineFit rows;
  int samples = 0;
  bool finite = true;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(depth.size()) / 4096.0)));
  for (int v = 0; v < depth.height(); v += step) {
    for (int u = 0; u < depth.width(); u += step) {
      if (!(depth(u, v) > 0.0F)) continue;
      const double z = static_cast<double>(depth(u, v));
      const double x = points.at(u, v, xyz[0]) / z;
      const double y = points.at(u, v, xyz[1]) / z;
      finite = finite && std::abs(x) < 1e6 && std::abs(y) < 1e6;  // false for NaN, too
      columns.add(u, x);
      rows.add(v, y);
      ++samples;
    }
  }
  if (samples < kFewestSamples) return core::ok_status();
  if (finite && columns.slope() > 0.0 && rows.slope() > 0.0 && columns.residual() < kMostOffRay &&
      rows.residual() < kMostOffRay)
    return core::ok_status();
  return core::invalid_input(
      "data: the points do not lie on the rays of their pixels, as in the camera's optical frame (x right, y down, z "
      "forward); publish the cloud in that frame, or name the depth image");
}

}  // namespace

Result<DepthImage> to_depth_image(const RosPointCloud2& cloud, const ImageRules& rules, DepthImageReport* report) {
  DepthImageReport own_report;
  if (report == nullptr) report = &own_report;
  *report = {};
  PRESCENE_RETURN_IF_ERROR(check_cloud_layout(cloud, rules));
  std::array<Coordinate, 3> xyz{};
  for (std::size_t i = 0; i < xyz.size(); ++i) {
    PRESCENE_TRY(xyz[i], find_coordinate(cloud, std::string_view("xyz").substr(i, 1)));
  }
  const Points points(cloud);
  DepthImage depth(static_cast<int>(cloud.width), static_cast<int>(cloud.height));
  std::vector<float> measured;
  for (int v = 0; v < depth.height(); ++v) {
    for (int u = 0; u < depth.width(); ++u) {
      const double z = points.at(u, v, xyz[2]);
      depth(u, v) = z > 0.0 && z < kFarthest ? static_cast<float>(z) : 0.0F;  // 0 for NaN, too
      if (depth(u, v) > 0.0F) measured.push_back(depth(u, v));
    }
  }
  report->measured = static_cast<std::int64_t>(measured.size());
  report->missing = static_cast<std::int64_t>(depth.size() - measured.size());
  if (!measured.empty()) {
    const auto middle = measured.begin() + static_cast<std::ptrdiff_t>(measured.size() / 2);
    std::nth_element(measured.begin(), middle, measured.end());
    report->median_depth = static_cast<double>(*middle);
  }
  PRESCENE_RETURN_IF_ERROR(check_optical(points, xyz, depth));
  if (report->median_depth > 100.0)
    return core::invalid_input("data: the median depth is " + number_text(report->median_depth) +
                               " m: does the sender put millimetres into the cloud? Send metres");
  return depth;
}

}  // namespace prescene::interfaces
