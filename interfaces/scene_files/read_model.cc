// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::ContactProperties;
using belief::ObjectModel;
using geometry::Matrix3d;
using geometry::SymmetryGroup;
using geometry::Vector3d;

constexpr NumberRange kLever{0.0, 0.5, "give metres between 0 and 0.5", "m"};

// A radius larger than half of the thinnest part would round away more than there is.
void check_edges(Binder& binder, const BodyShape& shape, const ContactProperties& contact) {
  const LocatedValue* at = binder.find("edge_radius");
  if (!at) return;
  const double half = belief::thinnest_half(shape.collision);
  if (contact.edge_radius <= half * (1.0 + 1e-6)) return;
  binder.problems().add(at->place, at->path,
                        number_text(contact.edge_radius) + " m is more than half the size of the shape, " +
                            core::rounded_text(half) + " m where it is thinnest",
                        "give a smaller radius");
}

// Whether the product of any two of the rotations is one of them or the identity.
bool is_group(const std::vector<geometry::Quaterniond>& rotations) {
  constexpr double kSame = 0.02;  // rad: hand-written digits
  for (const geometry::Quaterniond& a : rotations) {
    for (const geometry::Quaterniond& b : rotations) {
      const geometry::Quaterniond product = a * b;
      const bool known = geometry::angle_between(product, geometry::Quaterniond::Identity()) < kSame ||
                         std::any_of(rotations.begin(), rotations.end(), [&](const geometry::Quaterniond& c) {
                           return geometry::angle_between(product, c) < kSame;
                         });
      if (!known) return false;
    }
  }
  return true;
}

SymmetryGroup read_rotations(const LocatedValue& value, Problems& problems) {
  SymmetryGroup group;
  if (value.kind != LocatedValue::Kind::kList || value.items.empty() || value.items.size() > 64) {
    report_type(value, problems,
                "give a list of 1 to 64 rotations {quaternion_wxyz: [w, x, y, z]}, without the identity");
    return group;
  }
  const std::size_t before = problems.errors().size();
  for (const LocatedValue& item : value.items) group.rotations.push_back(read_rotation(item, problems));
  if (problems.errors().size() == before && !is_group(group.rotations))
    problems.add(value.place, value.path, "the rotations are no group", "add the product of any two of them");
  return group;
}

SymmetryGroup read_turns(Binder& binder, const LocatedValue& axis_at, const Vector3d& center) {
  Problems& problems = binder.problems();
  const Vector3d axis = read_axis(axis_at, problems);
  bool continuous = false, flip = false;
  int order = 0;
  binder.read("continuous", continuous);
  binder.read("flip", flip);
  binder.read("order", order, 2, 64, "give the number of equal turns");
  if (continuous == (order > 0)) {
    problems.add(axis_at.place, axis_at.path,
                 continuous ? "'order' and 'continuous' exclude each other" : "the turns about the axis are missing",
                 "give either 'order: 4' (turns of 90 degrees) or 'continuous: true'");
    return {};
  }
  if (flip && !continuous)
    problems.add(axis_at.place, axis_at.path, "'flip' goes with 'continuous: true' only", "remove it");
  return continuous ? SymmetryGroup::continuous(axis, flip, center) : SymmetryGroup::cyclic(axis, order, center);
}

SymmetryGroup read_symmetry(const LocatedValue& value, Problems& problems) {
  if (value.kind == LocatedValue::Kind::kScalar) {
    const auto word = read_word(value, problems, {"none", "cuboid", "ball", "cube"});
    if (word == 2) return SymmetryGroup::every_rotation();
    if (word == 3) return SymmetryGroup::cube();
    return word == 1 ? SymmetryGroup::cuboid() : SymmetryGroup::none();
  }
  Binder binder(value, problems);
  Vector3d center = Vector3d::Zero();
  if (const LocatedValue* at = binder.find("center")) center = read_vector(*at, problems, kPosition);
  std::string which;
  const LocatedValue* form =
      binder.one_of({"axis", "cuboid", "cube", "ball", "rotations"},
                    "give none, cuboid, cube, ball, {axis: z, order: 4} or {axis: z, continuous: true}", false, &which);
  for (const char* key : {"continuous", "flip", "order"})
    if (which == "axis" || !form) binder.note_known(key);
  if (!form) return {};
  if (which == "axis") return read_turns(binder, *form, center);
  if (which == "cuboid" || which == "cube" || which == "ball") {
    if (!read_bool(*form, problems).value_or(true)) return SymmetryGroup::none();
    if (which == "ball") return SymmetryGroup::every_rotation(center);
    return which == "cube" ? SymmetryGroup::cube(center) : SymmetryGroup::cuboid(center);
  }
  SymmetryGroup group = read_rotations(*form, problems);
  group.p_BoC = center;
  return group;
}

