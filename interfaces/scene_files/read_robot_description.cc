// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/mesh_use.h"
#include "prescene/interfaces/scene_files/robot_description.h"
#include "read_scene_parts.h"
#include "urdf.h"

namespace prescene::interfaces {
namespace {

using belief::KinematicBody;
using belief::MeshPtr;
using geometry::Vector3d;

// Of all links; drawing more takes longer than tracking does.
constexpr std::size_t kManyTriangles = 500'000;

constexpr NumberRange kJointPosition{-1000.0, 1000.0, "give radians or metres, as sensor_msgs/JointState has them"};

/// Keys that shape the links' bodies, and have nothing to do with how they hang together.
constexpr const char* kBodyKeys[] = {
    "packages",    "without",         "draw", "use", "edge_radius", "friction", "impact_friction",
    "restitution", "rolling_friction"};

void read_start_positions(const LocatedValue& value, Problems& problems, RobotKinematics& robot) {
  if (value.kind != LocatedValue::Kind::kMap) {
    report_type(value, problems, "give a map from joints to positions (rad, m)");
    return;
  }
  std::vector<std::string> moving;
  for (const RobotJoint& joint : robot.joints)
    if (joint.is_moving()) moving.push_back(joint.name);
  for (std::size_t i = 0; i < value.keys.size(); ++i) {
    const std::string& name = value.keys[i].name;
    const LocatedValue& at = value.items[i];
    const std::optional<double> q = read_number(at, problems, kJointPosition);
    const RobotJoint* joint = robot.find_joint(name);
    if (joint == nullptr || !joint->is_moving()) {
      problems.add(at.place, at.path, "no joint of this name moves", suggestion(name, moving));
    } else if (q && joint->lower && joint->upper && (*q < *joint->lower || *q > *joint->upper)) {
      problems.add(
          at.place, at.path, number_text(*q) + " is beyond the joint's limits",
          "give " + number_text(*joint->lower) + " to " + number_text(*joint->upper) + " (rad or m, not degrees)");
    } else if (q) {
      robot.positions[name] = *q;
    }
  }
}

/// The file that `file` names, read; nothing when that was reported. `path` gets where it is.
std::optional<UrdfRobot> read_urdf(Binder& binder, const SceneFileOptions& options, std::filesystem::path& path) {
  Problems& problems = binder.problems();
  const LocatedValue* file = binder.require("file", "give the path of a URDF file");
  const LocatedValue* pose = binder.find("pose");
  const LocatedValue* positions = binder.find("joint_positions");
  const std::optional<std::string> name = file ? read_text(*file, problems) : std::nullopt;
  if (!name) return std::nullopt;
  if (!options.follow_files) {
    problems.add(file->place, file->path, "other files can't be read here", "describe the robot under 'robot'");
    return std::nullopt;
  }
  path = (std::filesystem::path(*file->place.file).parent_path() / *name).lexically_normal();
  const auto bytes =
      options.read_file ? options.read_file(path) : interfaces::read_file(path, options.limits.max_bytes);
  if (!bytes) {
    problems.add(file->place, file->path, "the URDF file can't be used", bytes.status().message());
    return std::nullopt;
  }
  auto robot = parse_urdf(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), path.string(),
                          problems);
  if (!robot) return std::nullopt;
  if (pose) robot->kinematics.X_WR = read_pose(*pose, problems);
  if (positions) read_start_positions(*positions, problems, robot->kinematics);
  return robot;
}

/// Makes bodies of links.
class LinkBodies {
 public:
  LinkBodies(Binder& binder, std::filesystem::path urdf, SceneContext& context)
      : context_(context), problems_(context.problems), urdf_(std::move(urdf)), at_(binder.value()) {
    if (const LocatedValue* packages = binder.find("packages")) read_packages(*packages);
    if (const LocatedValue* draw = binder.find("draw"))
      draws_collision_ = read_word(*draw, problems_, {"visual", "collision"}) == 1;
    binder.read_enum("use", use_, mesh_uses());
    if (use_ == belief::MeshUse::kSurface) {
      problems_.add(binder.find("use")->place, binder.find("use")->path, "a surface of triangles can't move",
                    "use spheres, convex_hull, convex_parts or decompose");
      use_ = belief::MeshUse::kConvexHull;
    }
    read_contact(binder, contact_);
  }

