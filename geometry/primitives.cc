// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/primitives.h"

#include <cmath>
#include <numbers>

#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

// Two triangles for a quadrilateral whose corners are counter-clockwise seen from outside.
void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

// Four corners of a rectangle about the z axis at height z, counter-clockwise seen from above.
void add_rectangle(TriangleMesh& mesh, double size_x, double size_y, double z) {
  const double x = 0.5 * size_x;
  const double y = 0.5 * size_y;
  for (const auto& [sx, sy] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
    mesh.vertices.emplace_back(sx * x, sy * y, z);
}

// Sides between two rings of `count` vertices, of which each is counter-clockwise seen from above.
void add_wall(TriangleMesh& mesh, std::uint32_t low, std::uint32_t high, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t j = (i + 1) % count;
    add_quad(mesh, low + i, low + j, high + j, high + i);
  }
}

// Points of a quarter circle from angle `begin` (radians above the equator) over `steps` steps to begin + pi / 2.
void add_arc(std::vector<Eigen::Vector2d>& profile, double radius, double centre_z, double begin, int steps) {
  for (int i = 0; i <= steps; ++i) {
    const double angle = begin + 0.5 * std::numbers::pi * i / steps;
    // The poles are exactly on the axis.
    const bool pole = (begin < 0.0 && i == 0) || (begin >= 0.0 && i == steps);
    profile.emplace_back(pole ? 0.0 : radius * std::cos(angle), centre_z + radius * std::sin(angle));
  }
}

struct MeshMaker {
  int segments;

  TriangleMesh operator()(const Sphere& sphere) const { return (*this)(Capsule{sphere.radius, 0.0}); }

  TriangleMesh operator()(const BoxShape& box) const {
    PRESCENE_CHECK((box.size.array() > 0.0).all());
    TriangleMesh mesh;
    add_rectangle(mesh, box.size.x(), box.size.y(), -0.5 * box.size.z());
    add_rectangle(mesh, box.size.x(), box.size.y(), 0.5 * box.size.z());
    add_quad(mesh, 3, 2, 1, 0);
    add_wall(mesh, 0, 4, 4);
    add_quad(mesh, 4, 5, 6, 7);
    return mesh;
  }

  TriangleMesh operator()(const Cylinder& cylinder) const {
    PRESCENE_CHECK(cylinder.length > 0.0);
    const double z = 0.5 * cylinder.length;
    return make_lathe({{cylinder.radius, -z}, {cylinder.radius, z}}, segments);
  }

  TriangleMesh operator()(const Capsule& capsule) const {
    PRESCENE_CHECK(capsule.radius > 0.0 && capsule.length >= 0.0);
    const int steps = std::max(2, segments / 4);
    const double z = 0.5 * capsule.length;
    std::vector<Eigen::Vector2d> profile;
    add_arc(profile, capsule.radius, -z, -0.5 * std::numbers::pi, steps);
    if (capsule.length == 0.0) profile.pop_back();  // The two equators are one.
    add_arc(profile, capsule.radius, z, 0.0, steps);
    return make_lathe(profile, segments);
  }

  TriangleMesh operator()(const Cone& cone) const {
    PRESCENE_CHECK(cone.length > 0.0);
    return make_lathe({{cone.radius, -0.5 * cone.length}, {0.0, 0.5 * cone.length}}, segments);
  }
};

}  // namespace

TriangleMesh make_mesh(const Primitive& primitive, int segments) {
  PRESCENE_CHECK(segments >= 8);
  return std::visit(MeshMaker{segments}, primitive);
}