// [xx, yy, zz], or three rows.
std::optional<Matrix3d> read_matrix(const LocatedValue& value, Problems& problems) {
  constexpr NumberRange kEntry{-1e6, 1e6, "give the inertia about the centre of mass"};
  const bool is_rows = value.kind == LocatedValue::Kind::kList && !value.items.empty() &&
                       value.items[0].kind == LocatedValue::Kind::kList;
  if (!is_rows) {
    const auto diagonal = read_numbers(value, problems, 3, kEntry);
    if (!diagonal) return std::nullopt;
    return Vector3d((*diagonal)[0], (*diagonal)[1], (*diagonal)[2]).asDiagonal().toDenseMatrix();
  }
  if (value.items.size() != 3) {
    report_type(value, problems, "give [xx, yy, zz] or three rows of three numbers");
    return std::nullopt;
  }
  Matrix3d matrix;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = read_numbers(value.items[i], problems, 3, kEntry);
    if (!row) return std::nullopt;
    for (std::size_t j = 0; j < 3; ++j) matrix(static_cast<int>(i), static_cast<int>(j)) = (*row)[j];
  }
  return matrix;
}

std::optional<double> volume_of(const BodyShape& shape) {
  double volume = 0.0;
  for (const belief::CollisionShape& part : shape.collision) {
    const auto solid = belief::mass_properties(part, 1.0);
    if (!solid) return std::nullopt;
    volume += solid->mass;
  }
  return volume;
}

// What a mass of that volume can't be: lighter than air, heavier than any metal.
void check_density(const LocatedValue& at, double mass, double volume, Problems& problems) {
  const double density = mass / volume;
  if (density > kDensity.high) {
    const double grams = density * 1e-3;
    problems.add(
        at.place, at.path,
        number_text(mass) + " kg in this volume of " + core::rounded_text(volume) + " m^3 is denser than any metal",
        grams > kDensity.low && grams < kDensity.high ? "grams? then write " + core::rounded_text(mass * 1e-3)
                                                      : std::string("check the mass (kg) and the sizes (m)"));
  } else if (density < kDensity.low) {
    problems.add(at.place, at.path,
                 number_text(mass) + " kg in this volume of " + core::rounded_text(volume) + " m^3 is lighter than air",
                 "check the sizes (metres, not millimetres or centimetres) and the mass (kg)");
  }
}

void read_mass(Binder& binder, const BodyShape& shape, ObjectModel& model) {
  Problems& problems = binder.problems();
  std::string which;
  const LocatedValue* at =
      binder.one_of({"mass", "density"}, "give 'mass' in kg or 'density' in kg/m^3", false, &which);
  if (!at) return;
  const std::size_t before = problems.errors().size();
  if (which == "mass") {
    model.mass = read_scalar(*at, problems, kMass, true, true);
    const std::optional<double> volume = shape.collision.empty() ? std::nullopt : volume_of(shape);
    if (problems.errors().size() == before && volume) check_density(*at, belief::mean(model.mass), *volume, problems);
    return;
  }
  const double density = read_number(*at, problems, kDensity).value_or(1000.0);
  if (shape.collision.empty()) return;
  const std::optional<double> volume = volume_of(shape);
  if (volume)
    model.mass = belief::FixedScalar{density * *volume};
  else
    problems.add(at->place, at->path, "the mesh is not closed, so it has no volume",
                 "give 'mass' instead, or close the mesh");
}

void report_moments(const LocatedValue& at, Problems& problems) {
  problems.add(
      at.place, at.path, "no body has this inertia",
      "give it about the centre of mass, symmetric, positive, no principal moment above the sum of the others");
}

void read_moments(const LocatedValue& at, double mass, Problems& problems, ObjectModel& model) {
  const std::optional<Matrix3d> matrix = read_matrix(at, problems);
  if (!matrix) return;
  model.unit_inertia = *matrix / std::max(mass, 1e-9);
  if (!geometry::MassProperties{1.0, Vector3d::Zero(), model.unit_inertia}.is_physical()) report_moments(at, problems);
}

