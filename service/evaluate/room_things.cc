// SPDX-License-Identifier: Apache-2.0
#include "room_things.h"

#include <memory>
#include <numbers>
#include <utility>

namespace prescene::service {
namespace {

using geometry::BoxShape;
using geometry::Pose;
using geometry::SymmetryGroup;
using geometry::TriangleMesh;
using geometry::Vector3d;

geometry::Quaterniond about(const Vector3d& axis, double angle) { return geometry::exp_rotation(angle * axis); }

std::vector<geometry::Quaterniond> upright_or_on_its_side() {
  return {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), 0.5 * std::numbers::pi)};
}

std::vector<geometry::Quaterniond> on_any_face() {
  return {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), 0.5 * std::numbers::pi),
          about(Vector3d::UnitY(), 0.5 * std::numbers::pi)};
}

ThingKind box_kind(const std::string& name, const Vector3d& size) {
  return {name, geometry::make_mesh(BoxShape{size}), BoxShape{size}, on_any_face(), true, SymmetryGroup::cuboid()};
}

ThingKind can_kind(const std::string& name, double radius, double length) {
  const geometry::Cylinder cylinder{radius, length};
  return {name,     geometry::make_mesh(cylinder, 24),
          cylinder, upright_or_on_its_side(),
          false,    SymmetryGroup::continuous(Vector3d::UnitZ(), true)};
}

ThingKind mug_kind() {
  TriangleMesh mesh =
      geometry::make_lathe({{0.0, 0.0}, {0.040, 0.0}, {0.041, 0.09}, {0.037, 0.09}, {0.036, 0.005}, {0.0, 0.005}}, 24);
  const auto bar = [&](const Vector3d& size, const Vector3d& middle) {
    mesh = geometry::joined(mesh,
                            geometry::transformed(geometry::make_mesh(BoxShape{size}), Pose::from_translation(middle)));
  };
  bar({0.030, 0.012, 0.010}, {0.054, 0.0, 0.070});
  bar({0.030, 0.012, 0.010}, {0.054, 0.0, 0.025});
  bar({0.010, 0.012, 0.055}, {0.066, 0.0, 0.0475});
  return {"mug",
          mesh,
          geometry::Cylinder{0.041, 0.09},
          {geometry::Quaterniond::Identity(), about(Vector3d::UnitX(), std::numbers::pi)},
          false};
}

}  // namespace

std::vector<ThingKind> known_things() {
  return {
      box_kind("cereal", {0.06, 0.16, 0.21}),
      box_kind("tea_box", {0.07, 0.075, 0.13}),
      box_kind("brick", {0.10, 0.20, 0.065}),
      can_kind("can", 0.034, 0.102),
      can_kind("tin", 0.051, 0.139),
      {"bottle",
       geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.035, 0.13}, {0.014, 0.18}, {0.014, 0.21}, {0.0, 0.21}}, 24),
       geometry::Cylinder{0.035, 0.21}, upright_or_on_its_side(), false,
       SymmetryGroup::continuous(Vector3d::UnitZ(), false)},
      {"carton", geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23), BoxShape{{0.07, 0.07, 0.23}}, on_any_face(),
       false, SymmetryGroup::cyclic(Vector3d::UnitZ(), 2)},
      mug_kind(),
      {"bowl",
       geometry::make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.080, 0.055}, {0.076, 0.055}, {0.033, 0.005}, {0.0, 0.005}},
                            24),
       geometry::Cylinder{0.08, 0.055},
       {geometry::Quaterniond::Identity()},
       false,
       SymmetryGroup::continuous(Vector3d::UnitZ(), false)},
      {"ball",
       geometry::make_mesh(geometry::Sphere{0.045}, 24),
       geometry::Sphere{0.045},
       {geometry::Quaterniond::Identity()},
       false,
       SymmetryGroup::every_rotation()}};
}

ThingKind unknown_thing(core::RandomStream& draws) {
  if (draws.uniform() < 0.6) {
    const double x = draws.uniform(0.04, 0.14), y = draws.uniform(0.04, 0.14), z = draws.uniform(0.04, 0.18);
    return box_kind("unknown box", {x, y, z});
  }
  const double radius = draws.uniform(0.02, 0.06), length = draws.uniform(0.05, 0.20);
  return can_kind("unknown can", radius, length);
}

core::Result<belief::ObjectModel> model_of(const ThingKind& kind) {
  belief::ObjectModel model;
  model.name = kind.name;
  model.collision.push_back(
      belief::PrimitiveShape{kind.solid, Pose::from_translation(geometry::bounding_box(kind.mesh).center())});
  model.visual = std::make_shared<const TriangleMesh>(kind.mesh);
  model.symmetry = kind.symmetry;
  return belief::with_derived_properties(std::move(model));
}

}  // namespace prescene::service
