// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/scene_file.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "prescene/belief/validation.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::Scene;
using geometry::Vector3d;

constexpr NumberRange kGravity{-100.0, 100.0, "give m/s^2 as [x, y, z], [0, 0, -9.81] on Earth"};

// The names of a map's entries, checked; in the order of the file.
std::vector<std::string> read_names(const LocatedValue* map, Problems& problems) {
  std::vector<std::string> names;
  if (!map) return names;
  for (std::size_t i = 0; i < map->keys.size(); ++i) {
    const std::string& name = map->keys[i].name;
    if (!belief::check_name(name).ok())
      problems.add(map->keys[i].place, map->items[i].path,
                   "the name " + interfaces::quote(name) + " has characters that names can't have",
                   "use letters, digits, '_', '-' and '.', at most 128");
    names.push_back(name);
  }
  return names;
}

// Objects, supports and robot bodies share their names.
void check_distinct(const LocatedValue& document, Problems& problems) {
  std::vector<const LocatedValue::Key*> seen;
  for (const char* section : {"objects", "supports", "robot"}) {
    const LocatedValue* map = document.find(section);
    if (!map) continue;
    for (std::size_t i = 0; i < map->keys.size(); ++i) {
      const LocatedValue::Key& key = map->keys[i];
      const auto same = std::find_if(seen.begin(), seen.end(),
                                     [&](const LocatedValue::Key* other) { return other->name == key.name; });
      if (same != seen.end())
        problems.add(key.place, map->items[i].path, "the name is taken on line " + std::to_string((*same)->place.line),
                     "rename one of the two");
      seen.push_back(&key);
    }
  }
}

// Calls read(value, name) for each entry of a map of named things.
template <class Read>
void for_each_named(const LocatedValue* map, Problems& problems, const Read& read) {
  if (!map) return;
  if (map->kind != LocatedValue::Kind::kMap) {
    report_type(*map, problems, "give a map of names, each with a map of its keys");
    return;
  }
  for (std::size_t i = 0; i < map->keys.size(); ++i) read(map->items[i], map->keys[i].name);
}

belief::EventWeights read_events(const LocatedValue& value, Problems& problems) {
  belief::EventWeights events;
  Binder binder(value, problems);
  double sum = 0.0;
  for (std::size_t i = 0; i < belief::kEventKinds; ++i) {
    binder.read(belief::kEventNames[i], events.weight[i],
                {0.0, 1e6, "give a weight, at least 0: how probable it is, up to a common factor"});
    sum += events.weight[i];
  }
  if (!(sum > 0.0))
    problems.add(value.place, value.path, "every event has the weight 0", "give at least one that is more than 0");
  return events;
}

RecordingRecipe read_recording(const LocatedValue& value, Problems& problems) {
  constexpr long long kMostSeed = 1LL << 53;
  RecordingRecipe recipe;
  Binder binder(value, problems);
  if (const LocatedValue* at = binder.find("seed"))
    if (const auto seed = read_integer(*at, problems, 0, kMostSeed, "give a whole number of at least 0"))
      recipe.seed = static_cast<std::uint64_t>(*seed);
  binder.read("rate", recipe.rate, {0.1, 240.0, "give frames a second between 0.1 and 240"});
  binder.read("reports_robot", recipe.reports_robot);
  const std::vector<std::string> steppers = {"automatic", "bullet", "lockstep"};
  if (const LocatedValue* at = binder.find("stepper"))
    if (const auto word = read_word(*at, problems, steppers)) recipe.stepper = steppers[*word];
  binder.read("step", recipe.step, {kStep.low, kStep.high, "give seconds between 0.00001 and 0.02", "s"});
  return recipe;
}

void read_gravity(Binder& binder, Scene& scene) {
  const LocatedValue* at = binder.find("gravity");
  if (at) scene.gravity_W = read_vector(*at, binder.problems(), kGravity);
}

/// The distribution of X_WC X for a pose X of the distribution; nothing where it is none of these forms.
std::optional<belief::PoseDistribution> moved(const geometry::Pose& X_WC, const belief::PoseDistribution& in_camera) {
  if (const auto* fixed = std::get_if<belief::FixedPose>(&in_camera)) return belief::FixedPose{X_WC * fixed->X_WO};
  if (const auto* normal = std::get_if<belief::NormalPose>(&in_camera)) {
    // Rotations are in the object's frame, translations in that of the pose.
    geometry::Matrix6d turn = geometry::Matrix6d::Identity();
    turn.bottomRightCorner<3, 3>() = X_WC.rotation.toRotationMatrix();
    return belief::NormalPose{X_WC * normal->mean, turn * normal->covariance * turn.transpose()};
  }
  if (const auto* sampled = std::get_if<belief::SampledPose>(&in_camera)) {
    belief::SampledPose samples;
    for (const geometry::Pose& X_CO : sampled->samples) samples.samples.push_back(X_WC * X_CO);
    return samples;
  }
  return std::nullopt;
}

