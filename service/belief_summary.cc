// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/belief_summary.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "prescene/belief/json.h"
#include "prescene/filter/operators/unknown_objects.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

// RViz draws each frame anew: enough triangles to know the object by.
constexpr int kMarkerTriangles = 300;

// Half of what fits, the year 2116, as of recordings (kLatestRecordedNs): differences of stamps do not overflow.
constexpr core::TimeNs kLatestStampNs = std::numeric_limits<core::TimeNs>::max() / 2;

constexpr belief::TrackState kStates[] = {belief::TrackState::kTracked, belief::TrackState::kDoubtful,
                                          belief::TrackState::kUnseen, belief::TrackState::kLost};

const belief::ObjectModel* model_of(const belief::Scene& scene, const std::string& name) {
  const auto found = std::find_if(scene.models.begin(), scene.models.end(),
                                  [&](const belief::ObjectModel& model) { return model.name == name; });
  return found == scene.models.end() ? nullptr : &*found;
}

geometry::TriangleMesh mesh_of(const belief::ObjectModel& model) {
  return model.visual ? *model.visual : belief::collision_mesh(model);
}

geometry::Box box_of(const belief::ObjectModel& model) {
  return model.visual ? geometry::facts_of(model.visual).box : geometry::bounding_box(belief::collision_mesh(model));
}

interfaces::RosHeader header_of(core::TimeNs stamp_ns, const std::string& frame) {
  return {interfaces::to_ros_time(stamp_ns), frame};
}

double number_or(const ordered_json& object, const char* key, double otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : otherwise;
}

geometry::Vector3d vector_or_zero(const ordered_json& object, const char* key) {
  geometry::Vector3d vector = geometry::Vector3d::Zero();
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != 3) return vector;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const ordered_json& value = (*found)[static_cast<std::size_t>(i)];
    if (value.is_number()) vector[i] = value.get<double>();
  }
  return vector;
}

/// Nothing where it is no whole number from 0 to `most`.
std::optional<core::TimeNs> whole_number(const ordered_json& json, core::TimeNs most) {
  if (!json.is_number_integer()) return std::nullopt;
  if (json.is_number_unsigned() && json.get<std::uint64_t>() > static_cast<std::uint64_t>(most)) return std::nullopt;
  const auto value = json.get<core::TimeNs>();
  return value >= 0 && value <= most ? std::optional(value) : std::nullopt;
}

/// What is not of the form is left out.
void read_learned(const ordered_json& json, ObjectSummary& object) {
  constexpr std::size_t kMostParameters = 64;
  if (const auto twist = json.find("twist"); twist != json.end() && twist->is_object())
    object.V_WO = {vector_or_zero(*twist, "angular"), vector_or_zero(*twist, "linear")};
  object.lessons = static_cast<int>(std::clamp(number_or(json, "lessons", 0.0), 0.0, 1e9));
  if (const auto stamp = json.find("learned_ns"); stamp != json.end())
    object.learned_ns = whole_number(*stamp, kLatestStampNs).value_or(object.learned_ns);
  const auto parameters = json.find("parameters");
  if (parameters == json.end() || !parameters->is_array()) return;
  for (const ordered_json& parameter : *parameters) {
    if (object.parameters.size() >= kMostParameters) return;
    if (!parameter.is_object()) continue;
    const auto name = parameter.find("name");
    if (name == parameter.end() || !name->is_string()) continue;
    object.parameters.push_back({name->get<std::string>(), number_or(parameter, "mean", 0.0),
                                 number_or(parameter, "standard_deviation", 0.0), number_or(parameter, "low", 0.0),
                                 number_or(parameter, "high", 0.0)});
  }
}

/// What is not of the form is left out.
void read_alternatives(const ordered_json& json, ObjectSummary& object) {
  const auto alternatives = json.find("alternatives");
  if (alternatives == json.end() || !alternatives->is_array()) return;
  for (const ordered_json& item : *alternatives) {
    if (object.alternatives.size() >= belief::kMostAlternatives) return;
    if (!item.is_object() || !item.contains("pose")) continue;
    if (const auto pose = belief::pose_from_json(item["pose"]))
      object.alternatives.push_back({*pose, number_or(item, "probability", 0.0)});
  }
}

