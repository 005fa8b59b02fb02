// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/realignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

constexpr double kUnit = 0x1p-24;        // Unit roundoff of single precision.
constexpr double kUnderflow = 0x1p-140;  // Far above what sums of a few products can lose to it.
constexpr double kHuge = 1e35;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kHalfInfinity = 0x7C00;

double to_double(float x) { return static_cast<double>(x); }

float constant_of(double bound) { return bound > -kHuge ? static_cast<float>(std::min(bound, kHuge)) : -kInfinity; }

using ExactPlanes = std::array<double, 2 * kMostDopAxes>;

ExactPlanes planes_around(const DopDirections& directions, const DopSpace& space, const Mesh& mesh,
                          std::span<const std::uint32_t> triangles) {
  const std::span<const DopAxis> axes = directions.axes();
  ExactPlanes planes;
  std::fill(planes.begin(), planes.end(), -std::numeric_limits<double>::infinity());
  for (const std::uint32_t triangle : triangles) {
    for (const Vector3f& corner : mesh.corners(triangle)) {
      DopAxis p{};
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = (to_double(corner[static_cast<int>(c)]) - to_double(space.centre[c])) * to_double(space.inverse_length);
      }
      for (std::size_t i = 0; i < axes.size(); ++i) {
        const double along = axes[i][0] * p[0] + axes[i][1] * p[1] + axes[i][2] * p[2];
        planes[i] = std::max(planes[i], along);
        planes[axes.size() + i] = std::max(planes[axes.size() + i], -along);
      }
    }
  }
  return planes;
}

}  // namespace

DopSpace DopSpace::of(const Mesh& mesh) {
  Vector3f low = mesh.corners(0)[0];
  Vector3f high = low;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    for (const Vector3f& corner : mesh.corners(i)) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
  const Eigen::Vector3d extent = high.cast<double>() - low.cast<double>();
  DopSpace space;
  for (int c = 0; c < 3; ++c) {
    const auto i = static_cast<std::size_t>(c);
    space.centre[i] = static_cast<float>(to_double(low[c]) + 0.5 * extent[c]);
    space.reach[i] = std::max(std::abs(low[c]), std::abs(high[c]));
  }
  // The rounded centre is off by at most a unit of its last place, which is less than the diagonal.
  const double diagonal = extent.norm();
  if (diagonal > 0.0) space.inverse_length = std::ldexp(1.0F, std::clamp(-std::ilogb(diagonal) - 1, -126, 126));
  return space;
}

std::vector<float> fit_planes(const DopDirections& directions, const DopSpace& space, const Mesh& mesh,
                              const Hierarchy& shape, core::ThreadPool& pool) {
  const auto k = static_cast<std::size_t>(directions.k());
  std::vector<float> planes(shape.nodes.size() * k);
  pool.for_blocks(shape.nodes.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Hierarchy::Node& node = shape.nodes[i];
      if (!node.is_leaf()) continue;
      const auto triangles = std::span(shape.order).subspan(node.begin, node.end - node.begin);
      const ExactPlanes exact = planes_around(directions, space, mesh, triangles);
      for (std::size_t p = 0; p < k; ++p) planes[i * k + p] = round_up(exact[p]);
    }
  });
  // With the same directions everywhere the volume about the children's volumes is the one about their triangles.
  for (std::size_t i = shape.nodes.size(); i-- > 0;) {
    const Hierarchy::Node& node = shape.nodes[i];
    for (std::uint32_t child = 0; child < node.child_count; ++child) {
      const float* from = &planes[(node.first_child + child) * k];
      for (std::size_t p = 0; p < k; ++p)
        planes[i * k + p] = child == 0 ? from[p] : std::max(planes[i * k + p], from[p]);
    }
  }
  return planes;
}