void read_inertia(Binder& binder, const BodyShape& shape, ObjectModel& model) {
  Problems& problems = binder.problems();
  const LocatedValue* center = binder.find("center_of_mass");
  std::string which;
  const LocatedValue* inertia = binder.one_of({"unit_inertia", "inertia"}, "", true, &which);
  if (!shape.collision.empty()) {
    model.collision = shape.collision;
    if (auto derived = belief::with_derived_properties(model)) {
      model = *std::move(derived);
    } else if (!center || !inertia) {
      problems.add(shape.place->place, shape.place->path, "no solid: " + derived.status().message(),
                   "use its convex_hull, close the mesh, or give mass, center_of_mass and inertia");
    }
  }
  const std::size_t before = problems.errors().size();
  if (center) model.center_of_mass = read_vector_distribution(*center, problems, kPosition);
  if (inertia) read_moments(*inertia, which == "inertia" ? belief::mean(model.mass) : 1.0, problems, model);
  if (problems.errors().size() == before)
    check_mass_distribution({center, inertia, which != "inertia"}, model, problems);
}

// Of bodies without mass, for which nothing else asks for the hulls.
void check_hulls(const BodyShape& shape, Problems& problems) {
  for (const belief::CollisionShape& part : shape.collision) {
    const auto* mesh = std::get_if<belief::MeshShape>(&part);
    if (!mesh || (mesh->use != belief::MeshUse::kConvexHull && mesh->use != belief::MeshUse::kConvexParts)) continue;
    if (const auto solid = belief::mass_properties(part, 1.0); !solid)
      problems.add(shape.place->place, shape.place->path, "the mesh has no hull: " + solid.status().message(),
                   "give a mesh that is not flat, or 'use: surface'");
  }
}

core::Result<LocatedValue> model_document(const std::filesystem::path& path, const SceneFileOptions& options) {
  if (!options.read_file) return read_yaml(path, options.limits);
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, options.read_file(path));
  return parse_yaml(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), path.string(),
                    options.limits);
}

// The map under `model:` of the file, with the keys of the scene put over it.
std::optional<LocatedValue> merged_with_file(const LocatedValue& value, SceneContext& context) {
  const LocatedValue& file = *value.find("file");
  const std::optional<std::string> name = read_text(file, context.problems);
  if (!name) return std::nullopt;
  if (!context.options.follow_files) {
    context.problems.add(file.place, file.path, "model files can't be read here", "describe the model in place");
    return std::nullopt;
  }
  const core::Result<LocatedValue> document =
      model_document(std::filesystem::path(*file.place.file).parent_path() / *name, context.options);
  if (!document) {
    context.problems.add(file.place, file.path, "the model file can't be used", document.status().message());
    return std::nullopt;
  }
  Binder binder(*document, context.problems);
  const LocatedValue* model = binder.require("model", "a model file holds one key 'model' with the model's keys");
  if (const LocatedValue* throws = binder.find("throws")) read_model_throws(*throws, context.problems);
  if (!model) return std::nullopt;
  LocatedValue merged = *model;
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    if (value.keys[i].name == "file") continue;
    const auto same = std::find_if(merged.keys.begin(), merged.keys.end(),
                                   [&](const LocatedValue::Key& key) { return key.name == value.keys[i].name; });
    if (same == merged.keys.end()) {
      merged.keys.push_back(value.keys[i]);
      merged.items.push_back(value.items[i]);
    } else {
      const auto index = static_cast<std::size_t>(same - merged.keys.begin());
      merged.keys[index] = value.keys[i];
      merged.items[index] = value.items[i];
    }
  }
  return merged;
}

}  // namespace

void read_contact(Binder& binder, ContactProperties& contact) {
  Problems& problems = binder.problems();
  if (const LocatedValue* at = binder.find("friction"))
    contact.friction = read_scalar(*at, problems, kFriction, true, true);
  if (const LocatedValue* at = binder.find("impact_friction"))
    contact.impact_friction = read_scalar(*at, problems, kFriction, true, true);
  if (const LocatedValue* at = binder.find("restitution"))
    contact.restitution = read_scalar(*at, problems, kRestitution, true, true);
  binder.read("rolling_friction", contact.rolling_friction, kLever);
  binder.read("edge_radius", contact.edge_radius, kLever);
}