/// What is not of the form is left out.
void read_joints(const ordered_json& json, BeliefSummary& summary) {
  constexpr std::size_t kMostJoints = 1024;
  if (!json.is_array()) return;
  for (const ordered_json& item : json) {
    if (summary.joints.size() >= kMostJoints) return;
    if (!item.is_object() || !item.contains("joint") || !item["joint"].is_string()) continue;
    belief::JointEstimate& joint = summary.joints.emplace_back();
    joint.joint = item["joint"].get<std::string>();
    joint.type =
        item.contains("type") && item["type"] == "slider" ? belief::JointType::kSlider : belief::JointType::kHinge;
    joint.position = number_or(item, "position", 0.0);
    joint.standard_deviation = number_or(item, "standard_deviation", 0.0);
    joint.velocity = number_or(item, "velocity", 0.0);
    joint.confidence = number_or(item, "confidence", 0.0);
    const auto limits = item.find("limits");
    const auto limit = [&](std::size_t i, double none) {
      const bool given = limits != item.end() && limits->is_array() && limits->size() == 2 && (*limits)[i].is_number();
      return given ? (*limits)[i].get<double>() : none;
    };
    joint.low = limit(0, -std::numeric_limits<double>::infinity());
    joint.high = limit(1, std::numeric_limits<double>::infinity());
  }
}

core::Result<ObjectSummary> object_from_json(const ordered_json& json) {
  const core::Status bad = core::invalid_input("belief: an object without name, state or pose");
  if (!json.is_object()) return bad;
  const auto name = json.find("name");
  const auto state = json.find("state");
  const auto pose = json.find("pose");
  if (name == json.end() || !name->is_string() || state == json.end() || !state->is_string() || pose == json.end())
    return bad;
  ObjectSummary object;
  object.name = name->get<std::string>();
  if (const auto model = json.find("model"); model != json.end() && model->is_string())
    object.model = model->get<std::string>();
  const auto* known = std::find_if(std::begin(kStates), std::end(kStates), [&](belief::TrackState s) {
    return belief::to_string(s) == state->get<std::string>();
  });
  if (known == std::end(kStates)) return bad;
  object.state = *known;
  PRESCENE_TRY(object.X_WO, belief::pose_from_json(*pose));
  object.confidence = number_or(json, "confidence", 0.0);
  object.existence = number_or(json, "existence", 0.0);
  object.evidence_per_pixel = number_or(json, "evidence_per_pixel", 0.0);
  object.visible_share = number_or(json, "visible_share", 0.0);
  const auto covariance = json.find("covariance");
  if (covariance != json.end() && covariance->is_array() && covariance->size() == 36) {
    for (Eigen::Index i = 0; i < 36; ++i) {
      const ordered_json& value = (*covariance)[static_cast<std::size_t>(i)];
      if (value.is_number()) object.covariance(i / 6, i % 6) = value.get<double>();
    }
  }
  read_learned(json, object);
  read_alternatives(json, object);
  if (const auto motion = json.find("motion"); motion != json.end() && motion->is_string()) {
    for (const belief::MotionMode mode : {belief::MotionMode::kResting, belief::MotionMode::kHeld})
      if (belief::to_string(mode) == motion->get<std::string>()) object.motion = mode;
  }
  if (const auto hand = json.find("held_by"); hand != json.end() && hand->is_string())
    object.held_by = hand->get<std::string>();
  if (const auto size = json.find("size"); size != json.end() && size->is_array() && size->size() == 3) {
    object.is_new = true;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const ordered_json& edge = (*size)[static_cast<std::size_t>(i)];
      if (edge.is_number()) object.size[i] = edge.get<double>();
    }
  }
  return object;
}

}  // namespace

BeliefSummary summary_of(const belief::Belief& belief) {
  BeliefSummary summary{belief.step, belief.stamp_ns, {}};
  for (const belief::ObjectBelief& object : belief.objects) {
    const belief::ObjectEstimate estimate = belief::estimate(belief, object);
    const belief::ObjectModel& model = belief::model_of(belief, object);
    summary.objects.push_back({object.name, model.name, object.state, estimate.confidence, object.existence,
                               estimate.mean, estimate.covariance, estimate.twist, object.evidence_per_pixel,
                               object.visible_share, belief::parameter_estimates(model, object.physics),
                               object.physics.lessons, object.physics.learned_ns});
    ObjectSummary& last = summary.objects.back();
    last.alternatives = belief::alternative_poses(belief, object);
    last.motion = estimate.motion;
    const auto at = static_cast<std::size_t>(&object - belief.objects.data());
    if (at < belief.scene->objects.size()) last.held_by = belief.scene->objects[at].held_by;
    last.frames_unseen = object.frames_unseen;
    last.frames_refuted = object.frames_refuted;
    if (!filter::is_unknown_object(object.name)) continue;
    last.is_new = true;
    last.size = box_of(model).sizes();
  }
  summary.joints = belief::joint_estimates(belief);
  return summary;
}

