// SPDX-License-Identifier: Apache-2.0
// JSON of states, trajectories and beliefs; beliefs both ways.
#include "json_motion.h"
#include "json_values.h"
#include "prescene/belief/body_names.h"
#include "prescene/belief/json.h"
#include "prescene/core/check.h"

namespace prescene::belief {
namespace {

constexpr int kMostParticles = 1'000'000;

Json physical_json(const PhysicalParameters& physical) {
  return {{"mass", physical.mass},
          {"center_of_mass", vector_json(physical.center_of_mass)},
          {"friction", physical.friction},
          {"impact_friction", physical.impact_friction},
          {"restitution", physical.restitution}};
}

Json particle_json(const Particle& particle) {
  Json json;
  json["log_weight"] = std::isfinite(particle.log_weight) ? Json(particle.log_weight) : Json(nullptr);
  json["X_WO"] = to_json(particle.X_WO);
  json["V_WO"] = to_json(particle.V_WO);
  json["covariance"] = matrix_json(particle.covariance);
  json["mode"] = to_string(particle.mode);
  return json;
}

Particle particle_from(const JsonAt& at) {
  Particle particle;
  JsonObject fields(at);
  if (const auto weight = fields.require("log_weight"))
    particle.log_weight = weight->number_or_null(-std::numeric_limits<double>::infinity());
  if (const auto pose = fields.require("X_WO")) particle.X_WO = pose_from(*pose);
  if (const auto twist = fields.require("V_WO")) particle.V_WO = twist_from(*twist);
  if (const auto covariance = fields.require("covariance")) particle.covariance = matrix_from(*covariance, 12);
  if (const auto mode = fields.require("mode")) particle.mode = mode->word(motion_mode_words());
  return particle;
}

Json colors_json(const LearnedColors& colors) {
  Json shares = Json::array();
  for (const ColorShare& share : *colors.shares) shares.push_back({share.bin, share.object, share.rest});
  return {{"frames", colors.frames}, {"shares", std::move(shares)}};
}

LearnedColors colors_from(const JsonAt& at) {
  LearnedColors colors;
  JsonObject fields(at);
  if (const auto frames = fields.require("frames"))
    colors.frames = static_cast<int>(frames->integer(1, std::numeric_limits<int>::max()));
  const auto rows = fields.require("shares");
  if (!rows) return colors;
  std::vector<ColorShare> shares;
  for (const JsonAt& row : rows->items()) {
    const std::vector<JsonAt> cells = row.items(3);
    if (cells.empty()) continue;
    ColorShare share;
    share.bin = static_cast<int>(cells[0].integer(shares.empty() ? 0 : shares.back().bin + 1, kColorCells - 1));
    share.object = cells[1].number();
    share.rest = cells[2].number();
    const auto is_share = [](double value) { return value >= 0.0 && value <= 1.0; };
    if (!is_share(share.object) || !is_share(share.rest)) row.fail("give shares between 0 and 1");
    shares.push_back(share);
  }
  colors.shares = std::make_shared<const std::vector<ColorShare>>(std::move(shares));
  return colors;
}

Json view_json(const CameraView& view) {
  Json json{{"sees", view.sees},
            {"evidence_per_pixel", view.evidence_per_pixel},
            {"evidence_scale", view.evidence_scale},
            {"visible_share", view.visible_share},
            {"visible_pixels", view.visible_pixels}};
  if (view.colors.shares) json["colors"] = colors_json(view.colors);
  return json;
}

CameraView view_from(const JsonAt& at) {
  CameraView view;
  JsonObject fields(at);
  if (const auto sees = fields.require("sees")) view.sees = sees->boolean();
  const auto read = [&](const char* key, double& to) {
    if (const auto number = fields.require(key)) to = number->number();
  };
  read("evidence_per_pixel", view.evidence_per_pixel);
  read("evidence_scale", view.evidence_scale);
  read("visible_share", view.visible_share);
  if (const auto pixels = fields.require("visible_pixels"))
    view.visible_pixels = static_cast<int>(pixels->integer(0, std::numeric_limits<int>::max()));
  if (const auto colors = fields.find("colors")) view.colors = colors_from(*colors);
  return view;
}

ObjectBelief object_from(const JsonAt& at, const Scene& scene) {
  ObjectBelief object;
  JsonObject fields(at);
  if (const auto name = fields.require("name")) object.name = name->text();
  if (const auto model = fields.require("model"))
    object.model = static_cast<int>(model->integer(0, std::max<std::int64_t>(0, std::ssize(scene.models) - 1)));
  if (const auto particles = fields.require("particles")) {
    const std::vector<JsonAt> items = particles->items();
    if (items.empty() || items.size() > kMostParticles) particles->fail("1 to 1000000 particles are needed");
    for (const JsonAt& item : items) object.particles.push_back(particle_from(item));
  }
  const auto read = [&](const char* key, double& to) {
    if (const auto number = fields.require(key)) to = number->number();
  };
  read("existence", object.existence);
  if (const auto state = fields.require("state")) object.state = state->word(track_state_words());
  read("evidence_per_pixel", object.evidence_per_pixel);
  read("visible_share", object.visible_share);
  if (const auto frames = fields.require("frames_unseen"))
    object.frames_unseen = static_cast<int>(frames->integer(0, std::numeric_limits<int>::max()));
  if (const auto frames = fields.require("frames_refuted"))
    object.frames_refuted = static_cast<int>(frames->integer(0, std::numeric_limits<int>::max()));
  if (const auto seen = fields.require("last_seen_ns")) object.last_seen_ns = seen->integer(INT64_MIN, INT64_MAX);
  if (const auto island = fields.require("island"))
    object.island = static_cast<int>(island->integer(0, std::numeric_limits<int>::max()));
  if (const auto colors = fields.find("colors")) object.colors = colors_from(*colors);
  if (const auto physics = fields.find("physics")) {
    const auto model = static_cast<std::size_t>(object.model);
    const int dimensions = model < scene.models.size() ? physical_dimensions(scene.models[model]) : 0;
    object.physics = physics_from(*physics, dimensions);
  }
  if (const auto motion = fields.require("motion")) object.motion = motion_from(*motion);
  if (const auto grip = fields.find("grip")) object.grip = grip_from(*grip);
  if (const auto views = fields.find("views"))
    for (const JsonAt& item : views->items()) object.views.push_back(view_from(item));
  return object;
}

Json camera_json(const CameraRecord& camera) {
  return {{"frames", camera.frames},
          {"stamp_ns", camera.stamp_ns},
          {"period_ns", camera.period_ns},
          {"X_WC", to_json(camera.X_WC)}};
}

CameraRecord camera_from(const JsonAt& at) {
  CameraRecord camera;
  JsonObject fields(at);
  if (const auto frames = fields.require("frames")) camera.frames = frames->unsigned_integer();
  if (const auto stamp = fields.require("stamp_ns")) camera.stamp_ns = stamp->integer(INT64_MIN, INT64_MAX);
  if (const auto period = fields.require("period_ns")) camera.period_ns = period->integer(0, INT64_MAX);
  if (const auto pose = fields.require("X_WC")) camera.X_WC = pose_from(*pose);
  return camera;
}

std::string end_word(TrajectoryEnd end) {
  switch (end) {
    case TrajectoryEnd::kAtRest:
      return "at_rest";
    case TrajectoryEnd::kDuration:
      return "duration";
    case TrajectoryEnd::kLeftTheWorld:
      return "left_the_world";
    case TrajectoryEnd::kDiverged:
      return "diverged";
    case TrajectoryEnd::kCancelled:
      return "cancelled";
    case TrajectoryEnd::kDecided:
      return "decided";
  }
  PRESCENE_CHECK_MSG(false, "a TrajectoryEnd outside of its enumeration");
}

}  // namespace

Json to_json(const WorldState& state) {
  Json objects = Json::array();
  for (const ObjectState& object : state.objects)
    objects.push_back({{"X_WO", to_json(object.X_WO)},
                       {"V_WO", to_json(object.V_WO)},
                       {"mode", to_string(object.mode)},
                       {"physical", physical_json(object.physical)}});
  return {{"time", state.time}, {"objects", std::move(objects)}};
}

Json to_json(const Timeline& timeline) {
  Json json = Json::array();
  for (const Interval& interval : timeline) {
    Json item{{"relation", to_string(interval.relation)}, {"subject", interval.subject}};
    if (!interval.other.empty()) item["other"] = interval.other;
    item["begin"] = interval.begin;
    item["end"] = interval.end;
    json.push_back(std::move(item));
  }
  return json;
}

Json to_json(const Trajectory& trajectory) {
  Json states = Json::array(), contacts = Json::array(), final_contacts = Json::array();
  for (const WorldState& state : trajectory.states) states.push_back(to_json(state));
  for (const ContactInterval& contact : trajectory.contacts)
    contacts.push_back({{"first", contact.first},
                        {"second", contact.second},
                        {"begin", contact.begin},
                        {"end", contact.end},
                        {"largest_impulse", contact.largest_impulse},
                        {"normal_z", contact.normal_z}});
  for (const auto& [first, second] : trajectory.final_contacts) final_contacts.push_back({first, second});
  return {{"states", std::move(states)},
          {"contacts", std::move(contacts)},
          {"final_contacts", std::move(final_contacts)},
          {"end", end_word(trajectory.end)},
          {"simulated_seconds", trajectory.simulated_seconds}};
}

Json to_json(const ObjectBelief& object) {
  Json particles = Json::array();
  for (const Particle& particle : object.particles) particles.push_back(particle_json(particle));
  Json json{{"name", object.name},
            {"model", object.model},
            {"particles", std::move(particles)},
            {"existence", object.existence},
            {"state", to_string(object.state)},
            {"evidence_per_pixel", object.evidence_per_pixel},
            {"visible_share", object.visible_share},
            {"frames_unseen", object.frames_unseen},
            {"frames_refuted", object.frames_refuted},
            {"last_seen_ns", object.last_seen_ns},
            {"island", object.island}};
  if (object.colors.shares) json["colors"] = colors_json(object.colors);
  if (object.physics.draws) json["physics"] = physics_json(object.physics);
  json["motion"] = motion_json(object.motion);
  if (object.grip != GripRecord{}) json["grip"] = grip_json(object.grip);
  for (const CameraView& view : object.views) json["views"].push_back(view_json(view));
  return json;
}

Json to_json(const std::vector<JointEstimate>& estimates) {
  Json json = Json::array();
  const auto limit = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
  for (const JointEstimate& joint : estimates)
    json.push_back({{"joint", joint.joint},
                    {"type", to_string(joint.type)},
                    {"unit", unit_of(joint.type)},
                    {"position", joint.position},
                    {"standard_deviation", joint.standard_deviation},
                    {"velocity", joint.velocity},
                    {"limits", {limit(joint.low), limit(joint.high)}},
                    {"confidence", joint.confidence}});
  return json;
}

Json to_json(const std::vector<AlternativePose>& alternatives) {
  Json json = Json::array();
  for (const AlternativePose& other : alternatives)
    json.push_back({{"pose", to_json(other.X_WO)}, {"probability", other.probability}});
  return json;
}

Json to_json(const Belief& belief) {
  Json objects = Json::array(), robot = Json::array();
  for (const ObjectBelief& object : belief.objects) objects.push_back(to_json(object));
  for (const Pose& pose : belief.robot) robot.push_back(to_json(pose));
  Json json{{"step", belief.step},           {"seed", belief.seed},       {"stamp_ns", belief.stamp_ns},
            {"objects", std::move(objects)}, {"robot", std::move(robot)}, {"X_WC", to_json(belief.X_WC)}};
  if (belief.lowest_seen) json["lowest_seen"] = *belief.lowest_seen;
  for (const Action& push : belief.pushes) json["pushes"].push_back(to_json(push));
  for (const CameraRecord& camera : belief.cameras) json["cameras"].push_back(camera_json(camera));
  return json;
}

core::Result<Belief> belief_from_json(const Json& value, std::shared_ptr<const Scene> scene) {
  PRESCENE_CHECK(scene != nullptr);
  JsonErrors errors;
  Belief belief;
  belief.scene = std::move(scene);
  {
    JsonObject fields({value, "", errors});
    if (const auto step = fields.require("step")) belief.step = step->unsigned_integer();
    if (const auto seed = fields.require("seed")) belief.seed = seed->unsigned_integer();
    if (const auto stamp = fields.require("stamp_ns")) belief.stamp_ns = stamp->integer(INT64_MIN, INT64_MAX);
    if (const auto objects = fields.require("objects")) {
      for (const JsonAt& item : objects->items()) belief.objects.push_back(object_from(item, *belief.scene));
      if (!belief.objects.empty() && belief.scene->models.empty())
        objects->fail("its objects have models, the scene has none: give the scene of that belief");
    }
    if (const auto robot = fields.require("robot"))
      for (const JsonAt& item : robot->items()) belief.robot.push_back(pose_from(item));
    if (const auto camera = fields.require("X_WC")) belief.X_WC = pose_from(*camera);
    if (const auto lowest = fields.find("lowest_seen")) belief.lowest_seen = lowest->number();
    if (const auto pushes = fields.find("pushes")) {
      for (const JsonAt& item : pushes->items()) {
        belief.pushes.push_back(action_from(item));
        if (!std::holds_alternative<Push>(belief.pushes.back().what)) item.fail("only a push goes on between frames");
      }
    }
    if (const auto cameras = fields.find("cameras"))
      for (const JsonAt& item : cameras->items()) belief.cameras.push_back(camera_from(item));
  }
  if (!errors.ok()) return errors.status();
  return belief;
}

}  // namespace prescene::belief