std::optional<Matrix3d> read_unit_inertia(const LocatedValue& value, Problems& problems) {
  std::optional<Matrix3d> matrix = read_matrix(value, problems);
  if (!matrix) return std::nullopt;
  if (!geometry::MassProperties{1.0, Vector3d::Zero(), *matrix}.is_physical()) report_moments(value, problems);
  return matrix;
}

belief::ObjectModel read_object_model(const LocatedValue& value, const std::string& name, SceneContext& context) {
  ObjectModel model;
  model.name = name;
  std::optional<LocatedValue> merged;
  if (value.find("file")) {
    merged = merged_with_file(value, context);
    if (!merged) return model;
  }
  Binder binder(merged ? *merged : value, context.problems);
  const BodyShape shape = read_body_shape(binder, kObjectSize, true, context);
  model.visual = shape.visual;
  if (const auto look = context.looks.find(shape.visual); look != context.looks.end()) model.look = look->second;
  model.hollow = shape.hollow;
  read_mass(binder, shape, model);
  read_inertia(binder, shape, model);
  read_contact(binder, model.contact);
  check_edges(binder, shape, model.contact);
  const LocatedValue* symmetry = binder.find("symmetry");
  if (symmetry) model.symmetry = read_symmetry(*symmetry, context.problems);
  if (const LocatedValue* at = binder.find("color")) model.color = read_color(*at, context.problems);
  static const std::vector<std::pair<std::string, belief::SurfaceKind>> kSurfaces{
      {"opaque", belief::SurfaceKind::kOpaque},
      {"transparent", belief::SurfaceKind::kTransparent},
      {"mirror", belief::SurfaceKind::kMirror}};
  binder.read_enum("surface", model.surface, kSurfaces);
  binder.read("learn_colors", model.learn_colors);
  if (!merged) binder.note_known("file");
  if (!symmetry && context.options.suggest_symmetries && context.problems.empty())
    suggest_symmetry(value, model, context.problems);
  return model;
}

belief::Support read_support(const LocatedValue& value, const std::string& name, SceneContext& context) {
  belief::Support support;
  support.name = name;
  Binder binder(value, context.problems);
  BodyShape shape = read_body_shape(binder, kSupportSize, false, context);
  check_hulls(shape, context.problems);
  if (const LocatedValue* at = binder.find("pose")) support.X_WS = read_pose(*at, context.problems);
  read_contact(binder, support.contact);
  check_edges(binder, shape, support.contact);
  support.collision = std::move(shape.collision);
  support.visual = std::move(shape.visual);
  support.hollow = shape.hollow;
  if (const LocatedValue* at = binder.find("color")) support.color = read_color(*at, context.problems);
  return support;
}

belief::KinematicBody read_kinematic_body(const LocatedValue& value, const std::string& name, SceneContext& context) {
  Problems& problems = context.problems;
  belief::KinematicBody body;
  body.name = name;
  Binder binder(value, problems);
  BodyShape shape = read_body_shape(binder, kObjectSize, true, context);
  check_hulls(shape, problems);
  read_contact(binder, body.contact);
  check_edges(binder, shape, body.contact);
  body.collision = std::move(shape.collision);
  body.visual = std::move(shape.visual);
  if (const LocatedValue* at = binder.find("color")) body.color = read_color(*at, problems);
  std::string which;
  const LocatedValue* at = binder.one_of({"pose", "timeline"}, "give 'pose', or 'timeline' if it moves", false, &which);
  if (!at) return body;
  if (which == "pose") {
    body.timeline.push_back({0.0, read_pose(*at, problems)});
    return body;
  }
  if (at->kind != LocatedValue::Kind::kList || at->items.empty()) {
    report_type(*at, problems, "give a list of at least one {time, position, rotation}");
    return body;
  }
  for (const LocatedValue& item : at->items) {
    Binder waypoint(item, problems);
    double time = 0.0;
    if (const LocatedValue* time_at = waypoint.require("time", "give seconds since the start"))
      time = read_number(*time_at, problems, kTime).value_or(0.0);
    if (!body.timeline.empty() && !(time > body.timeline.back().time))
      problems.add(item.place, item.path, "its time is not after the one before",
                   "sort the timeline and make times differ");
    body.timeline.push_back({time, read_pose_keys(waypoint)});
  }
  return body;
}

}  // namespace prescene::interfaces
