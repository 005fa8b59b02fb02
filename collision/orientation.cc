// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/orientation.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "prescene/collision/expansion.h"

namespace prescene::collision {
namespace {

constexpr double kRoundoff = 0.5 * std::numeric_limits<double>::epsilon();
// Each of the terms of the determinants below passes through at most eight (in the plane: five) roundings, and so do
// the terms of the permanent that they are compared with; the halves are room for what is of second order.
constexpr double kErrorOf3 = 8.5 * kRoundoff;
constexpr double kErrorOf2 = 5.5 * kRoundoff;

int sign_of(double value) { return value > 0.0 ? 1 : (value < 0.0 ? -1 : 0); }

using Coordinate = Expansion<2>;
using Offset = std::array<Coordinate, 3>;

Offset exact_offset(const Vector3f& from, const Vector3f& to) {
  Offset offset;
  for (int i = 0; i < 3; ++i)
    offset[static_cast<std::size_t>(i)] =
        Coordinate::difference(static_cast<double>(to[i]), static_cast<double>(from[i]));
  return offset;
}

// Component `axis` of u x v: two products of at most 2 x 2 x 2 terms.
Expansion<16> exact_cross(const Offset& u, const Offset& v, std::size_t axis) {
  const std::size_t i = (axis + 1) % 3;
  const std::size_t j = (axis + 2) % 3;
  Expansion<16> result;
  result.add_product(u[i].terms(), v[j].terms());
  result.add_product(u[j].terms(), v[i].terms(), -1.0);
  return result;
}

int exact_orientation(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  const Offset u = exact_offset(a, b);
  const Offset v = exact_offset(a, c);
  const Offset w = exact_offset(a, d);
  Expansion<192> determinant;
  for (std::size_t axis = 0; axis < 3; ++axis)
    determinant.add_product(exact_cross(u, v, axis).terms(), w[axis].terms());
  return determinant.sign();
}

}  // namespace

int orientation(const Vector3f& a, const Vector3f& b, const Vector3f& c, const Vector3f& d) {
  const Eigen::Vector3d origin = a.cast<double>();
  const Eigen::Vector3d u = b.cast<double>() - origin;
  const Eigen::Vector3d v = c.cast<double>() - origin;
  const Eigen::Vector3d w = d.cast<double>() - origin;
  const double xy = u.x() * v.y();
  const double yx = u.y() * v.x();
  const double yz = u.y() * v.z();
  const double zy = u.z() * v.y();
  const double zx = u.z() * v.x();
  const double xz = u.x() * v.z();
  const double determinant = (yz - zy) * w.x() + (zx - xz) * w.y() + (xy - yx) * w.z();
  const double permanent = (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(w.y()) +
                           (std::abs(xy) + std::abs(yx)) * std::abs(w.z());
  if (std::abs(determinant) > kErrorOf3 * permanent) return sign_of(determinant);
  if (permanent == 0.0) return 0;  // Products of three differences cannot underflow: every term is zero.
  return exact_orientation(a, b, c, d);
}

int orientation_along(int axis, const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const auto difference = [](float to, float from) { return static_cast<double>(to) - static_cast<double>(from); };
  const double left = difference(b[i], a[i]) * difference(c[j], a[j]);
  const double right = difference(b[j], a[j]) * difference(c[i], a[i]);
  const double determinant = left - right;
  const double permanent = std::abs(left) + std::abs(right);
  if (std::abs(determinant) > kErrorOf2 * permanent) return sign_of(determinant);
  if (permanent == 0.0) return 0;
  return exact_cross(exact_offset(a, b), exact_offset(a, c), static_cast<std::size_t>(axis)).sign();
}

}  // namespace prescene::collision
