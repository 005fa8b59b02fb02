// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "prescene/core/text.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/mesh_use.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::CollisionShape;
using belief::MeshPtr;
using belief::MeshShape;
using belief::MeshUse;
using belief::PrimitiveShape;
using geometry::Pose;
using geometry::Vector3d;

const std::vector<std::string> kShapeKeys{"box",   "sphere",       "cylinder", "capsule", "cone", "mesh",
                                          "lathe", "gable_carton", "open_bin", "ground",  "parts"};
constexpr const char* kShapeRemedy =
    "give one shape: box, sphere, cylinder, capsule, cone, mesh, lathe, gable_carton, open_bin, ground or parts";

// An object whose mesh fills less of its hull than this collides as spheres where its file does not say how.
constexpr double kNearlyConvex = 0.95;

MeshPtr shared(geometry::TriangleMesh mesh) { return std::make_shared<const geometry::TriangleMesh>(std::move(mesh)); }

class ShapeReader {
 public:
  ShapeReader(const NumberRange& size, bool may_move, SceneContext& context)
      : size_(size), may_move_(may_move), context_(context), problems_(context.problems) {}

  // The shape under one of the keys; nothing when it was reported.
  std::optional<BodyShape> read(const std::string& key, const LocatedValue& value) {
    const std::size_t before = problems_.errors().size();
    BodyShape shape = read_kind(key, value);
    shape.place = &value;
    if (problems_.errors().size() > before) return std::nullopt;
    return shape;
  }

 private:
  BodyShape read_kind(const std::string& key, const LocatedValue& value) {
    if (key == "box") return primitive(geometry::BoxShape{read_vector(value, problems_, size_)});
    if (key == "sphere") return read_sphere(value);
    if (key == "mesh") return read_mesh_shape(value);
    if (key == "lathe") return read_lathe(value);
    if (key == "gable_carton") return read_gable_carton(value);
    if (key == "open_bin") return read_open_bin(value);
    if (key == "ground") return read_ground(value);
    if (key == "parts") return read_parts(value);
    Binder binder(value, problems_);
    const double radius = number(binder, "radius", "give the radius in metres");
    const double length = number(binder, "length", "give the length along the axis z in metres");
    if (key == "cylinder") return primitive(geometry::Cylinder{radius, length});
    if (key == "capsule") return primitive(geometry::Capsule{radius, length});
    return primitive(geometry::Cone{radius, length});
  }

  double number(Binder& binder, std::string_view key, std::string_view remedy) {
    const LocatedValue* at = binder.require(key, remedy);
    return at ? read_number(*at, problems_, size_).value_or(1.0) : 1.0;
  }

  static BodyShape primitive(const geometry::Primitive& primitive, const Pose& X_OS = {}) {
    BodyShape shape;
    shape.collision.emplace_back(PrimitiveShape{primitive, X_OS});
    return shape;
  }

  BodyShape read_sphere(const LocatedValue& value) {
    if (value.kind == LocatedValue::Kind::kScalar)
      return primitive(geometry::Sphere{read_number(value, problems_, size_).value_or(1.0)});
    Binder binder(value, problems_);
    return primitive(geometry::Sphere{number(binder, "radius", "give the radius in metres")});
  }