/// Brings the poses that were given in the camera's frame into the world's.
void place_in_camera(SceneContext& context) {
  for (const auto& [index, at] : context.in_camera) {
    if (!context.scene.camera || !context.scene.camera->is_placed) {
      context.problems.add(at->place, at->path, "there is no camera to be in the frame of",
                           "give the scene a 'camera' with a pose, or the object a 'pose' in the world");
      continue;
    }
    belief::PoseDistribution& pose = context.scene.objects[index].pose;
    if (auto in_world = moved(context.scene.camera->X_WC, pose))
      pose = *std::move(in_world);
    else
      context.problems.add(at->place, at->path, "an interval along the camera's axes is none along the world's",
                           "give 'normal' deviations or 'samples', or a 'pose' in the world");
  }
}

void read_sections(const LocatedValue& document, SceneContext& context) {
  Problems& problems = context.problems;
  Scene& scene = context.scene;
  Binder binder(document, problems);
  binder.read("name", scene.name);
  read_gravity(binder, scene);
  binder.read("duration", scene.duration, kDuration);
  const LocatedValue* step = binder.find("step");
  if (step != nullptr && step->text != "auto") binder.read("step", scene.step, kStep);
  binder.read("stop_at_rest", scene.stop_at_rest);

  const LocatedValue* models = binder.find("models");
  const LocatedValue* supports = binder.find("supports");
  const LocatedValue* robot = binder.find("robot");
  binder.read("new_objects", scene.new_objects);
  const LocatedValue* objects = binder.find("objects");
  context.models = read_names(models, problems);
  context.supports = read_names(supports, problems);
  context.robot = read_names(robot, problems);
  context.objects = read_names(objects, problems);
  check_distinct(document, problems);
  std::vector<belief::KinematicBody> links;
  if (const LocatedValue* at = binder.find("robot_description")) links = read_robot_description(*at, context);

  for_each_named(models, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.models.push_back(read_object_model(value, name, context));
  });
  for_each_named(supports, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.supports.push_back(read_support(value, name, context));
  });
  for_each_named(robot, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.robot.push_back(read_kinematic_body(value, name, context));
  });
  std::move(links.begin(), links.end(), std::back_inserter(scene.robot));
  for_each_named(objects, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.objects.push_back(read_object(value, name, context));
  });
  std::string which;
  const LocatedValue* camera =
      binder.one_of({"camera", "cameras"}, "give one 'camera', or a list of 'cameras'", true, &which);
  if (camera && which == "camera") scene.camera = read_camera(*camera, context);
  if (camera && which == "cameras") read_cameras(*camera, context);
  place_in_camera(context);
  const LocatedValue* joints = binder.find("joints");
  read_names(joints, problems);
  for_each_named(joints, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.joints.push_back(read_joint(value, name, context));
  });
  if (const LocatedValue* at = binder.find("depth_noise")) scene.depth_noise = read_depth_noise(*at, problems);
  if (const LocatedValue* at = binder.find("actions")) scene.actions = read_actions(*at, context);
  if (const LocatedValue* at = binder.find("events")) read_events(*at, problems);        // kept by parse_event_weights
  if (const LocatedValue* at = binder.find("recording")) read_recording(*at, problems);  // by parse_recording_recipe
  const LocatedValue* outcomes = binder.find("outcomes");
  read_names(outcomes, problems);
  for_each_named(outcomes, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.outcomes.push_back(read_outcome(value, name, "", context));
  });
  const LocatedValue* groups = binder.find("exclusive_outcomes");
  read_names(groups, problems);
  for_each_named(groups, problems, [&](const LocatedValue& value, const std::string& name) {
    scene.exclusive_outcomes.push_back(read_exclusive(value, name, context));
  });
}

}  // namespace

std::string SceneContext::read_name(const LocatedValue& value, const std::vector<std::string>& names,
                                    const std::string& what) {
  const std::optional<std::string> name = read_text(value, problems);
  if (!name) return {};
  if (std::find(names.begin(), names.end(), *name) != names.end()) return *name;
  std::string remedy = suggestion(*name, names);
  problems.add(value.place, value.path, interfaces::quote(*name) + " is not " + what + " of this file",
               remedy.empty() ? "define it first" : std::move(remedy));
  return {};
}

