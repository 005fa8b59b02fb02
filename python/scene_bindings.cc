// SPDX-License-Identifier: Apache-2.0
// Scenes and what is in them, read-only.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <cmath>
#include <filesystem>
#include <optional>
#include <vector>

#include "array_output.h"
#include "bound_scene.h"
#include "interruptible.h"
#include "prescene/core/text.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/scene_report.h"
#include "status_errors.h"

namespace py = pybind11;

namespace prescene::python {
namespace {

using ScenePtr = std::shared_ptr<const belief::Scene>;

/// A part of a scene, which it keeps.
template <class Part>
struct PartOf {
  ScenePtr scene;
  const Part* part = nullptr;
  const Part& operator*() const { return *part; }
  const Part* operator->() const { return part; }
};
using BoundModel = PartOf<belief::ObjectModel>;
using BoundSupport = PartOf<belief::Support>;
using BoundBody = PartOf<belief::KinematicBody>;
using BoundObject = PartOf<belief::SceneObject>;
using BoundCamera = PartOf<belief::SceneCamera>;

template <class Part>
py::tuple parts_of(const ScenePtr& scene, const std::vector<Part>& parts) {
  py::tuple tuple(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) tuple[i] = py::cast(PartOf<Part>{scene, &parts[i]});
  return tuple;
}

struct BoundMesh {
  belief::MeshPtr mesh;
};

std::optional<BoundMesh> bound(const belief::MeshPtr& mesh) {
  return mesh ? std::optional(BoundMesh{mesh}) : std::nullopt;
}

BoundMesh collision_mesh_of(const std::vector<belief::CollisionShape>& shapes) {
  return {std::make_shared<geometry::TriangleMesh>(belief::collision_mesh(shapes))};
}

py::array vertices_array(const BoundMesh& bound) {
  const auto& vertices = bound.mesh->vertices;
  static_assert(sizeof(geometry::Vector3d) == 3 * sizeof(double));
  return view_of(py::dtype::of<double>(), {static_cast<py::ssize_t>(vertices.size()), 3},
                 {3 * sizeof(double), sizeof(double)}, vertices.data(), bound.mesh);
}

py::array faces_array(const BoundMesh& bound) {
  const auto& triangles = bound.mesh->triangles;
  return view_of(py::dtype::of<std::uint32_t>(), {static_cast<py::ssize_t>(triangles.size()), 3},
                 {3 * sizeof(std::uint32_t), sizeof(std::uint32_t)}, triangles.data(), bound.mesh);
}

/// A number that is known exactly or as a distribution.
struct UncertainNumber {
  double mean, standard_deviation, low, high;
};

UncertainNumber uncertain(const belief::ScalarDistribution& distribution) {
  return {belief::mean(distribution), std::sqrt(belief::variance(distribution)), belief::lowest(distribution),
          belief::highest(distribution)};
}

std::string text_of(const UncertainNumber& number) {
  std::string text = core::rounded_text(number.mean);
  if (number.standard_deviation > 0.0) text += " +- " + core::rounded_text(number.standard_deviation);
  return text;
}

py::tuple tuple_of(const belief::Color& color) { return py::make_tuple(color.r, color.g, color.b); }

const char* word_of(belief::SurfaceKind surface) {
  switch (surface) {
    case belief::SurfaceKind::kOpaque:
      return "opaque";
    case belief::SurfaceKind::kTransparent:
      return "transparent";
    case belief::SurfaceKind::kMirror:
      return "mirror";
  }
  return "opaque";
}

py::object named(const py::tuple& parts, const std::string& name, const std::string& kind) {
  std::string names;
  for (const py::handle& part : parts) {
    const auto of_part = part.attr("name").cast<std::string>();
    if (of_part == name) return py::reinterpret_borrow<py::object>(part);
    names += (names.empty() ? "" : ", ") + of_part;
  }
  raise(
      core::not_found("the scene has no " + kind + " '" + name + "'" + (names.empty() ? "" : ": there are " + names)));
}

/// From the file, unless there is a text.
BoundScene load(const std::filesystem::path& path, const std::optional<std::string>& text) {
  KeptLog log;
  interfaces::FileReport report;
  core::Cancellation cancellation;
  core::Result<ScenePtr> scene = interruptibly(cancellation, [&]() -> core::Result<ScenePtr> {
    if (text) return service::load_reported_scene(*text, path, log.sink(), report);
    PRESCENE_TRY(const std::string read, service::read_scene_text(path));
    return service::load_reported_scene(read, path, log.sink(), report);
  });
  log.hand_over();
  if (!scene) raise(scene.status(), report);
  return {*std::move(scene)};
}

void bind_values(py::module_& module) {
  py::class_<UncertainNumber>(module, "Uncertain")
      .def_readonly("mean", &UncertainNumber::mean)
      .def_readonly("standard_deviation", &UncertainNumber::standard_deviation)
      .def_readonly("low", &UncertainNumber::low)
      .def_readonly("high", &UncertainNumber::high)
      .def("__float__", [](const UncertainNumber& number) { return number.mean; })
      .def("__repr__", [](const UncertainNumber& number) { return "<Uncertain " + text_of(number) + ">"; });

  py::class_<BoundMesh>(module, "SceneMesh")
      .def_property_readonly("vertices", &vertices_array)
      .def_property_readonly("faces", &faces_array)
      .def("__repr__", [](const BoundMesh& bound) {
        return "<SceneMesh of " + std::to_string(bound.mesh->triangles.size()) + " triangles>";
      });
}

void bind_model(py::module_& module) {
  py::class_<BoundModel>(module, "Model")
      .def_property_readonly("name", [](const BoundModel& model) { return python_text(model->name); })
      .def_property_readonly("mass", [](const BoundModel& model) { return uncertain(model->mass); })
      .def_property_readonly("friction", [](const BoundModel& model) { return uncertain(model->contact.friction); })
      .def_property_readonly("impact_friction",
                             [](const BoundModel& model) {
                               return uncertain(model->contact.impact_friction.value_or(model->contact.friction));
                             })
      .def_property_readonly("restitution",
                             [](const BoundModel& model) { return uncertain(model->contact.restitution); })
      .def_property_readonly("rolling_friction",
                             [](const BoundModel& model) { return model->contact.rolling_friction; })
      .def_property_readonly("edge_radius", [](const BoundModel& model) { return model->contact.edge_radius; })
      .def_property_readonly("center_of_mass",
                             [](const BoundModel& model) { return vector_copy(belief::mean(model->center_of_mass)); })
      .def_property_readonly("unit_inertia", [](const BoundModel& model) { return copy_of(model->unit_inertia); })
      .def_property_readonly("color", [](const BoundModel& model) { return tuple_of(model->color); })
      .def_property_readonly("surface", [](const BoundModel& model) { return word_of(model->surface); })
      .def_property_readonly("visual", [](const BoundModel& model) { return bound(model->visual); })
      .def("collision_mesh", [](const BoundModel& model) { return collision_mesh_of(model->collision); })
      .def("__repr__", [](const BoundModel& model) {
        return python_text("<Model '" + model->name + "', " + text_of(uncertain(model->mass)) + " kg>");
      });
}

void bind_fixed_things(py::module_& module) {
  py::class_<BoundSupport>(module, "Support")
      .def_property_readonly("name", [](const BoundSupport& support) { return python_text(support->name); })
      .def_property_readonly("X_WS", [](const BoundSupport& support) { return matrix_of(support->X_WS); })
      .def_property_readonly("friction",
                             [](const BoundSupport& support) { return uncertain(support->contact.friction); })
      .def_property_readonly("restitution",
                             [](const BoundSupport& support) { return uncertain(support->contact.restitution); })
      .def_property_readonly("color", [](const BoundSupport& support) { return tuple_of(support->color); })
      .def_property_readonly("visual", [](const BoundSupport& support) { return bound(support->visual); })
      .def("collision_mesh", [](const BoundSupport& support) { return collision_mesh_of(support->collision); })
      .def("__repr__", [](const BoundSupport& support) { return python_text("<Support '" + support->name + "'>"); });

  py::class_<BoundBody>(module, "RobotBody")
      .def_property_readonly("name", [](const BoundBody& body) { return python_text(body->name); })
      .def_property_readonly("times",
                             [](const BoundBody& body) {
                               Eigen::VectorXd times(static_cast<Eigen::Index>(body->timeline.size()));
                               for (std::size_t i = 0; i < body->timeline.size(); ++i)
                                 times[static_cast<Eigen::Index>(i)] = body->timeline[i].time;
                               return vector_copy(times);
                             })
      .def_property_readonly("X_WG",
                             [](const BoundBody& body) {
                               std::vector<geometry::Pose> poses;
                               for (const auto& waypoint : body->timeline) poses.push_back(waypoint.X_WG);
                               return matrices_of(poses);
                             })
      .def("collision_mesh", [](const BoundBody& body) { return collision_mesh_of(body->collision); })
      .def_property_readonly("color", [](const BoundBody& body) { return tuple_of(body->color); })
      .def_property_readonly("visual", [](const BoundBody& body) { return bound(body->visual); })
      .def("__repr__", [](const BoundBody& body) { return python_text("<RobotBody '" + body->name + "'>"); });

  py::class_<BoundCamera>(module, "Camera")
      .def_property_readonly("name", [](const BoundCamera& camera) { return python_text(camera->name); })
      .def_property_readonly("width", [](const BoundCamera& camera) { return camera->intrinsics.width; })
      .def_property_readonly("height", [](const BoundCamera& camera) { return camera->intrinsics.height; })
      .def_property_readonly("K",
                             [](const BoundCamera& camera) {
                               const geometry::PinholeCamera& c = camera->intrinsics;
                               Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
                               matrix(0, 0) = c.fx;
                               matrix(1, 1) = c.fy;
                               matrix(0, 2) = c.cx;
                               matrix(1, 2) = c.cy;
                               return copy_of(matrix);
                             })
      .def_property_readonly("X_WC", [](const BoundCamera& camera) { return matrix_of(camera->X_WC); })
      .def_property_readonly("is_placed", [](const BoundCamera& camera) { return camera->is_placed; })
      .def("__repr__", [](const BoundCamera& camera) { return python_text("<Camera '" + camera->name + "'>"); });
}

void bind_object(py::module_& module) {
  py::class_<BoundObject>(module, "SceneObject")
      .def_property_readonly("name", [](const BoundObject& object) { return python_text(object->name); })
      .def_property_readonly("model",
                             [](const BoundObject& object) {
                               return BoundModel{object.scene, &object.scene->model_of(*object)};
                             })
      .def_property_readonly("X_WO", [](const BoundObject& object) { return matrix_of(belief::mean(object->pose)); })
      .def_property_readonly("covariance",
                             [](const BoundObject& object) { return copy_of(belief::covariance(object->pose)); })
      .def_property_readonly("twist", [](const BoundObject& object) { return numbers_of(belief::mean(object->twist)); })
      .def_property_readonly("held_by",
                             [](const BoundObject& object) -> std::optional<std::string> { return object->held_by; })
      .def("__repr__", [](const BoundObject& object) { return python_text("<SceneObject '" + object->name + "'>"); });
}

}  // namespace

std::shared_ptr<Engine> Engines::get(int threads, service::Stepper stepper) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Engine>& engine = engines_[{threads, stepper}];
  if (!engine) {
    service::BackendSettings settings;
    settings.stepper = stepper;
    engine = std::make_shared<Engine>(threads, settings);
  }
  return engine;
}