  /// Nothing for a link without shapes, and for one that was reported.
  std::optional<KinematicBody> body_of(const UrdfLink& link) {
    const std::vector<UrdfShape>& felt = link.collisions.empty() ? link.visuals : link.collisions;
    const std::vector<UrdfShape>& seen = link.visuals.empty() || draws_collision_ ? felt : link.visuals;
    if (felt.empty()) return std::nullopt;
    const std::string key = "link " + quote(link.name);
    if (const core::Status named = belief::check_name(link.name); !named.ok()) {
      problems_.add(link.place, key, named.message(), "rename the link, or name it under robot_description.without");
      return std::nullopt;
    }
    const std::size_t before = problems_.errors().size();
    KinematicBody body;
    body.name = link.name;
    body.contact = contact_;
    body.color = link.color.value_or(belief::Color());
    body.collision = shapes_of(felt, key + ".collision", true);
    const auto drawn = shapes_of(seen, key + ".visual", false);
    if (problems_.errors().size() > before) return std::nullopt;
    body.visual = std::make_shared<const geometry::TriangleMesh>(belief::collision_mesh(drawn));
    triangles_ += body.visual->triangles.size();
    return body;
  }

  void finish() {
    if (triangles_ > kManyTriangles)
      problems_.warn(
          at_.place, at_.path,
          "the robot's links have " + std::to_string(triangles_) + " triangles, which are drawn for every frame",
          "write 'draw: collision', or name links that the camera never sees under 'without'");
  }

 private:
  void read_packages(const LocatedValue& packages) {
    if (packages.kind != LocatedValue::Kind::kMap) {
      report_type(packages, problems_, "give a map from ROS packages to folders");
      return;
    }
    for (std::size_t i = 0; i < packages.keys.size(); ++i)
      if (const auto folder = read_text(packages.items[i], problems_))
        packages_[packages.keys[i].name] =
            (std::filesystem::path(*packages.place.file).parent_path() / *folder).lexically_normal();
  }

  /// Where a mesh is that a URDF names.
  std::optional<std::filesystem::path> mesh_path(const UrdfShape& shape, const std::string& key) {
    std::string_view name = shape.mesh;
    if (name.starts_with("file://")) return std::filesystem::path(name.substr(7));
    for (const std::string_view scheme : {"package://", "model://"}) {
      if (!name.starts_with(scheme)) continue;
      name.remove_prefix(scheme.size());
      const std::string package(name.substr(0, name.find('/')));
      name.remove_prefix(std::min(name.size(), package.size() + 1));
      const auto known = packages_.find(package);
      if (known != packages_.end()) return (known->second / name).lexically_normal();
      for (std::filesystem::path folder = urdf_.parent_path(); !folder.empty(); folder = folder.parent_path()) {
        if (folder.filename() == package) return (folder / name).lexically_normal();
        if (folder == folder.parent_path()) break;
      }
      problems_.add(shape.place, key, "it is not known where the ROS package " + quote(package) + " is",
                    "write under robot_description 'packages: {" + package + ": FOLDER}'; `ros2 pkg prefix --share " +
                        package + "` says where");
      return std::nullopt;
    }
    if (name.find("://") != std::string_view::npos) {
      problems_.add(shape.place, key, quote(shape.mesh) + " can't be read", "give package://, file:// or a path");
      return std::nullopt;
    }
    return (urdf_.parent_path() / name).lexically_normal();
  }

  MeshPtr mesh_of(const UrdfShape& shape, const std::string& key) {
    const auto path = mesh_path(shape, key);
    if (!path) return nullptr;
    const double unit = std::abs(shape.scale.x());
    MeshPtr& mesh = meshes_[{path->string(), shape.scale.x(), shape.scale.y(), shape.scale.z()}];
    if (mesh) return mesh;
    auto read = context_.options.read_mesh
                    ? context_.options.read_mesh({*path, unit, false, true})
                    : core::Result<geometry::TriangleMesh>(core::unsupported("meshes can't be read here"));
    if (read && read->empty()) read = core::invalid_input("the mesh has no triangles: give one with a surface");
    if (!read) {
      problems_.add(shape.place, key, "the mesh can't be used", read.status().message());
      return nullptr;
    }
    geometry::TriangleMesh scaled = *std::move(read);
    const Vector3d stretch = shape.scale / unit;
    if (stretch != Vector3d::Ones())
      for (auto& vertex : scaled.vertices) vertex = vertex.cwiseProduct(stretch);
    if (stretch.prod() < 0.0)  // mirrored: what was outside would be inside
      for (auto& triangle : scaled.triangles) std::swap(triangle[1], triangle[2]);
    if (const double extent = geometry::bounding_box(scaled).sizes().maxCoeff(); extent > kObjectSize.high) {
      problems_.add(shape.place, key, "the mesh is " + core::rounded_text(extent) + " m large",
                    "it is probably in millimetres: give scale=\"0.001 0.001 0.001\"");
      return nullptr;
    }
    mesh = std::make_shared<const geometry::TriangleMesh>(std::move(scaled));
    return mesh;
  }

