// SPDX-License-Identifier: Apache-2.0
#include "simulated_room.h"

#include <algorithm>
#include <utility>

#include "prescene/geometry/polygon.h"
#include "prescene/geometry/primitives.h"

namespace prescene::service {
namespace {

using Eigen::Vector2d;
using geometry::BoxShape;
using geometry::Pose;
using geometry::TriangleMesh;
using geometry::Vector3d;

belief::PrimitiveShape part(const Vector3d& size, const Vector3d& middle) {
  return {BoxShape{size}, Pose::from_translation(middle)};
}

/// Furniture stands with the middle of its base at the support's origin.
Furniture block(const std::string& name, const Vector2d& size, double height) {
  Furniture made;
  made.support.name = name;
  made.support.collision.push_back(part({size.x(), size.y(), height}, {0.0, 0.0, 0.5 * height}));
  made.places.push_back({name, Pose::from_translation({0.0, 0.0, height}), 0.5 * size});
  return made;
}

Furniture table(const std::string& name, const Vector2d& size, double height) {
  constexpr double kTop = 0.03, kLeg = 0.04;
  Furniture made;
  made.support.name = name;
  made.support.collision.push_back(part({size.x(), size.y(), kTop}, {0.0, 0.0, height - 0.5 * kTop}));
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      made.support.collision.push_back(
          part({kLeg, kLeg, height - kTop},
               {0.5 * x * (size.x() - kLeg), 0.5 * y * (size.y() - kLeg), 0.5 * (height - kTop)}));
  made.places.push_back({name, Pose::from_translation({0.0, 0.0, height}), 0.5 * size});
  return made;
}

Furniture shelf(const std::string& name, const Vector2d& size, double low, double high) {
  constexpr double kBoard = 0.02;
  Furniture made;
  made.support.name = name;
  for (const double top : {low, high}) {
    made.support.collision.push_back(part({size.x(), size.y(), kBoard}, {0.0, 0.0, top - 0.5 * kBoard}));
    made.places.push_back({name + (top == low ? " (lower board)" : " (upper board)"),
                           Pose::from_translation({0.0, 0.0, top}), 0.5 * size - Vector2d(2.0 * kBoard, 0.0)});
  }
  made.places[0].headroom = high - kBoard - low - 0.01;
  for (const double x : {-1.0, 1.0})
    made.support.collision.push_back(
        part({kBoard, size.y(), high - kBoard}, {0.5 * x * (size.x() - kBoard), 0.0, 0.5 * (high - kBoard)}));
  return made;
}

}  // namespace

Outline outline_of(const TriangleMesh& mesh, const Pose& X_WM) {
  Outline points;
  for (const Vector3d& vertex : mesh.vertices) points.push_back((X_WM * vertex).head<2>());
  return geometry::convex_polygon(std::move(points));
}

Room furnish(core::RandomStream& draws) {
  Room room;
  const int wanted = 2 + static_cast<int>(draws.uniform_below(3));
  room.has_floor = draws.uniform() < 0.6;
  room.supports = room.has_floor ? 1 : 0;
  std::vector<Furniture> row;
  while (room.supports < wanted) {
    const double depth = draws.uniform(0.30, 0.50);
    const Vector2d size(draws.uniform(0.35, 0.55), depth);
    const double height = draws.uniform(0.12, 0.75);
    const double kind = draws.uniform();
    const std::string number = std::to_string(row.size() + 1);
    if (kind < 0.25 && room.supports + 2 <= wanted) {
      const double low = draws.uniform(0.10, 0.35);
      row.push_back(shelf("shelf_" + number, size, low, low + draws.uniform(0.34, 0.45)));
    } else if (kind < 0.6) {
      row.push_back(table("table_" + number, size, std::max(0.3, height)));
    } else {
      row.push_back(block("block_" + number, size, height));
    }
    room.supports += static_cast<int>(row.back().places.size());
  }
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double x = 0.65 * (static_cast<double>(i) - 0.5 * static_cast<double>(row.size() - 1));
    const Pose X_WS{geometry::exp_rotation(draws.uniform(-0.2, 0.2) * Vector3d::UnitZ()),
                    {x, draws.uniform(-0.12, 0.12), 0.0}};
    Furniture& one = row[i];
    one.support.X_WS = X_WS;
    one.outline = outline_of(belief::collision_mesh(one.support.collision), X_WS);
    for (RoomPlace& place : one.places) {
      place.X_WP = X_WS * place.X_WP;
      room.middle_height += place.X_WP.translation.z() / room.supports;
    }
    room.furniture.push_back(std::move(one));
  }
  if (room.has_floor) {
    Furniture floor;
    floor.support.name = "floor";
    floor.support.collision.push_back(part({6.0, 6.0, 0.1}, {0.0, 0.0, -0.05}));
    floor.places.push_back({"floor", Pose::from_translation({0.0, -0.35, 0.0}), {0.9, 0.6}});
    room.furniture.push_back(std::move(floor));
  }
  if (draws.uniform() < 0.3)
    room.wall = geometry::transformed(geometry::make_mesh(BoxShape{{6.0, 0.1, 4.0}}),
                                      Pose::from_translation({0.0, draws.uniform(0.45, 0.7), 1.0}));
  return room;
}

}  // namespace prescene::service
