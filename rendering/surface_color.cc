// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/surface_color.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace prescene::rendering {
namespace {

using geometry::Vector3d;

/// Shares of a triangle's corners at the point of its plane below p.
Vector3d corner_shares(const RenderMesh& mesh, std::size_t face, const Vector3d& p) {
  const auto corner = [&](std::size_t k) { return Vector3d(mesh.vertices[mesh.triangles[face][k]].cast<double>()); };
  const Vector3d a = corner(0), b = corner(1), c = corner(2);
  const Vector3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (!(squared > 0.0)) return {1.0, 0.0, 0.0};
  const double of_b = normal.dot((p - a).cross(c - a)) / squared;
  const double of_c = normal.dot((b - a).cross(p - a)) / squared;
  return {1.0 - of_b - of_c, of_b, of_c};
}

/// i modulo n, from 0 on for negative numbers too.
int repeated(double i, int n) {
  const double rest = i - std::floor(i / n) * n;
  return std::clamp(static_cast<int>(rest), 0, n - 1);
}

}  // namespace

double linear_of_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

double srgb_of_linear(double value) {
  return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

LinearRgb linear(const geometry::Rgb& color) {
  static const std::array<double, 256> kTable = [] {
    std::array<double, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = linear_of_srgb(static_cast<double>(i) / 255.0);
    return values;
  }();
  return {kTable[color[0]], kTable[color[1]], kTable[color[2]]};
}

geometry::Rgb srgb(const LinearRgb& color) {
  geometry::Rgb result;
  for (std::size_t i = 0; i < 3; ++i)
    result[i] = static_cast<std::uint8_t>(
        std::lround(255.0 * srgb_of_linear(std::clamp(color[static_cast<Eigen::Index>(i)], 0.0, 1.0))));
  return result;
}

LinearRgb texture_at(const geometry::ColorImage& texture, const Eigen::Vector2d& place) {
  if (!place.allFinite()) return LinearRgb::Zero();
  // Texels have their centres at halves.
  const double x = place.x() * texture.width() - 0.5;
  const double y = place.y() * texture.height() - 0.5;
  const double left = std::floor(x), above = std::floor(y);
  const auto texel = [&](double column, double row) {
    return linear(texture(repeated(column, texture.width()), repeated(row, texture.height())));
  };
  const double across = x - left, down = y - above;
  return (1.0 - down) * ((1.0 - across) * texel(left, above) + across * texel(left + 1.0, above)) +
         down * ((1.0 - across) * texel(left, above + 1.0) + across * texel(left + 1.0, above + 1.0));
}

LinearRgb own_color(const RenderMesh& mesh, std::size_t face, const Vector3d& p_M, const SurfaceMaterial& material) {
  const MeshLook& look = mesh.look;
  if (look.texture_places.empty() && look.vertex_colors.empty()) return linear(material.color);
  const Vector3d shares = corner_shares(mesh, face, p_M);
  if (!look.texture_places.empty()) {
    Eigen::Vector2d place = Eigen::Vector2d::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      place += shares[static_cast<Eigen::Index>(k)] * look.texture_places[face][k].cast<double>();
    return texture_at(*look.texture, place);
  }
  LinearRgb color = LinearRgb::Zero();
  for (std::size_t k = 0; k < 3; ++k)
    color += shares[static_cast<Eigen::Index>(k)] * linear(look.vertex_colors[mesh.triangles[face][k]]);
  return color.cwiseMax(0.0);
}

}  // namespace prescene::rendering
