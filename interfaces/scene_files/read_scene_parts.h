// SPDX-License-Identifier: Apache-2.0
// The parts of a scene file, each read by one function. All share a context; each reports what is wrong and returns
// something harmless then.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "read_values.h"

namespace prescene::interfaces {

struct SceneContext {
  Problems& problems;
  const SceneFileOptions& options;
  belief::Scene& scene;
  /// Names that may be referred to, in the order of the file; known before anything is read.
  std::vector<std::string> models, objects, supports, robot;
  /// Meshes read so far, so that two models of one file share it.
  std::map<std::tuple<std::string, double, bool>, belief::MeshPtr> meshes;
  std::map<belief::MeshPtr, geometry::LookPtr> looks = {};  ///< Of those that have colours.

  /// Objects (by their number) whose poses were given in the camera's frame, and where; read before the camera is.
  std::vector<std::pair<std::size_t, const LocatedValue*>> in_camera = {};

  /// Reads a name and looks it up; `what` is what it should be ("a model").
  std::string read_name(const LocatedValue& value, const std::vector<std::string>& names, const std::string& what);
  std::vector<std::string> all_things() const;
};

/// Of a file that could not be read: what was collected, or else the status.
FileReport unread_report(const std::string& file, const core::Status& status, const Problems& problems);

belief::ObjectModel read_object_model(const LocatedValue& value, const std::string& name, SceneContext& context);
ModelThrows read_model_throws(const LocatedValue& value, Problems& problems);
/// [xx, yy, zz] or three rows, about the centre of mass of a body of 1 kg.
std::optional<geometry::Matrix3d> read_unit_inertia(const LocatedValue& value, Problems& problems);
belief::Support read_support(const LocatedValue& value, const std::string& name, SceneContext& context);
belief::KinematicBody read_kinematic_body(const LocatedValue& value, const std::string& name, SceneContext& context);
/// The bodies of a robot that a URDF file describes, with their names put into context.robot.
std::vector<belief::KinematicBody> read_robot_description(const LocatedValue& value, SceneContext& context);
void read_contact(Binder& binder, belief::ContactProperties& contact);
belief::SceneObject read_object(const LocatedValue& value, const std::string& name, SceneContext& context);
/// After the objects and supports, with all poses in the world.
belief::Joint read_joint(const LocatedValue& value, const std::string& name, SceneContext& context);
belief::SceneCamera read_camera(const LocatedValue& value, SceneContext& context);
/// Into the scene, the first as its camera.
void read_cameras(const LocatedValue& value, SceneContext& context);
belief::DepthNoiseSettings read_depth_noise(const LocatedValue& value, Problems& problems);
std::vector<belief::Action> read_actions(const LocatedValue& value, SceneContext& context);
belief::Outcome read_outcome(const LocatedValue& value, const std::string& name, const std::string& default_object,
                             SceneContext& context);
belief::ExclusiveOutcomes read_exclusive(const LocatedValue& value, const std::string& name, SceneContext& context);

/// Reports objects whose mean start lies wholly inside one solid of a support, or outside of the world. The scene is
/// valid.
void refuse_starts(const LocatedValue& document, const belief::Scene& scene, Problems& problems);
/// Reports children that start where their joint does not allow them to be, and warns of starts that spread across it.
/// The scene is valid.
void refuse_starts_off_joints(const LocatedValue& document, const belief::Scene& scene, Problems& problems);
/// What the contract of belief refuses: of its message the part behind the last ": " is the remedy.
void add_invalid(const FilePlace& place, std::string_view key, const core::Status& invalid, Problems& problems);
/// The same at the line of the thing that the message begins with, as in "robot body 'hook': ...".
void add_invalid_scene(const LocatedValue& document, const belief::Scene& scene, const core::Status& invalid,
                       Problems& problems);
/// Where a model's file says how its mass is spread; null: nowhere.
struct MassPlaces {
  const LocatedValue* center = nullptr;
  const LocatedValue* inertia = nullptr;
  bool is_unit = true;  ///< The inertia is that of 1 kg.
};
/// Reports what no body of that shape and mean mass has, and warns of what hardly any has.
void check_mass_distribution(const MassPlaces& at, const belief::ObjectModel& model, Problems& problems);
/// Remarks on a model without colours of its own, described at `value` without `symmetry`, that looks the same when it
/// is turned.
void suggest_symmetry(const LocatedValue& value, const belief::ObjectModel& model, Problems& problems);
/// Warns of a scene that is valid and yet odd.
void warn_of_oddities(const LocatedValue& document, const belief::Scene& scene, Problems& problems);

/// Shapes of a body and what comes with them.
struct BodyShape {
  std::vector<belief::CollisionShape> collision;
  belief::MeshPtr visual;  ///< Null: made from the collision shapes.
  std::optional<belief::Hollow> hollow;
  const LocatedValue* place = nullptr;  ///< Of the shape, for messages about it.
};
/// Reads the shape keys (box, sphere, ..., parts, visual, hollow) of a body's map. `size` bounds its edges.
BodyShape read_body_shape(Binder& binder, const NumberRange& size, bool may_move, SceneContext& context);

}  // namespace prescene::interfaces