service::Stepper stepper_named(const std::string& name) {
  if (name == "automatic") return service::Stepper::kAutomatic;
  if (name == "bullet") return service::Stepper::kBullet;
  if (name == "lockstep") return service::Stepper::kLockstep;
  raise_input("stepper: '" + name + "' is none: give automatic, bullet or lockstep");
}

void check_threads(int threads) {
  if (threads < 0 || threads > 1024)
    raise_input("threads: " + std::to_string(threads) +
                " is out of range: give 1 to 1024, or 0 for all of the machine");
}

void bind_scenes(py::module_& module) {
  bind_values(module);
  bind_model(module);
  bind_fixed_things(module);
  bind_object(module);
  py::class_<BoundScene>(module, "Scene")
      .def_static(
          "from_file", [](const std::filesystem::path& path) { return load(path, std::nullopt); }, py::arg("path"))
      .def_static(
          "from_yaml", [](const std::string& text, const std::filesystem::path& path) { return load(path, text); },
          py::arg("text"), py::arg("path") = "scene.yaml")
      .def_property_readonly("name", [](const BoundScene& bound) { return python_text(bound.scene->name); })
      .def_property_readonly("models",
                             [](const BoundScene& bound) { return parts_of(bound.scene, bound.scene->models); })
      .def_property_readonly("supports",
                             [](const BoundScene& bound) { return parts_of(bound.scene, bound.scene->supports); })
      .def_property_readonly("robot", [](const BoundScene& bound) { return parts_of(bound.scene, bound.scene->robot); })
      .def_property_readonly("objects",
                             [](const BoundScene& bound) { return parts_of(bound.scene, bound.scene->objects); })
      .def_property_readonly("camera",
                             [](const BoundScene& bound) -> std::optional<BoundCamera> {
                               if (!bound.scene->camera) return std::nullopt;
                               return BoundCamera{bound.scene, &*bound.scene->camera};
                             })
      .def_property_readonly("cameras",
                             [](const BoundScene& bound) {
                               py::list cameras;
                               for (int i = 0; i < belief::camera_count(*bound.scene); ++i)
                                 if (const belief::SceneCamera* camera = belief::camera_at(*bound.scene, i))
                                   cameras.append(BoundCamera{bound.scene, camera});
                               return py::tuple(cameras);
                             })
      .def_property_readonly("gravity_W", [](const BoundScene& bound) { return vector_copy(bound.scene->gravity_W); })
      .def_property_readonly("duration", [](const BoundScene& bound) { return bound.scene->duration; })
      .def_property_readonly("step", [](const BoundScene& bound) { return bound.scene->step; })
      .def(
          "object",
          [](const BoundScene& bound, const std::string& name) {
            return named(parts_of(bound.scene, bound.scene->objects), name, "object");
          },
          py::arg("name"))
      .def(
          "support",
          [](const BoundScene& bound, const std::string& name) {
            return named(parts_of(bound.scene, bound.scene->supports), name, "support");
          },
          py::arg("name"))
      .def("__repr__", [](const BoundScene& bound) {
        return python_text("<Scene '" + bound.scene->name + "' of " + std::to_string(bound.scene->objects.size()) +
                           " objects>");
      });
}

}  // namespace prescene::python