  std::vector<belief::CollisionShape> shapes_of(const std::vector<UrdfShape>& shapes, const std::string& key,
                                                bool felt) {
    std::vector<belief::CollisionShape> result;
    for (const UrdfShape& shape : shapes) {
      if (shape.primitive) {
        result.emplace_back(belief::PrimitiveShape{*shape.primitive, shape.X_LS});
        continue;
      }
      const MeshPtr mesh = mesh_of(shape, key);
      if (!mesh) continue;
      const belief::MeshShape solid{mesh, shape.X_LS, use_};
      if (const auto massive = felt ? belief::mass_properties(solid, 1.0) : geometry::MassProperties{}; !massive) {
        problems_.add(shape.place, key, "the mesh is no solid: " + massive.status().message(),
                      "give a <collision> of simple shapes, or name the link under robot_description.without");
        continue;
      }
      result.emplace_back(solid);
    }
    return result;
  }

  SceneContext& context_;
  Problems& problems_;
  std::filesystem::path urdf_;
  const LocatedValue& at_;
  std::map<std::string, std::filesystem::path> packages_;
  std::map<std::tuple<std::string, double, double, double>, MeshPtr> meshes_;
  belief::MeshUse use_ = belief::MeshUse::kConvexHull;
  belief::ContactProperties contact_;
  bool draws_collision_ = false;
  std::size_t triangles_ = 0;
};

/// Links that get no body.
std::set<std::string> read_without(Binder& binder, const std::vector<UrdfLink>& links) {
  std::set<std::string> without;
  const LocatedValue* at = binder.find("without");
  if (!at) return without;
  if (at->kind != LocatedValue::Kind::kList) {
    report_type(*at, binder.problems(), "give a list of links");
    return without;
  }
  std::vector<std::string> names;
  for (const UrdfLink& link : links) names.push_back(link.name);
  for (const LocatedValue& item : at->items) {
    const auto name = read_text(item, binder.problems());
    if (!name) continue;
    if (std::find(names.begin(), names.end(), *name) == names.end())
      binder.problems().add(item.place, item.path, "the robot has no link " + quote(*name), suggestion(*name, names));
    without.insert(*name);
  }
  return without;
}

}  // namespace

std::vector<KinematicBody> read_robot_description(const LocatedValue& value, SceneContext& context) {
  Problems& problems = context.problems;
  std::vector<KinematicBody> bodies;
  Binder binder(value, problems);
  std::filesystem::path path;
  const std::optional<UrdfRobot> robot = read_urdf(binder, context.options, path);
  for (const char* key : kBodyKeys) binder.note_known(key);
  if (!robot) return bodies;
  const std::set<std::string> without = read_without(binder, robot->links);
  const std::vector<std::string> taken = context.all_things();
  const std::map<std::string, geometry::Pose> X_RL = link_poses(robot->kinematics, {});
  const geometry::Pose X_WR = robot->kinematics.X_WR.value_or(geometry::Pose());
  LinkBodies reader(binder, path, context);
  for (const UrdfLink& link : robot->links) {
    if (without.contains(link.name)) continue;
    std::optional<KinematicBody> body = reader.body_of(link);
    if (!body) continue;
    if (std::find(taken.begin(), taken.end(), link.name) != taken.end()) {
      problems.add(value.place, value.path, "the name of the robot's link " + quote(link.name) + " is taken",
                   "rename the other thing, or leave the link out: without: [" + link.name + "]");
      continue;
    }
    body->timeline.push_back({0.0, geometry::normalized(X_WR * X_RL.at(link.name))});
    context.robot.push_back(link.name);
    bodies.push_back(*std::move(body));
  }
  reader.finish();
  return bodies;
}

core::Result<std::shared_ptr<const RobotKinematics>> parse_robot_kinematics(std::string_view text,
                                                                            const std::string& file,
                                                                            const SceneFileOptions& options) {
  PRESCENE_TRY(const LocatedValue document, parse_yaml(text, file, options.limits));
  const LocatedValue* value = document.find("robot_description");
  if (value == nullptr) return std::shared_ptr<const RobotKinematics>();
  Problems problems;
  std::optional<UrdfRobot> robot;
  {
    Binder binder(*value, problems);
    std::filesystem::path path;
    robot = read_urdf(binder, options, path);
    for (const char* key : kBodyKeys) binder.note_known(key);
  }
  if (!problems.empty()) return problems.status();
  return std::shared_ptr<const RobotKinematics>(std::make_shared<RobotKinematics>(std::move(robot->kinematics)));
}

}  // namespace prescene::interfaces