  // How a mesh collides, as far as the file says.
  struct Use {
    MeshUse use = MeshUse::kConvexHull;
    belief::SphereSettings spheres;
    const LocatedValue* at = nullptr;  // nothing: by its shape
  };
  Use read_use(Binder& binder) {
    Use use;
    binder.read_enum("use", use.use, mesh_uses());
    use.at = binder.find("use");
    if (use.use == MeshUse::kSurface && may_move_)
      problems_.add(use.at->place, use.at->path, "a surface of triangles can't move",
                    "use spheres, convex_hull, convex_parts or decompose");
    binder.read("spheres", use.spheres.count, 50, 100'000, "give about how many spheres stand for the surface");
    binder.read("edge_fidelity", use.spheres.edge_fidelity,
                {1e-6, 0.1, "give how far inside edges may lie, in metres: 0.001"});
    for (const char* key : {"spheres", "edge_fidelity"}) {
      const LocatedValue* at = binder.find(key);
      if (at && use.at && use.use != MeshUse::kSpheres)
        problems_.add(at->place, at->path, "only meshes of spheres have this", "write 'use: spheres', or remove it");
      if (at && !use.at) use.use = MeshUse::kSpheres;
    }
    return use;
  }

  // What a mesh is simulated as. `place` is where the shape is described.
  MeshShape with_use(const MeshPtr& mesh, const Use& use, const LocatedValue& place) {
    MeshShape shape{mesh, Pose{}, use.use, use.spheres};
    if (!use.at && use.use == MeshUse::kConvexHull && may_move_ && is_hollow(*mesh)) shape.use = MeshUse::kSpheres;
    warn_of_hidden_hollow(shape, use.at ? *use.at : place);
    if (shape.use != MeshUse::kSpheres) return shape;
    if (const auto solid = geometry::mass_properties(*mesh, 1.0); !solid)
      problems_.add(place.place, place.path, "spheres can't stand for this mesh: " + solid.status().message(),
                    "close the mesh, or use convex_hull or decompose");
    else if (use.spheres.edge_fidelity > 0.1 * geometry::bounding_box(*mesh).sizes().norm())
      problems_.add(place.place, place.path, "edge_fidelity is more than a tenth of the mesh's diagonal",
                    "give metres: 0.001");
    return shape;
  }

  void warn_of_hidden_hollow(const MeshShape& shape, const LocatedValue& place) {
    const std::optional<double> hollow = hidden_hollow(shape);
    if (!hollow || *hollow <= kLargestHiddenHollow) return;
    problems_.warn(place.place, place.path,
                   core::fixed_text(100.0 * *hollow, 0) + " % of its convex hull" +
                       (shape.use == MeshUse::kConvexParts ? "s are" : " is") +
                       " hollow in the mesh, and nothing can get into that",
                   may_move_ ? "remove 'use', or write 'use: spheres' or 'use: decompose'" : "write 'use: surface'");
  }

  static bool is_hollow(const geometry::TriangleMesh& mesh) {
    const auto solid = geometry::mass_properties(mesh, 1.0);
    const auto hull = geometry::convex_hull(mesh.vertices);
    if (!solid || !hull) return false;
    const auto filled = geometry::mass_properties(*hull, 1.0);
    return filled && solid->mass < kNearlyConvex * filled->mass;
  }

  BodyShape read_mesh_shape(const LocatedValue& value) {
    Binder binder(value, problems_);
    const Use use = read_use(binder);
    BodyShape shape;
    if (MeshPtr mesh = read_mesh_file(binder)) {
      check_extent(value, *mesh);
      shape.visual = mesh;
      shape.collision.emplace_back(with_use(mesh, use, value));
    }
    return shape;
  }

 public:
  MeshPtr read_mesh_file(Binder& binder) {
    const LocatedValue* file = binder.require("file", "give the path of a mesh file");
    MeshRequest request;
    binder.read("scale", request.scale, {1e-9, 1e9, "give metres per unit of the file: 0.001 for millimetres"});
    static const std::vector<std::pair<std::string, bool>> kUps{{"z", false}, {"y", true}};
    binder.read_enum("up", request.y_up, kUps);
    const std::optional<std::string> name = file ? read_text(*file, problems_) : std::nullopt;
    if (!name) return nullptr;
    if (!context_.options.read_mesh) {
      problems_.add(file->place, file->path, "meshes can't be read here", "describe the shape by primitives");
      return nullptr;
    }
    request.path = std::filesystem::path(*file->place.file).parent_path() / *name;
    MeshPtr& mesh = context_.meshes[{request.path.string(), request.scale, request.y_up}];
    if (!mesh) {
      core::Result<geometry::TriangleMesh> result = context_.options.read_mesh(request);
      if (result && result->empty()) result = core::invalid_input("the mesh has no triangles: give one with a surface");
      if (!result) {
        problems_.add(file->place, file->path, "the mesh can't be used", result.status().message());
        return nullptr;
      }
      mesh = shared(*std::move(result));
      if (context_.options.read_look)
        if (geometry::LookPtr look = context_.options.read_look(request)) context_.looks[mesh] = std::move(look);
    }
    return mesh;
  }

 private:
  void check_extent(const LocatedValue& value, const geometry::TriangleMesh& mesh) {
    const Vector3d size = geometry::bounding_box(mesh).sizes();
    const double extent = size.maxCoeff();
    if (extent > size_.high)
      problems_.add(value.place, value.path,
                    "the mesh's bounding box is " + core::rounded_text(size.x()) + " x " +
                        core::rounded_text(size.y()) + " x " + core::rounded_text(size.z()) + " m",
                    "the mesh is probably in millimetres: give scale: 0.001");
    else if (extent < 1e-4)
      problems_.add(value.place, value.path, "the mesh is only " + core::rounded_text(extent) + " m large",
                    "give the scale in metres per unit of the file");
  }

  BodyShape read_lathe(const LocatedValue& value) {
    Binder binder(value, problems_);
    int segments = 32;
    binder.read("segments", segments, 8, 256);
    const Use use = read_use(binder);
    const LocatedValue* at = binder.require("profile", "give points [radius, z] from bottom to top");
    if (!at) return {};
    std::vector<Eigen::Vector2d> profile;
    if (at->kind != LocatedValue::Kind::kList || at->items.size() < 2 || at->items.size() > 1000) {
      report_type(*at, problems_, "give 2 to 1000 points [radius, z] from bottom to top");
      return {};
    }
    const std::size_t before = problems_.errors().size();
    for (const LocatedValue& item : at->items)
      if (const auto point = read_numbers(item, problems_, 2, kPosition))
        profile.emplace_back((*point)[0], (*point)[1]);
    if (problems_.errors().size() > before) return {};
    for (std::size_t i = 0; i < profile.size(); ++i) {
      const bool is_end = i == 0 || i + 1 == profile.size();
      if (profile[i].x() < (is_end ? 0.0 : size_.low) || profile[i].x() > size_.high)
        problems_.add(at->items[i].place, at->items[i].path,
                      "the radius " + number_text(profile[i].x()) + " is out of range",
                      "give metres, more than 0 (0 at the two ends only) and at most " + number_text(size_.high));
      if (i > 0 && profile[i] == profile[i - 1])
        problems_.add(at->items[i].place, at->items[i].path, "the point is the same as the one before", "remove it");
    }
    if (profile.size() == 2 && (profile[0].x() == 0.0 || profile[1].x() == 0.0) &&
        profile[0].x() + profile[1].x() == 0.0)
      problems_.add(at->place, at->path, "the profile lies on the axis", "give radii of more than 0");
    if (problems_.errors().size() > before) return {};
    BodyShape shape;
    shape.visual = shared(geometry::make_lathe(profile, segments));
    shape.collision.emplace_back(with_use(shape.visual, use, value));
    return shape;
  }

  BodyShape read_gable_carton(const LocatedValue& value) {
    Binder binder(value, problems_);
    const LocatedValue* base_at = binder.require("base", "give the edges [x, y] of the base in metres");
    const auto base = base_at ? read_numbers(*base_at, problems_, 2, size_) : std::nullopt;
    const double shoulder = number(binder, "shoulder_height", "give the height of the walls in metres");
    const double height = number(binder, "height", "give the height up to the top of the gable in metres");
    if (binder.find("shoulder_height") && binder.find("height") && !(height > shoulder))
      problems_.add(value.place, value.path, "the height is not above the shoulder_height", "give a height above it");
    if (!base || !(height > shoulder)) return {};
    BodyShape shape;
    shape.visual = shared(geometry::make_gable_carton((*base)[0], (*base)[1], shoulder, height));
    shape.collision.emplace_back(MeshShape{shape.visual, Pose{}, MeshUse::kConvexHull});
    return shape;
  }

  // Five boxes, which collide as what they are; the origin is the centre of the outer bottom face.
  BodyShape read_open_bin(const LocatedValue& value) {
    Binder binder(value, problems_);
    const LocatedValue* inner_at = binder.require("inner", "give the edges [x, y, z] of the hollow in metres");
    const double wall = number(binder, "wall", "give the thickness of walls and floor in metres");
    if (!inner_at) return {};
    const std::size_t before = problems_.errors().size();
    const Vector3d inner = read_vector(*inner_at, problems_, size_);
    if (problems_.errors().size() > before) return {};
    BodyShape shape;
    const auto add = [&](const Vector3d& size, const Vector3d& center) {
      shape.collision.emplace_back(PrimitiveShape{geometry::BoxShape{size}, Pose::from_translation(center)});
    };
    const Vector3d middle(0.0, 0.0, wall + 0.5 * inner.z());
    add({inner.x() + 2.0 * wall, inner.y() + 2.0 * wall, wall}, {0.0, 0.0, 0.5 * wall});
    for (const double side : {-0.5, 0.5}) {
      add({wall, inner.y() + 2.0 * wall, inner.z()}, middle + Vector3d(side * (inner.x() + wall), 0.0, 0.0));
      add({inner.x(), wall, inner.z()}, middle + Vector3d(0.0, side * (inner.y() + wall), 0.0));
    }
    shape.visual = shared(geometry::make_open_bin(inner, wall));
    shape.hollow = belief::Hollow{Pose::from_translation(middle), inner};
    return shape;
  }

  // A flat box whose upper face is at z = 0.
  BodyShape read_ground(const LocatedValue& value) {
    Binder binder(value, problems_);
    if (may_move_)
      problems_.add(value.place, value.path, "the ground can't move", "use it for a support, or give a box");
    double size = 4.0;
    constexpr double kThickness = 0.1;
    binder.read("size", size, kSupportSize);
    return primitive(geometry::BoxShape{{size, size, kThickness}},
                     Pose::from_translation({0.0, 0.0, -0.5 * kThickness}));
  }

  BodyShape read_parts(const LocatedValue& value) {
    BodyShape whole;
    if (value.kind != LocatedValue::Kind::kList || value.items.empty() || value.items.size() > 1000) {
      report_type(value, problems_, "give a list of 1 to 1000 shapes, each with position and rotation");
      return whole;
    }
    for (const LocatedValue& item : value.items) {
      Binder binder(item, problems_);
      const Pose X_OP = read_pose_keys(binder);
      std::string which;
      std::vector<std::string> keys = kShapeKeys;
      keys.pop_back();  // no parts of parts
      const LocatedValue* at = binder.one_of(keys, kShapeRemedy, false, &which);
      const std::optional<BodyShape> part = at ? read(which, *at) : std::nullopt;
      if (part) add_part(*part, X_OP, whole);
    }
    return whole;
  }

  static void add_part(const BodyShape& part, const Pose& X_OP, BodyShape& whole) {
    for (CollisionShape shape : part.collision) {
      std::visit([&](auto& of) { of.X_OS = X_OP * of.X_OS; }, shape);
      whole.collision.push_back(std::move(shape));
    }
    if (part.hollow && !whole.hollow) whole.hollow = belief::Hollow{X_OP * part.hollow->X_OV, part.hollow->size};
  }

  const NumberRange& size_;
  bool may_move_;
  SceneContext& context_;
  Problems& problems_;
};

}  // namespace

BodyShape read_body_shape(Binder& binder, const NumberRange& size, bool may_move, SceneContext& context) {
  ShapeReader reader(size, may_move, context);
  BodyShape body;
  std::string which;
  if (const LocatedValue* at = binder.one_of(kShapeKeys, kShapeRemedy, false, &which)) {
    if (std::optional<BodyShape> shape = reader.read(which, *at)) body = *std::move(shape);
    body.place = at;
  }
  if (const LocatedValue* visual = binder.find("visual")) {
    Binder mesh(*visual, context.problems);
    if (MeshPtr read = reader.read_mesh_file(mesh)) body.visual = std::move(read);
  }
  if (const LocatedValue* hollow = binder.find("hollow")) {
    Binder box(*hollow, context.problems);
    belief::Hollow volume;
    if (const LocatedValue* at = box.require("size", "give the edges [x, y, z] in metres"))
      volume.size = read_vector(*at, context.problems, size);
    volume.X_OV = read_pose_keys(box);
    body.hollow = volume;
  }
  // Only one mesh of two parts could be shown otherwise.
  if (!body.visual && !body.collision.empty()) body.visual = shared(belief::collision_mesh(body.collision));
  return body;
}

}  // namespace prescene::interfaces
