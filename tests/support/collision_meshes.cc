// SPDX-License-Identifier: Apache-2.0
#include "tests/support/collision_meshes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>

#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"

namespace prescene::tests {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;

/// A surface over a grid that closes in both directions where asked.
TriangleMesh grid_mesh(int rows, int columns, bool rows_close, bool columns_close,
                       const std::function<Vector3d(int row, int column)>& point) {
  TriangleMesh mesh;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) mesh.vertices.push_back(point(row, column));
  const auto index = [&](int row, int column) {
    return static_cast<std::uint32_t>((row % rows) * columns + column % columns);
  };
  for (int row = 0; row < rows - (rows_close ? 0 : 1); ++row) {
    for (int column = 0; column < columns - (columns_close ? 0 : 1); ++column) {
      const std::uint32_t p = index(row, column), q = index(row, column + 1), r = index(row + 1, column),
                          s = index(row + 1, column + 1);
      mesh.triangles.push_back({p, q, s});
      mesh.triangles.push_back({p, s, r});
    }
  }
  return mesh;
}

void close_with_pole(const Vector3d& pole, std::uint32_t first, int columns, bool top, TriangleMesh* mesh) {
  const auto tip = static_cast<std::uint32_t>(mesh->vertices.size());
  mesh->vertices.push_back(pole);
  for (int column = 0; column < columns; ++column) {
    const std::uint32_t p = first + static_cast<std::uint32_t>(column);
    const std::uint32_t q = first + static_cast<std::uint32_t>((column + 1) % columns);
    mesh->triangles.push_back(top ? std::array<std::uint32_t, 3>{p, q, tip} : std::array<std::uint32_t, 3>{q, p, tip});
  }
}

/// A mug without its handle, 0.1 m high.
TriangleMesh make_beaker(int segments) {
  return geometry::make_lathe(
      {{0.0, 0.0}, {0.035, 0.0}, {0.04, 0.01}, {0.042, 0.05}, {0.045, 0.1}, {0.042, 0.1}, {0.038, 0.02}, {0.0, 0.01}},
      segments);
}

}  // namespace

TriangleMesh make_bumpy_sphere(double radius, int triangles) {
  // Two triangles a cell, twice as many columns as rows.
  const int rows = std::max(4, static_cast<int>(std::lround(std::sqrt(triangles / 4.0)))), columns = 2 * rows;
  const auto point = [&](double polar, double azimuth) {
    const double bump =
        1.0 + 0.1 * std::sin(5.0 * azimuth) * std::sin(polar) * std::sin(polar) + 0.1 * std::cos(7.0 * polar);
    return Vector3d(
        radius * bump *
        Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)));
  };
  // Rows go from the south to the north, so that triangles face outwards.
  TriangleMesh mesh = grid_mesh(rows, columns, false, true, [&](int row, int column) {
    return point(M_PI * (1.0 - (row + 1.0) / (rows + 1.0)), 2.0 * M_PI * column / columns);
  });
  close_with_pole(point(M_PI, 0.0), 0, columns, false, &mesh);
  close_with_pole(point(0.0, 0.0), static_cast<std::uint32_t>((rows - 1) * columns), columns, true, &mesh);
  return mesh;
}

TriangleMesh make_knot(double radius, int triangles) {
  const int around = std::max(6, static_cast<int>(std::lround(std::sqrt(triangles / 40.0)))),
            along = triangles / (2 * around);
  const auto line = [&](double s) {
    const double r = 2.0 + std::cos(3.0 * s);
    return Vector3d(radius / 3.0 * Vector3d(r * std::cos(2.0 * s), r * std::sin(2.0 * s), -std::sin(3.0 * s)));
  };
  return grid_mesh(along, around, true, true, [&](int row, int column) {
    const double s = 2.0 * M_PI * row / along, angle = 2.0 * M_PI * column / around, h = 1e-4;
    const Vector3d tangent = (line(s + h) - line(s - h)).normalized();
    const Vector3d side = tangent.cross(line(s + h) + line(s - h) - 2.0 * line(s)).normalized();
    const Vector3d up = tangent.cross(side);
    return Vector3d(line(s) + radius / 6.0 * (std::cos(angle) * side + std::sin(angle) * up));
  });
}