TriangleMesh make_open_bin(const Vector3d& inner_size, double wall) {
  PRESCENE_CHECK((inner_size.array() > 0.0).all() && wall > 0.0);
  const double outer_x = inner_size.x() + 2.0 * wall;
  const double outer_y = inner_size.y() + 2.0 * wall;
  const double top = inner_size.z() + wall;
  TriangleMesh mesh;
  add_rectangle(mesh, outer_x, outer_y, 0.0);
  add_rectangle(mesh, outer_x, outer_y, top);
  add_rectangle(mesh, inner_size.x(), inner_size.y(), top);
  add_rectangle(mesh, inner_size.x(), inner_size.y(), wall);
  add_quad(mesh, 3, 2, 1, 0);
  add_wall(mesh, 0, 4, 4);   // Outside.
  add_wall(mesh, 4, 8, 4);   // Rim.
  add_wall(mesh, 8, 12, 4);  // Inside, downwards.
  add_quad(mesh, 12, 13, 14, 15);
  return mesh;
}

TriangleMesh make_gable_carton(double size_x, double size_y, double shoulder_height, double total_height) {
  PRESCENE_CHECK(size_x > 0.0 && size_y > 0.0 && shoulder_height > 0.0 && total_height > shoulder_height);
  // Proportions of a litre carton: the upper third of what is above the shoulder is the fin, 4 % of the depth thick.
  const double bottom = -0.5 * total_height;
  const double shoulder = bottom + shoulder_height;
  const double ridge = shoulder + (2.0 / 3.0) * (total_height - shoulder_height);
  const double top = 0.5 * total_height;
  const double y = 0.5 * size_y;
  const double fin = 0.02 * size_y;
  // The outline in the y-z plane, counter-clockwise seen from +x; extruded along x.
  const std::array<std::pair<double, double>, 8> outline = {
      {{-y, bottom}, {y, bottom}, {y, shoulder}, {fin, ridge}, {fin, top}, {-fin, top}, {-fin, ridge}, {-y, shoulder}}};
  TriangleMesh mesh;
  for (const double x : {-0.5 * size_x, 0.5 * size_x}) {
    for (const auto& [outline_y, outline_z] : outline) mesh.vertices.emplace_back(x, outline_y, outline_z);
  }
  add_wall(mesh, 0, 8, 8);
  for (const auto& [a, b, c, d] : {std::array<std::uint32_t, 4>{0, 1, 2, 7}, {7, 2, 3, 6}, {6, 3, 4, 5}}) {
    add_quad(mesh, 8 + a, 8 + b, 8 + c, 8 + d);
    add_quad(mesh, d, c, b, a);
  }
  return mesh;
}

TriangleMesh make_lathe(const std::vector<Eigen::Vector2d>& profile, int segments) {
  PRESCENE_CHECK(profile.size() >= 2 && segments >= 3);
  const auto ring_size = static_cast<std::uint32_t>(segments);
  std::vector<Eigen::Vector2d> closed = profile;
  if (closed.front().x() > 0.0) closed.insert(closed.begin(), {0.0, closed.front().y()});
  if (closed.back().x() > 0.0) closed.emplace_back(0.0, closed.back().y());
  PRESCENE_CHECK_MSG(closed.size() >= 3, "a profile on the axis encloses nothing");

  TriangleMesh mesh;
  mesh.vertices.emplace_back(0.0, 0.0, closed.front().y());
  for (std::size_t i = 1; i + 1 < closed.size(); ++i) {
    PRESCENE_CHECK_MSG(closed[i].x() > 0.0, "only the ends of a profile may be on the axis");
    for (int k = 0; k < segments; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / segments;
      mesh.vertices.emplace_back(closed[i].x() * std::cos(angle), closed[i].x() * std::sin(angle), closed[i].y());
    }
  }
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.0, 0.0, closed.back().y());

  for (std::uint32_t k = 0; k < ring_size; ++k) mesh.triangles.push_back({0, 1 + (k + 1) % ring_size, 1 + k});
  for (std::uint32_t low = 1; low + ring_size < last; low += ring_size) add_wall(mesh, low, low + ring_size, ring_size);
  const std::uint32_t top_ring = last - ring_size;
  for (std::uint32_t k = 0; k < ring_size; ++k) {
    mesh.triangles.push_back({last, top_ring + k, top_ring + (k + 1) % ring_size});
  }
  return mesh;
}

}  // namespace prescene::geometry