std::vector<std::string> SceneContext::all_things() const {
  std::vector<std::string> all = objects;
  all.insert(all.end(), supports.begin(), supports.end());
  all.insert(all.end(), robot.begin(), robot.end());
  return all;
}

belief::SceneObject read_object(const LocatedValue& value, const std::string& name, SceneContext& context) {
  belief::SceneObject object;
  object.name = name;
  Binder binder(value, context.problems);
  if (const LocatedValue* at = binder.require("model", "name one of the models")) {
    const std::string model = context.read_name(*at, context.models, "a model");
    const auto found = std::find(context.models.begin(), context.models.end(), model);
    if (found != context.models.end()) object.model = static_cast<int>(found - context.models.begin());
  }
  std::string which;
  const LocatedValue* pose =
      binder.one_of({"pose", "pose_in_camera"}, "give 'pose: {position: [x, y, z]}' in the world, or 'pose_in_camera'",
                    false, &which);
  if (pose) object.pose = read_pose_distribution(*pose, context.problems);
  if (pose && which == "pose_in_camera") context.in_camera.emplace_back(context.scene.objects.size(), pose);
  if (const LocatedValue* at = binder.find("velocity"))
    object.twist.linear = read_vector_distribution(*at, context.problems, kSpeed);
  if (const LocatedValue* at = binder.find("angular_velocity"))
    object.twist.angular = read_vector_distribution(*at, context.problems, kTurnRate);
  if (const LocatedValue* at = binder.find("held_by")) {
    const std::string hand = context.read_name(*at, context.robot, "a robot body");
    if (!hand.empty()) object.held_by = hand;
  }
  return object;
}

FileReport unread_report(const std::string& file, const core::Status& status, const Problems& problems) {
  if (!problems.empty()) return {problems.errors(), problems.warnings(), {}};
  return {{{file, 0, 0, "", status.message(), ""}}, {}, {}};
}

core::Result<Scene> parse_scene(std::string_view text, const std::string& file, const SceneFileOptions& options,
                                FileReport* report) {
  Problems problems;
  core::Result<LocatedValue> document = parse_yaml(text, file, options.limits, &problems);
  if (!document) {
    if (report) *report = unread_report(file, document.status(), problems);
    return document.status();
  }
  Scene scene;
  SceneContext context{problems, options, scene, {}, {}, {}, {}, {}};
  read_sections(*document, context);
  if (problems.empty()) {
    // Everything that a person can get wrong was found above, with its line; this is the contract of belief::Scene.
    if (const core::Status status = belief::validate(scene); !status.ok())
      add_invalid_scene(*document, scene, status, problems);
  }
  if (problems.empty()) refuse_starts_off_joints(*document, scene, problems);
  if (problems.empty()) refuse_starts(*document, scene, problems);
  if (problems.empty()) warn_of_oddities(*document, scene, problems);
  if (report) *report = {problems.errors(), problems.warnings(), problems.remarks()};
  if (!problems.empty()) return problems.status();
  return scene;
}

core::Result<belief::EventWeights> parse_event_weights(std::string_view text, const std::string& file) {
  PRESCENE_TRY(const LocatedValue document, parse_yaml(text, file, YamlLimits{}));
  Problems problems;
  belief::EventWeights events;
  for (std::size_t i = 0; i < document.keys.size(); ++i)
    if (document.keys[i].name == "events") events = read_events(document.items[i], problems);
  if (!problems.empty()) return problems.status();
  return events;
}

core::Result<RecordingRecipe> parse_recording_recipe(std::string_view text, const std::string& file) {
  PRESCENE_TRY(const LocatedValue document, parse_yaml(text, file, YamlLimits{}));
  Problems problems;
  RecordingRecipe recipe;
  for (std::size_t i = 0; i < document.keys.size(); ++i)
    if (document.keys[i].name == "recording") recipe = read_recording(document.items[i], problems);
  if (!problems.empty()) return problems.status();
  return recipe;
}

core::Result<Scene> read_scene(const std::filesystem::path& path, const SceneFileOptions& options, FileReport* report) {
  const core::Result<std::vector<std::uint8_t>> bytes = read_file(path, options.limits.max_bytes);
  if (!bytes) {
    if (report) report->errors.push_back({path.string(), 0, 0, "", bytes.status().message(), ""});
    return bytes.status();
  }
  return parse_scene(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), path.string(),
                     options, report);
}

}  // namespace prescene::interfaces
