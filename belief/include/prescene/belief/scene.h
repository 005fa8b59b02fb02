// SPDX-License-Identifier: Apache-2.0
// A scene: what is fixed, what may move, who acts, and what is asked about it. The context C of the estimation problem.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/action.h"
#include "prescene/belief/joint.h"
#include "prescene/belief/object_model.h"
#include "prescene/belief/outcome.h"
#include "prescene/belief/world_state.h"
#include "prescene/geometry/camera.h"

namespace prescene::belief {

/// A fixed thing that supports or bounds: table, bin, floor.
struct Support {
  std::string name;
  std::vector<CollisionShape> collision;
  MeshPtr visual;
  Pose X_WS;
  ContactProperties contact;
  Color color;
  std::optional<Hollow> hollow;  ///< Of containers, in S.
  friend bool operator==(const Support& a, const Support& b);
};

/// A kinematic body that follows a timeline of poses: fingers, hands, robot links. Seen and felt, never moved by
/// contacts.
struct KinematicBody {
  std::string name;
  std::vector<CollisionShape> collision;
  MeshPtr visual;
  ContactProperties contact;
  Color color;
  /// Poses over time, at least one, times ascending; held before the first and after the last. One entry = fixed.
  struct Waypoint {
    double time;  ///< s since the scene's start
    Pose X_WG;
    friend bool operator==(const Waypoint&, const Waypoint&) = default;
  };
  std::vector<Waypoint> timeline;
  friend bool operator==(const KinematicBody& a, const KinematicBody& b);
};
/// X_WG at a time (s since the scene's start), interpolated. A body without a timeline is at the world's origin.
Pose pose_at(const KinematicBody& body, double time);

/// An object of the scene: which model, and what is known of its start.
struct SceneObject {
  std::string name;
  int model = 0;  ///< Index into Scene::models.
  PoseDistribution pose = FixedPose{};
  TwistDistribution twist;
  /// Held by this kinematic body at the start (it moves rigidly with it until released); empty = free.
  std::optional<std::string> held_by;
  friend bool operator==(const SceneObject&, const SceneObject&) = default;
};

/// The depth camera's noise where it was measured; what is empty is the sensor model's default
/// (docs/reference/sensor_model.md).
struct DepthNoiseSettings {
  std::optional<double> sigma_per_depth_squared;           ///< 1/m, > 0 and at most 1: sigma = s d^2, seen frontally.
  std::optional<double> incidence_knee;                    ///< Cosine, [0, 1), below which sigma grows.
  std::optional<std::array<double, 3>> incidence_missing;  ///< Shares, [0, 1), at cosines up to 0.2, 0.4, 0.6.
  std::optional<std::array<double, 4>> outline_missing;    ///< The same up to 1.5, 3, 6, 12 pixels from the outline.
  friend bool operator==(const DepthNoiseSettings&, const DepthNoiseSettings&) = default;
};

/// Under which names a camera's images come, and in which form.
struct CameraTopics {
  std::string depth;              ///< Registered to colour.
  std::string color;              ///< Empty = none.
  std::string camera_info;        ///< Of the registered images.
  std::string depth_form;         ///< "image", "compressed", "points", or "" = as the topic's name says.
  std::string color_form;         ///< "image", "compressed" or "".
  std::optional<bool> rectified;  ///< The images are; empty = as the depth topic's name says.
  friend bool operator==(const CameraTopics&, const CameraTopics&) = default;
};

/// A camera of the scene.
struct SceneCamera {
  std::string name = "camera";
  geometry::PinholeCamera intrinsics;
  Pose X_WC;
  bool is_placed = false;  ///< The scene says where it is; else X_WC is the identity.
  std::string frame;       ///< Its frame in tf; empty = the one that its depth images name.
  /// Of a camera that the scene lists under `cameras`; empty: they are given elsewhere.
  std::optional<CameraTopics> topics;
  DepthNoiseSettings depth_noise;  ///< What is empty is Scene::depth_noise.
  friend bool operator==(const SceneCamera&, const SceneCamera&) = default;
};

struct Scene {
  std::string name;
  std::vector<ObjectModel> models;
  std::vector<Support> supports;
  std::vector<KinematicBody> robot;
  std::vector<SceneObject> objects;
  std::vector<Joint> joints;
  std::optional<SceneCamera> camera;      ///< The first, which pictures and what is asked of views are of.
  std::vector<SceneCamera> more_cameras;  ///< Others that see the same scene; empty without a first.
  DepthNoiseSettings depth_noise;
  /// A tracker also looks for things that the scene does not name.
  bool new_objects = false;
  Vector3d gravity_W = Vector3d(0.0, 0.0, -9.81);  ///< m/s^2
  std::vector<Action> actions;
  double duration = 5.0;  ///< Longest simulated time, s.
  /// Of the simulation, s; empty = by the size of the smallest object (prescene/simulation/similarity.h).
  std::optional<double> step;
  bool stop_at_rest = true;  ///< Else instances run for the whole duration.
  std::vector<Outcome> outcomes;
  std::vector<ExclusiveOutcomes> exclusive_outcomes;

  const ObjectModel& model_of(const SceneObject& object) const {
    return models[static_cast<std::size_t>(object.model)];
  }
  friend bool operator==(const Scene&, const Scene&) = default;
};

/// So many may see one scene.
inline constexpr std::size_t kMostCameras = 16;
/// How many cameras see the scene; at least 1, as there is one that the scene does not describe.
int camera_count(const Scene& scene);
/// The camera of that number, the first of which is 0; null where the scene does not describe it.
const SceneCamera* camera_at(const Scene& scene, int number);
/// What is known of its depth noise, with that of the scene where it has none of its own.
DepthNoiseSettings depth_noise_of(const Scene& scene, int camera);

/// Index of the object, support or robot body of that name.
std::optional<int> find_object(const Scene& scene, const std::string& name);
std::optional<int> find_support(const Scene& scene, const std::string& name);
std::optional<int> find_robot_body(const Scene& scene, const std::string& name);

/// Names unique, indices and names in actions and outcomes resolve, times ordered, every model valid.
core::Status validate(const Scene& scene);
/// One outcome: its names resolve in the scene and its values make sense.
core::Status validate(const Scene& scene, const Outcome& outcome);

/// How many uniform numbers one start of the scene takes (poses, twists, physical parameters). What is random in
/// actions is drawn by whoever executes them.
int start_dimensions(const Scene& scene);
/// One start from a point of the unit cube (uniforms.size() == start_dimensions(scene)); the order of coordinates puts
/// the widest uncertainties first (poses, that of the most uncertain object first, velocities, then friction,
/// restitution, mass, centre of mass, joints), as Sobol nets prefer. Held objects are kHeld, all others kMoving. Poses
/// of jointed objects are drawn as any other: a simulator moves them to where their joint allows (obey_joints()).
WorldState draw_start(const Scene& scene, std::span<const double> uniforms);
/// The start with every distribution at its mean.
WorldState mean_start(const Scene& scene);

}  // namespace prescene::belief