ordered_json to_json(const BeliefSummary& summary) {
  ordered_json objects = ordered_json::array();
  for (const ObjectSummary& object : summary.objects) {
    std::vector<double> covariance;
    for (Eigen::Index i = 0; i < 36; ++i) covariance.push_back(object.covariance(i / 6, i % 6));
    objects.push_back({{"name", object.name},
                       {"model", object.model},
                       {"state", belief::to_string(object.state)},
                       {"confidence", object.confidence},
                       {"existence", object.existence},
                       {"pose", belief::to_json(object.X_WO)},
                       {"covariance", covariance},
                       {"twist", belief::to_json(object.V_WO)},
                       {"evidence_per_pixel", object.evidence_per_pixel},
                       {"visible_share", object.visible_share},
                       {"parameters", belief::to_json(object.parameters)},
                       {"lessons", object.lessons},
                       {"learned_ns", object.learned_ns},
                       {"alternatives", belief::to_json(object.alternatives)},
                       {"motion", belief::to_string(object.motion)},
                       {"held_by", object.held_by ? ordered_json(*object.held_by) : ordered_json()}});
    if (object.is_new) objects.back()["size"] = {object.size.x(), object.size.y(), object.size.z()};
  }
  ordered_json json{{"step", summary.step}, {"stamp_ns", summary.stamp_ns}, {"objects", objects}};
  if (!summary.joints.empty()) json["joints"] = belief::to_json(summary.joints);
  return json;
}

core::Result<BeliefSummary> belief_summary_from_json(const std::string& text) {
  return belief_summary_of_document(parse_or_discard(text));
}

core::Result<BeliefSummary> belief_summary_of_document(const ordered_json& json) {
  const auto is = [&json](const char* key, bool (ordered_json::*kind)() const noexcept) {
    return json.is_object() && json.contains(key) && (json[key].*kind)();
  };
  if (!is("step", &ordered_json::is_number_integer) || !is("stamp_ns", &ordered_json::is_number_integer) ||
      !is("objects", &ordered_json::is_array)) {
    return core::invalid_input("belief: not {\"step\", \"stamp_ns\", \"objects\"}");
  }
  const auto step = whole_number(json["step"], std::numeric_limits<core::TimeNs>::max());
  const auto stamp_ns = whole_number(json["stamp_ns"], kLatestStampNs);
  if (!step)
    return core::invalid_input("belief: step " + belief::json_text(json["step"]) + " is none: steps count from 0");
  if (!stamp_ns) {
    return core::invalid_input("belief: stamp_ns " + belief::json_text(json["stamp_ns"]) +
                               " is not between the years 1970 and 2116: set the clock of the sender or the camera");
  }
  BeliefSummary summary{static_cast<std::uint64_t>(*step), *stamp_ns, {}};
  for (const ordered_json& object : json["objects"]) {
    PRESCENE_TRY(ObjectSummary read, object_from_json(object));
    summary.objects.push_back(std::move(read));
  }
  if (json.contains("joints")) read_joints(json["joints"], summary);
  return summary;
}

interfaces::RosPoseWithCovarianceStamped pose_of(const ObjectSummary& object, core::TimeNs stamp_ns,
                                                 const std::string& world_frame) {
  return {header_of(stamp_ns, world_frame), interfaces::to_ros_pose(object.X_WO, object.covariance)};
}

interfaces::RosDetection3dArray detections_of(const BeliefSummary& summary, const belief::Scene& scene,
                                              const std::string& world_frame) {
  interfaces::RosDetection3dArray array{header_of(summary.stamp_ns, world_frame), {}};
  for (const ObjectSummary& object : summary.objects) {
    if (object.state == belief::TrackState::kLost) continue;
    interfaces::RosDetection3d detection;
    detection.header = array.header;
    detection.id = object.name;
    detection.results.push_back(
        {{object.model, object.confidence}, interfaces::to_ros_pose(object.X_WO, object.covariance)});
    if (const belief::ObjectModel* model = model_of(scene, object.model)) {
      const geometry::Box box = box_of(*model);
      geometry::Pose X_WBox = object.X_WO;
      X_WBox.translation = object.X_WO * geometry::Vector3d(box.center());
      detection.bbox.center = interfaces::to_ros_pose(X_WBox);
      detection.bbox.size = {box.sizes().x(), box.sizes().y(), box.sizes().z()};
    }
    array.detections.push_back(std::move(detection));
  }
  return array;
}

interfaces::RosPoseArray poses_of(const BeliefSummary& summary, const std::string& world_frame) {
  interfaces::RosPoseArray array{header_of(summary.stamp_ns, world_frame), {}};
  for (const ObjectSummary& object : summary.objects) {
    if (object.state != belief::TrackState::kLost) array.poses.push_back(interfaces::to_ros_pose(object.X_WO));
  }
  return array;
}

