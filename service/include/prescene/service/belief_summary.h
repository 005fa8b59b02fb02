// SPDX-License-Identifier: Apache-2.0
// The belief as it is published after each step: one estimate an object, without particles.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/alternative_poses.h"
#include "prescene/belief/belief.h"
#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::service {

struct ObjectSummary {
  std::string name;
  std::string model;
  belief::TrackState state = belief::TrackState::kTracked;
  double confidence = 0.0;
  double existence = 1.0;
  geometry::Pose X_WO;                                         ///< The mean.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();  ///< As geometry::box_plus.
  geometry::Twist V_WO;
  double evidence_per_pixel = 0.0;
  double visible_share = 0.0;
  /// What is believed of its uncertain physical parameters, by how many pieces of evidence (0 = the priors), and the
  /// stamp of the last of them.
  std::vector<belief::ParameterEstimate> parameters = {};
  int lessons = 0;
  core::TimeNs learned_ns = 0;
  bool is_new = false;  ///< The scene does not name it: it was found (filter::is_unknown_object).
  /// Edges of the bounding box of a new one in its own frame, about its origin, m; zero for others.
  geometry::Vector3d size = geometry::Vector3d::Zero();
  std::vector<belief::AlternativePose> alternatives = {};  ///< Where else it may be.
  belief::MotionMode motion = belief::MotionMode::kMoving;
  std::optional<std::string> held_by = {};    ///< The hand; empty = free.
  int frames_unseen = 0, frames_refuted = 0;  ///< As ObjectBelief's; not in JSON.
};

struct BeliefSummary {
  std::uint64_t step = 0;
  core::TimeNs stamp_ns = 0;
  std::vector<ObjectSummary> objects;
  std::vector<belief::JointEstimate> joints = {};
};

BeliefSummary summary_of(const belief::Belief& belief);
/// {"step", "stamp_ns", "objects": [{"name", "model", "state", "confidence", "existence", "pose", "covariance" (36
/// numbers, row-major), "twist", "evidence_per_pixel", "visible_share", "parameters": [{"name", "mean",
/// "standard_deviation", "low", "high"}], "lessons", "learned_ns", "alternatives": [{"pose", "probability"}], "motion"
/// ("resting", "moving" or "held"), "held_by" (null: nothing), of new objects "size" ([x, y, z])}],
/// where the scene has joints "joints": [{"joint", "type", "unit", "position", "standard_deviation", "velocity",
/// "limits", "confidence"}]}
nlohmann::ordered_json to_json(const BeliefSummary& summary);
/// kInvalidInput where it is not of that form, or stamps are not between 1970 and 2116. Of what need not be there, what
/// is of another form is left out.
core::Result<BeliefSummary> belief_summary_from_json(const std::string& text);
core::Result<BeliefSummary> belief_summary_of_document(const nlohmann::ordered_json& json);

/// Messages for ROS users. Lost objects are in none of them.
interfaces::RosDetection3dArray detections_of(const BeliefSummary& summary, const belief::Scene& scene,
                                              const std::string& world_frame);
interfaces::RosPoseWithCovarianceStamped pose_of(const ObjectSummary& object, core::TimeNs stamp_ns,
                                                 const std::string& world_frame);
/// In the order of detections_of().
interfaces::RosPoseArray poses_of(const BeliefSummary& summary, const std::string& world_frame);
/// The frame prescene/OBJECT of each, from the world's.
/// Of the frames of objects: "prescene/mug".
inline constexpr const char* kFramePrefix = "prescene/";
interfaces::RosTfMessage transforms_of(const BeliefSummary& summary, const std::string& world_frame);
/// Coarse meshes of a scene's models by name, made once for markers.
using MarkerMeshes = std::map<std::string, geometry::TriangleMesh>;
MarkerMeshes marker_meshes(const belief::Scene& scene);
/// The same of models that `meshes` does not have yet, or has with other edges, as of objects that were found.
void add_marker_meshes(const belief::Scene& scene, MarkerMeshes& meshes);
/// Each object as a triangle list in its model's colour (paler when not tracked) with its name above.
interfaces::RosMarkerArray markers_of(const BeliefSummary& summary, const belief::Scene& scene,
                                      const MarkerMeshes& meshes, const std::string& world_frame);

}  // namespace prescene::service
