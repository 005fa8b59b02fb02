// SPDX-License-Identifier: Apache-2.0
// Which pixels a triangle covers: those whose centre is inside, with the top-left rule for centres exactly on an edge,
// so that two triangles that share an edge cover each pixel along it once.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

namespace prescene::rendering {

/// A point of the image plane in pixels; pixel centres are at integers.
template <class Scalar>
struct ScreenPoint {
  Scalar x;
  Scalar y;
};

/// Pixels from first to last, both included; empty when last < first.
struct PixelRect {
  int x_first = 0;
  int y_first = 0;
  int x_last = -1;
  int y_last = -1;

  bool empty() const { return x_last < x_first || y_last < y_first; }
};

/// The side of the directed line through two points that a pixel lies on: > 0 to the right (y points down).
/// The value for b -> a is exactly minus that for a -> b, because both are computed from the same end.
template <class Scalar>
class EdgeFunction {
 public:
  EdgeFunction(ScreenPoint<Scalar> a, ScreenPoint<Scalar> b) {
    dx_ = b.x - a.x;
    dy_ = b.y - a.y;
    owns_line_ = dy_ < 0 || (dy_ == 0 && dx_ > 0);  // a left edge, or a top edge, of a triangle on its right side
    origin_ = b.x < a.x || (b.x == a.x && b.y < a.y) ? b : a;
  }

  void set_row(int y) { row_ = dx_ * (static_cast<Scalar>(y) - origin_.y); }
  /// Whether the pixel of the current row is on the right side. Without a branch: near small triangles nothing could
  /// predict it.
  bool inside(int x) const {
    const Scalar value = row_ - dy_ * (static_cast<Scalar>(x) - origin_.x);
    return (value > 0) | ((value == 0) & owns_line_);
  }
  /// Whether the pixels inside lie to the right of the line along each row, or to its left.
  bool bounds_left() const { return dy_ < 0; }
  bool bounds_right() const { return dy_ > 0; }
  /// About where the line crosses the current row; for lines that are not along it.
  Scalar crossing() const { return origin_.x + row_ / dy_; }

 private:
  ScreenPoint<Scalar> origin_;
  Scalar dx_;
  Scalar dy_;
  Scalar row_ = 0;
  bool owns_line_;
};

/// The smallest integer >= value, at least `limit`; for any finite value. (The library's ceil is a call on the baseline
/// instruction set, and there are six of them a triangle.)
template <class Scalar>
int ceil_from(Scalar value, int limit) {
  if (value <= static_cast<Scalar>(limit)) return limit;
  if (value > Scalar(1e6)) return 1000000;
  const int truncated = static_cast<int>(value);
  return truncated + (static_cast<Scalar>(truncated) < value ? 1 : 0);
}

/// The largest integer <= value, at most `limit`.
template <class Scalar>
int floor_to(Scalar value, int limit) {
  if (value >= static_cast<Scalar>(limit)) return limit;
  if (value < Scalar(-1e6)) return -1000000;
  const int truncated = static_cast<int>(value);
  return truncated - (static_cast<Scalar>(truncated) > value ? 1 : 0);
}

/// The pixels of `rect` whose centres lie within the triangle's bounding box.
template <class Scalar>
PixelRect bounding_pixels(ScreenPoint<Scalar> a, ScreenPoint<Scalar> b, ScreenPoint<Scalar> c, const PixelRect& rect) {
  return {ceil_from(std::min(a.x, std::min(b.x, c.x)), rect.x_first),
          ceil_from(std::min(a.y, std::min(b.y, c.y)), rect.y_first),
          floor_to(std::max(a.x, std::max(b.x, c.x)), rect.x_last),
          floor_to(std::max(a.y, std::max(b.y, c.y)), rect.y_last)};
}

/// Calls fill(x, y) for each pixel that the triangle covers; either orientation. `box` is from bounding_pixels.
template <class Scalar, class Fill>
void for_each_covered_pixel(ScreenPoint<Scalar> a, ScreenPoint<Scalar> b, ScreenPoint<Scalar> c, const PixelRect& box,
                            Fill&& fill) {
  const Scalar area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area == 0) return;
  if (area < 0) std::swap(b, c);
  EdgeFunction<Scalar> ab(a, b);
  EdgeFunction<Scalar> bc(b, c);
  EdgeFunction<Scalar> ca(c, a);
  // On wide triangles, rows are narrowed to a pixel beyond where the lines cross them; the exact test decides there.
  constexpr int kWide = 8;
  const bool wide = box.x_last - box.x_first >= kWide;
  for (int y = box.y_first; y <= box.y_last; ++y) {
    int x_begin = box.x_first;
    int x_end = box.x_last;
    for (EdgeFunction<Scalar>* edge : {&ab, &bc, &ca}) {
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
