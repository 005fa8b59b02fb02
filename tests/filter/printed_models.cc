// SPDX-License-Identifier: Apache-2.0
#include "printed_models.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "prescene/core/random.h"

namespace prescene::filter_tests {
namespace {

/// Random brightness in blocks of a rectangle; of one colour for seed 0.
class Blocks {
 public:
  Blocks(int columns, int rows, std::uint64_t seed, std::uint64_t number) : columns_(columns), rows_(rows) {
    core::RandomStream stream(seed, core::Purpose::kTest, number);
    for (int i = 0; i < columns * rows; ++i)
      colors_.push_back(seed == 0 ? geometry::Rgb{150, 150, 150} : color(stream));
  }
  /// u and v in [0, 1).
  geometry::Rgb at(double u, double v) const {
    const int x = std::min(static_cast<int>(u * columns_), columns_ - 1);
    const int y = std::min(static_cast<int>(v * rows_), rows_ - 1);
    return colors_[static_cast<std::size_t>(y * columns_ + x)];
  }

 private:
  static geometry::Rgb color(core::RandomStream& stream) {
    geometry::Rgb c;
    for (std::uint8_t& channel : c) channel = static_cast<std::uint8_t>(stream.uniform(30.0, 230.0));
    return c;
  }
  int columns_, rows_;
  std::vector<geometry::Rgb> colors_;
};

struct Printed {
  geometry::TriangleMesh mesh;
  geometry::MeshLook look;

  std::uint32_t add(const Vector3d& p, const geometry::Rgb& color) {
    mesh.vertices.push_back(p);
    look.vertex_colors.push_back(color);
    return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  }
  /// Counter-clockwise seen from outside.
  void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
};

belief::ObjectModel with_print(const std::string& name, Printed printed) {
  belief::ObjectModel model = mesh_model(name, std::move(printed.mesh));
  model.look = std::make_shared<const geometry::MeshLook>(std::move(printed.look));
  return model;
}

}  // namespace

belief::ObjectModel printed_can(const std::string& name, std::uint64_t seed) {
  constexpr int kAround = 96, kHigh = 24;
  constexpr double kRadius = 0.035, kHeight = 0.11;
  const Blocks blocks(16, 5, seed, 0);
  Printed can;
  for (int row = 0; row <= kHigh; ++row)
    for (int column = 0; column < kAround; ++column) {
      const double angle = 2.0 * std::numbers::pi * column / kAround;
      can.add({kRadius * std::cos(angle), kRadius * std::sin(angle), kHeight * (1.0 * row / kHigh - 0.5)},
              blocks.at((column + 0.5) / kAround, (row + 0.5) / (kHigh + 1)));
    }
  const auto at = [](int column, int row) { return static_cast<std::uint32_t>(row * kAround + column % kAround); };
  for (int row = 0; row < kHigh; ++row)
    for (int column = 0; column < kAround; ++column)
      can.add_quad(at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1));
  const std::uint32_t bottom = can.add({0.0, 0.0, -0.5 * kHeight}, {150, 150, 150});
  const std::uint32_t top = can.add({0.0, 0.0, 0.5 * kHeight}, {150, 150, 150});
  for (int column = 0; column < kAround; ++column) {
    can.mesh.triangles.push_back({bottom, at(column + 1, 0), at(column, 0)});
    can.mesh.triangles.push_back({top, at(column, kHigh), at(column + 1, kHigh)});
  }
  belief::ObjectModel model = with_print(name, std::move(can));
  model.symmetry = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), true);
  return model;
}

belief::ObjectModel printed_box(const std::string& name, const Vector3d& size, std::uint64_t seed) {
  constexpr int kCells = 24;
  Printed box;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Blocks blocks(6, 6, seed, static_cast<std::uint64_t>(2 * axis + (side > 0.0 ? 1 : 0)));
      const int across = (axis + 1) % 3, along = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(box.mesh.vertices.size());
      for (int j = 0; j <= kCells; ++j)
        for (int i = 0; i <= kCells; ++i) {
          Vector3d p = Vector3d::Zero();
          p[axis] = 0.5 * side * size[axis];
          p[across] = size[across] * (1.0 * i / kCells - 0.5);
          p[along] = size[along] * (1.0 * j / kCells - 0.5);
          box.add(p, blocks.at((i + 0.5) / (kCells + 1), (j + 0.5) / (kCells + 1)));
        }
      const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(j * (kCells + 1) + i); };
      for (int j = 0; j < kCells; ++j)
        for (int i = 0; i < kCells; ++i) {
          if (side > 0.0)
            box.add_quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
          else
            box.add_quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        }
    }
  return with_print(name, std::move(box));
}

}  // namespace prescene::filter_tests