interfaces::RosTfMessage transforms_of(const BeliefSummary& summary, const std::string& world_frame) {
  interfaces::RosTfMessage message;
  for (const ObjectSummary& object : summary.objects) {
    if (object.state == belief::TrackState::kLost) continue;
    message.transforms.push_back(interfaces::to_ros_transform(
        interfaces::FrameTransform{world_frame, kFramePrefix + object.name, summary.stamp_ns, object.X_WO}));
  }
  return message;
}

MarkerMeshes marker_meshes(const belief::Scene& scene) {
  MarkerMeshes meshes;
  for (const belief::ObjectModel& model : scene.models) {
    meshes.emplace(model.name, geometry::simplified(mesh_of(model), kMarkerTriangles));
  }
  return meshes;
}

void add_marker_meshes(const belief::Scene& scene, MarkerMeshes& meshes) {
  for (const belief::ObjectModel& model : scene.models) {
    // The name of a thing that was forgotten may be that of another by now.
    if (!meshes.contains(model.name) || filter::is_unknown_object(model.name))
      meshes[model.name] = geometry::simplified(mesh_of(model), kMarkerTriangles);
  }
}

namespace {

interfaces::RosMarker mesh_marker(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WO,
                                  const belief::Color& color, float opacity, interfaces::RosMarker marker) {
  marker.type = static_cast<std::int32_t>(interfaces::RosMarkerType::kTriangleList);
  marker.pose = interfaces::to_ros_pose(X_WO);
  marker.scale = {1.0, 1.0, 1.0};
  marker.color = {static_cast<float>(color.r), static_cast<float>(color.g), static_cast<float>(color.b), opacity};
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const geometry::Vector3d& p = mesh.vertices[corner];
      marker.points.push_back({p.x(), p.y(), p.z()});
    }
  }
  return marker;
}

/// What is improbable is drawn all but transparent.
float ghost_opacity(double probability) { return static_cast<float>(0.1 + 0.4 * std::clamp(probability, 0.0, 1.0)); }

interfaces::RosMarker deleted(interfaces::RosMarker marker) {
  marker.action = static_cast<std::int32_t>(interfaces::RosMarkerAction::kDelete);
  return marker;
}

}  // namespace

interfaces::RosMarkerArray markers_of(const BeliefSummary& summary, const belief::Scene& scene,
                                      const MarkerMeshes& meshes, const std::string& world_frame) {
  interfaces::RosMarkerArray array;
  std::int32_t id = 0, ghost_id = 0;
  for (const ObjectSummary& object : summary.objects) {
    const belief::ObjectModel* model = model_of(scene, object.model);
    const bool is_shown = model != nullptr && object.state != belief::TrackState::kLost;
    interfaces::RosMarker marker;
    marker.header = header_of(summary.stamp_ns, world_frame);
    marker.ns = "prescene";
    marker.id = id++;
    interfaces::RosMarker label = marker;
    label.id = id++;
    // Each of its ghosts has a number, so that one that is gone is removed.
    for (std::size_t i = 0; i < belief::kMostAlternatives; ++i) {
      interfaces::RosMarker ghost = marker;
      ghost.ns = "prescene/alternatives";
      ghost.id = ghost_id++;
      if (!is_shown || i >= object.alternatives.size()) {
        array.markers.push_back(deleted(std::move(ghost)));
        continue;
      }
      const belief::AlternativePose& other = object.alternatives[i];
      array.markers.push_back(mesh_marker(meshes.at(model->name), other.X_WO, model->color,
                                          ghost_opacity(other.probability), std::move(ghost)));
    }
    if (!is_shown) {
      array.markers.push_back(deleted(std::move(marker)));
      array.markers.push_back(deleted(std::move(label)));
      continue;
    }
    const geometry::TriangleMesh& mesh = meshes.at(model->name);
    const float opacity = object.state == belief::TrackState::kTracked ? 1.0F : 0.4F;
    label.type = static_cast<std::int32_t>(interfaces::RosMarkerType::kText);
    label.pose = interfaces::to_ros_pose(object.X_WO);
    label.pose.position.z += geometry::radius_about(mesh, geometry::Vector3d::Zero());
    label.scale = {0.0, 0.0, 0.03};
    label.color = {1.0F, 1.0F, 1.0F, 1.0F};
    label.text = object.name + " (" + belief::to_string(object.state) + ")";
    array.markers.push_back(mesh_marker(mesh, object.X_WO, model->color, opacity, std::move(marker)));
    array.markers.push_back(std::move(label));
  }
  return array;
}

}  // namespace prescene::service
