// SPDX-License-Identifier: Apache-2.0
// Which pixels a triangle covers: corners are snapped to 1/256 pixel, and a pixel is covered when its centre is inside
// of the snapped triangle, with the top-left rule for centres exactly on an edge. All of it is integers: two triangles
// that share an edge cover each pixel along it once, and whoever snaps alike covers the same pixels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace prescene::rendering {

inline constexpr int kSubpixels = 256;

/// A point of the image plane in 1/256 pixel; pixel centres are at multiples of 256.
struct ScreenPoint {
  std::int32_t x = 0;
  std::int32_t y = 0;
};

/// The nearest point (ties to even) of a place in pixels. Beyond two million pixels it stays there.
inline ScreenPoint snapped(double x, double y) {
  constexpr double kEnd = 2e6 * kSubpixels;
  return {static_cast<std::int32_t>(std::nearbyint(std::clamp(x * kSubpixels, -kEnd, kEnd))),
          static_cast<std::int32_t>(std::nearbyint(std::clamp(y * kSubpixels, -kEnd, kEnd)))};
}
/// The same for places within 16,000 pixels, without a call of the library.
inline ScreenPoint snapped(float x, float y) {
  const auto nearest = [](float value) {
    constexpr float kEnd = 16000.0f * kSubpixels;
    constexpr float kWhole = 12582912.0f;  // 1.5 * 2^23: what is added to it has no fraction left
    return static_cast<std::int32_t>((std::clamp(value * kSubpixels, -kEnd, kEnd) + kWhole) - kWhole);
  };
  return {nearest(x), nearest(y)};
}

/// Pixels from first to last, both included; empty when last < first.
struct PixelRect {
  int x_first = 0;
  int y_first = 0;
  int x_last = -1;
  int y_last = -1;

  bool empty() const { return x_last < x_first || y_last < y_first; }
};

/// The side of the directed line through two points that a pixel lies on: > 0 to the right (y points down).
class EdgeFunction {
 public:
  EdgeFunction(ScreenPoint a, ScreenPoint b) : origin_(a), dx_(b.x - a.x), dy_(b.y - a.y) {
    owns_line_ = dy_ < 0 || (dy_ == 0 && dx_ > 0);  // a left edge, or a top edge, of a triangle on its right side
  }

  void set_row(int y) { row_ = dx_ * (std::int64_t{y} * kSubpixels - origin_.y); }
  /// Whether the pixel of the current row is on the right side. Without a branch: near small triangles nothing could
  /// predict it.
  bool inside(int x) const {
    const std::int64_t value = row_ - dy_ * (std::int64_t{x} * kSubpixels - origin_.x);
    return (value > 0) | ((value == 0) & owns_line_);
  }
  /// Whether the pixels inside lie to the right of the line along each row, or to its left.
  bool bounds_left() const { return dy_ < 0; }
  bool bounds_right() const { return dy_ > 0; }
  /// About where the line crosses the current row, pixels; for lines that are not along it.
  double crossing() const {
    return (origin_.x + static_cast<double>(row_) / static_cast<double>(dy_)) * (1.0 / kSubpixels);
  }

 private:
  ScreenPoint origin_;
  std::int64_t dx_;
  std::int64_t dy_;
  std::int64_t row_ = 0;
  bool owns_line_;
};

/// The smallest integer >= value, at least `limit`; for any finite value. (The library's ceil is a call on the baseline
/// instruction set, and there are six of them a triangle.)
inline int ceil_from(double value, int limit) {
  if (value <= limit) return limit;
  if (value > 1e6) return 1000000;
  const int truncated = static_cast<int>(value);
  return truncated + (truncated < value ? 1 : 0);
}

/// The largest integer <= value, at most `limit`.
inline int floor_to(double value, int limit) {
  if (value >= limit) return limit;
  if (value < -1e6) return -1000000;
  const int truncated = static_cast<int>(value);
  return truncated - (truncated > value ? 1 : 0);
}

/// The pixels of `rect` whose centres lie within the bounding box of points between `low` and `high`.
inline PixelRect pixels_between(ScreenPoint low, ScreenPoint high, const PixelRect& rect) {
  // A shift rounds down, of negative numbers too.
  return {std::max(rect.x_first, (low.x + kSubpixels - 1) >> 8), std::max(rect.y_first, (low.y + kSubpixels - 1) >> 8),
          std::min(rect.x_last, high.x >> 8), std::min(rect.y_last, high.y >> 8)};
}

/// The pixels of `rect` whose centres lie within the triangle's bounding box.
inline PixelRect bounding_pixels(ScreenPoint a, ScreenPoint b, ScreenPoint c, const PixelRect& rect) {
  return pixels_between({std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})},
                        {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})}, rect);
}

/// Calls fill(x, y) for each pixel that the triangle covers; either orientation. `box` is from bounding_pixels.
template <class Fill>
void for_each_covered_pixel(ScreenPoint a, ScreenPoint b, ScreenPoint c, const PixelRect& box, Fill&& fill) {
  const std::int64_t area = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
  if (area == 0) return;
  if (area < 0) std::swap(b, c);
  EdgeFunction ab(a, b);
  EdgeFunction bc(b, c);
  EdgeFunction ca(c, a);
  // On wide triangles, rows are narrowed to a pixel beyond where the lines cross them; the exact test decides there.
  constexpr int kWide = 8;
  const bool wide = box.x_last - box.x_first >= kWide;
  for (int y = box.y_first; y <= box.y_last; ++y) {
    int x_begin = box.x_first;
    int x_end = box.x_last;
    for (EdgeFunction* edge : {&ab, &bc, &ca}) {
      edge->set_row(y);
      if (!wide) continue;
      if (edge->bounds_left()) x_begin = ceil_from(edge->crossing() - 1, x_begin);
      if (edge->bounds_right()) x_end = floor_to(edge->crossing() + 1, x_end);
    }
    for (int x = x_begin; x <= x_end; ++x)
      if (ab.inside(x) & bc.inside(x) & ca.inside(x)) fill(x, y);
  }
}

/// The part of a triangle (points in C) with z >= near, as a polygon of up to four corners in the same orientation.
/// Returns the number of corners, 0 when nothing is left. A cut on an edge is the same point whichever triangle asks.
template <class Point>
int clip_to_near(const Point (&triangle)[3], typename Point::Scalar near, Point (&polygon)[4]) {
  int count = 0;
  for (int i = 0; i < 3; ++i) {
    const Point& from = triangle[i];
    const Point& to = triangle[(i + 1) % 3];
    const bool from_kept = from.z() >= near;
    const bool to_kept = to.z() >= near;
    if (from_kept) polygon[count++] = from;
    if (from_kept != to_kept) {
      const Point& kept = from_kept ? from : to;
      const Point& cut = from_kept ? to : from;
      Point corner = kept + (cut - kept) * ((near - kept.z()) / (cut.z() - kept.z()));
      corner.z() = near;
      polygon[count++] = corner;
    }
  }
  return count;
}

}  // namespace prescene::rendering