float round_up(double value) {
  const auto rounded = static_cast<float>(value);
  if (to_double(rounded) >= value) return rounded;
  return std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

std::uint16_t round_up_to_half(double value) {
  PRESCENE_CHECK(std::abs(value) <= 65504.0);
  // Halves of one sign are ordered as their bits. The largest one towards zero, then outward where that is not enough.
  const double magnitude = std::abs(value);
  const int exponent = magnitude < 0x1p-14 ? -14 : std::ilogb(magnitude);
  const double steps = std::floor(std::ldexp(magnitude, 10 - exponent));  // Of the last place, at most 2047.
  std::uint32_t bits = static_cast<std::uint32_t>(steps) + (static_cast<std::uint32_t>(exponent + 14) << 10U);
  if (value > 0.0 && std::ldexp(steps, exponent - 10) < magnitude) ++bits;
  PRESCENE_CHECK(bits < kHalfInfinity);
  if (value < 0.0) bits |= 0x8000U;
  return static_cast<std::uint16_t>(bits);
}

Realignment::Realignment(const DopDirections& dop_directions, const DopSpace& space_a, const DopSpace& space_b,
                         const Transform& X_AB) {
  const auto& r = X_AB.rotation;
  DopAxis between{};  // From A's centre to B's, in A's frame.
  double largest = 0.0;
  for (std::size_t row = 0; row < 3; ++row) {
    double size = std::abs(to_double(X_AB.translation[row]));
    between[row] = to_double(X_AB.translation[row]) - to_double(space_a.centre[row]);
    for (std::size_t col = 0; col < 3; ++col) {
      const double element = to_double(r[3 * row + col]);
      between[row] += element * to_double(space_b.centre[col]);
      size += std::abs(element) * to_double(space_b.reach[col]);
    }
    largest = std::max(largest, size + std::abs(to_double(space_a.centre[row])));
  }
  // Placing a vertex takes three products and three sums a coordinate; a direction's coordinates add up to at most 2.
  const double placing = 2.0 * (8.0 * kUnit * largest + kUnderflow);
  const double scale_a = to_double(space_a.inverse_length);
  const double ratio = scale_a / to_double(space_b.inverse_length);
  const std::span<const DopAxis> axes = dop_directions.axes();
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const DopAxis& d = axes[i];
    DopAxis against{};  // -d, in B's frame.
    for (std::size_t col = 0; col < 3; ++col)
      against[col] = -(d[0] * to_double(r[col]) + d[1] * to_double(r[3 + col]) + d[2] * to_double(r[6 + col]));
    const DopCone cone = dop_directions.cone(against);
    const double constant = scale_a * (d[0] * between[0] + d[1] * between[1] + d[2] * between[2]);
    double weight = 0.0;
    for (std::size_t n = 0; n < 3; ++n) weight += cone.weights[n] * ratio;
    const double slack =
        scale_a * placing + 32.0 * kUnit * (1.0 + std::abs(constant) + weight);  // ExactPlanes are at most 1.
    Direction& upper = directions[i];
    Direction& lower = directions[axes.size() + i];
    // Where sizes differ so much that single precision overflows, the opposite direction decides, or none.
    upper.constant = weight < kHuge ? constant_of(constant - slack) : -kInfinity;
    lower.constant = weight < kHuge ? constant_of(-constant - slack) : -kInfinity;
    for (std::size_t n = 0; n < 3; ++n) {
      upper.planes[n] = cone.directions[n];
      lower.planes[n] = static_cast<std::uint8_t>(dop_directions.opposite(cone.directions[n]));
      const auto sum = static_cast<float>(std::clamp(against[n] * ratio, -kHuge, kHuge));
      upper.against[n] = upper.constant > -kInfinity ? sum : 0.0F;
      lower.against[n] = lower.constant > -kInfinity ? -sum : 0.0F;
      const auto w = static_cast<float>(std::min(cone.weights[n] * ratio, kHuge));
      upper.weights[n] = upper.constant > -kInfinity ? w : 0.0F;
      lower.weights[n] = lower.constant > -kInfinity ? w : 0.0F;
    }
  }
}

}  // namespace prescene::collision