TriangleMesh make_wavy_sheet(double size, int triangles) {
  const int count = std::max(2, static_cast<int>(std::lround(std::sqrt(triangles / 2.0))) + 1);
  return grid_mesh(count, count, false, false, [&](int row, int column) {
    const double x = size * row / (count - 1), y = size * column / (count - 1);
    return Vector3d(x, y, 0.05 * size * std::sin(9.0 * x / size) * std::cos(7.0 * y / size));
  });
}

std::shared_ptr<const collision::Mesh> collision_mesh(const TriangleMesh& mesh, std::string_view name) {
  core::Result<std::shared_ptr<const collision::Mesh>> made = collision::Mesh::make(mesh, name);
  PRESCENE_CHECK_MSG(made.ok(), made.status().message());
  return *std::move(made);
}

std::shared_ptr<const collision::Mesh> read_collision_mesh(std::string_view file) {
  const std::optional<TriangleMesh> mesh = read_recorded_mesh(file);
  return mesh ? collision_mesh(*mesh, std::filesystem::path(file).stem().string()) : nullptr;
}

std::vector<MeshPair> recorded_mesh_pairs() {
  static constexpr std::array<std::array<std::string_view, 2>, 14> kPairs = {{
      {"scans/stanford_bunny_closed.ply", "scans/stanford_bunny_closed.ply"},
      {"scans/stanford_dragon.ply", "scans/stanford_dragon.ply"},
      {"scans/armadillo.ply", "scans/happy_buddha_closed.ply"},
      {"scans/nefertiti.ply", "scans/spot_cow.ply"},
      {"household/ycb_mug.ply", "household/ycb_banana.ply"},
      {"household/ycb_power_drill.ply", "household/ycb_cracker_box.ply"},
      {"household/ycb_bowl.ply", "household/ycb_spoon.ply"},
      {"household/ycb_scissors.ply", "household/ycb_extra_large_clamp.ply"},
      {"household/open_bin.ply", "household/ycb_bleach_cleanser.ply"},
      {"household/drinking_glass.ply", "household/plate_8in.ply"},
      {"household/milk_carton.ply", "household/cereal_box.ply"},
      {"robot/panda_hand_visual.ply", "household/ycb_mustard_bottle.ply"},
      {"robot/robotiq_2f85_base.ply", "robot/iiwa14_link7.ply"},
      {"robot/panda_link5_visual.ply", "robot/panda_link0_visual.ply"},
  }};
  std::vector<MeshPair> pairs;
  for (const auto& [file_a, file_b] : kPairs) {
    std::shared_ptr<const collision::Mesh> a = read_collision_mesh(file_a);
    if (!a) return {};
    std::shared_ptr<const collision::Mesh> b = file_b == file_a ? a : read_collision_mesh(file_b);
    std::string name = a->name() + " / " + b->name();
    pairs.push_back({std::move(name), std::move(a), std::move(b)});
  }
  return pairs;
}

std::vector<MeshPair> made_mesh_pairs() {
  const auto bumpy = collision_mesh(make_bumpy_sphere(0.1, 40000), "bumpy_sphere");
  const auto knot = collision_mesh(make_knot(0.1, 20000), "knot");
  const auto beaker = collision_mesh(make_beaker(128), "beaker");
  const auto sheet = collision_mesh(make_wavy_sheet(0.2, 5000), "wavy_sheet");
  const auto box = collision_mesh(geometry::make_open_bin({0.1, 0.15, 0.05}, 0.005), "bin");
  return {{"bumpy_sphere / knot", bumpy, knot},
          {"knot / knot", knot, knot},
          {"beaker / wavy_sheet", beaker, sheet},
          {"bin / beaker", box, beaker}};
}

}  // namespace prescene::tests
