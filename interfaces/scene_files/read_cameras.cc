// SPDX-License-Identifier: Apache-2.0
// Where the cameras of a scene are, and under which names their images come.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "prescene/belief/validation.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/camera_presets.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;

template <std::size_t kCount>
void read_shares(Binder& binder, const char* key, std::optional<std::array<double, kCount>>& to) {
  constexpr NumberRange kShare{0.0, 0.999, "give shares of pixels without a return, at least 0 and below 1"};
  const LocatedValue* at = binder.find(key);
  const auto shares = at ? read_numbers(*at, binder.problems(), kCount, kShare) : std::nullopt;
  if (shares) std::copy(shares->begin(), shares->end(), to.emplace().begin());
}

}  // namespace

belief::DepthNoiseSettings read_depth_noise(const LocatedValue& value, Problems& problems) {
  belief::DepthNoiseSettings noise;
  Binder binder(value, problems);
  binder.read("sigma_per_depth_squared", noise.sigma_per_depth_squared,
              {1e-6, 1.0, "give the deviation in metres at 1 m, seen frontally (structured light 0.002 to 0.007)"});
  binder.read("incidence_knee", noise.incidence_knee, {0.0, 0.999, "give a cosine, at least 0 and below 1"});
  read_shares(binder, "incidence_missing", noise.incidence_missing);
  read_shares(binder, "outline_missing", noise.outline_missing);
  return noise;
}

namespace {

/// Of the keys that `camera` and each of `cameras` have.
void read_view(Binder& binder, bool needs_place, belief::SceneCamera& camera) {
  Problems& problems = binder.problems();
  geometry::PinholeCamera& in = camera.intrinsics;
  in.width = 640;
  in.height = 480;
  binder.read("width", in.width, 1, 16384, "give a number of pixels");
  binder.read("height", in.height, 1, 16384, "give a number of pixels");
  constexpr NumberRange kFocal{1.0, 1e5, "give the focal length in pixels, at least 1"};
  constexpr NumberRange kPixel{-1e5, 1e5, "give pixels"};
  std::string which;
  const LocatedValue* lens = binder.one_of(
      {"fx", "fov_deg"}, "give 'fx' in pixels, or 'fov_deg', the horizontal view in degrees", false, &which);
  if (lens && which == "fov_deg") {
    const double fov =
        read_number(*lens, problems, {1.0, 170.0, "give degrees between 1 and 170", "deg"}).value_or(60.0);
    in.fx = 0.5 * in.width / std::tan(0.5 * fov * std::numbers::pi / 180.0);
  } else if (lens) {
    in.fx = read_number(*lens, problems, kFocal).value_or(500.0);
  }
  in.fy = in.fx;
  in.cx = 0.5 * (in.width - 1);
  in.cy = 0.5 * (in.height - 1);
  binder.read("fy", in.fy, kFocal);
  binder.read("cx", in.cx, kPixel);
  binder.read("cy", in.cy, kPixel);
  const LocatedValue* place =
      binder.one_of({"pose", "look"}, "give 'pose', or 'look: {from: [x, y, z], at: [x, y, z]}'", !needs_place, &which);
  camera.is_placed = place != nullptr;
  if (!place) return;
  if (which == "pose") {
    camera.X_WC = read_pose(*place, problems);
    return;
  }
  Binder look(*place, problems);
  const LocatedValue* from_at = look.require("from", "give the camera's position [x, y, z]");
  const LocatedValue* at_at = look.require("at", "give the point that it looks at [x, y, z]");
  Vector3d up = Vector3d::UnitZ();
  if (const LocatedValue* at = look.find("up")) up = read_axis(*at, problems);
  if (!from_at || !at_at) return;
  const Vector3d from = read_vector(*from_at, problems, kPosition), to = read_vector(*at_at, problems, kPosition);
  const Vector3d z = to - from, x = z.cross(up);
  if (z.norm() < 1e-9 || x.norm() < 1e-6 * z.norm()) {
    problems.add(place->place, place->path, "the direction of view is none, or is along 'up'",
                 "move 'at' away from 'from', or give another 'up'");
    return;
  }
  geometry::Matrix3d R_WC;
  R_WC << x.normalized(), z.cross(x).normalized(), z.normalized();
  camera.X_WC = {geometry::Quaterniond(R_WC).normalized(), from};
}

bool is_word_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

/// Whether ROS takes it for an absolute name of a topic.
bool is_topic_name(const std::string& name) {
  if (name.size() < 2 || name.front() != '/' || name.back() == '/' || name.find("//") != std::string::npos)
    return false;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '/' && !is_word_character(name[i])) return false;
    if (i > 0 && name[i - 1] == '/' && std::isdigit(static_cast<unsigned char>(name[i]))) return false;
  }
  return true;
}

/// The topics that were named up to now, and where.
using NamedTopics = std::map<std::string, int>;  // by name the line

void read_topic(Binder& binder, const char* key, bool may_be_empty, std::string& to) {
  const LocatedValue* at = may_be_empty ? binder.find(key) : binder.require(key, "name the camera's topic");
  const auto name = at ? read_text(*at, binder.problems()) : std::nullopt;
  if (!name) return;
  if (!(may_be_empty && name->empty()) && !is_topic_name(*name))
    binder.problems().add(at->place, at->path, quote(*name) + " is no name of a topic",
                          "give letters, digits, _ and /, beginning with /");
  to = *name;
}

void read_form(Binder& binder, const char* key, const std::vector<std::string>& words, std::string& to) {
  const LocatedValue* at = binder.find(key);
  const auto word = at ? read_word(*at, binder.problems(), words) : std::nullopt;
  if (word) to = words[*word];
}

belief::CameraTopics read_named_topics(const LocatedValue& value, Problems& problems) {
  belief::CameraTopics topics;
  Binder binder(value, problems);
  read_topic(binder, "depth", false, topics.depth);
  read_topic(binder, "color", true, topics.color);
  read_topic(binder, "camera_info", false, topics.camera_info);
  read_form(binder, "depth_form", {"image", "compressed", "points"}, topics.depth_form);
  read_form(binder, "color_form", {"image", "compressed"}, topics.color_form);
  return topics;
}

belief::CameraTopics read_preset(Binder& binder, const LocatedValue& value) {
  Problems& problems = binder.problems();
  std::vector<std::string> names;
  for (const CameraPreset& preset : camera_presets()) names.emplace_back(preset.name);
  const auto word = read_word(value, problems, names);
  std::string name_space;
  const LocatedValue* at = binder.find("namespace");
  if (at) name_space = read_text(*at, problems).value_or("");
  if (at && !is_topic_name(name_space))
    problems.add(at->place, at->path, quote(name_space) + " is no namespace of topics",
                 "give letters, digits, _ and /, beginning with /, as '/wrist'");
  return word ? topics_of(camera_presets()[*word], name_space) : belief::CameraTopics{};
}

belief::CameraTopics read_topics(Binder& binder, const belief::SceneCamera& camera) {
  Problems& problems = binder.problems();
  std::string which;
  const LocatedValue* at = binder.one_of({"topics", "preset"}, "give 'topics' or 'preset'", true, &which);
  if (const LocatedValue* space = which == "preset" ? nullptr : binder.find("namespace"))
    problems.add(space->place, space->path, "it goes with 'preset', whose names it changes",
                 "give 'preset' (realsense, zed, ...), or the whole names under 'topics'");
  belief::CameraTopics topics;
  if (at && which == "topics") {
    topics = read_named_topics(*at, problems);
  } else if (at) {
    topics = read_preset(binder, *at);
  } else {
    topics = topics_of_name(camera.name);
    if (!is_topic_name("/" + camera.name))
      problems.add(binder.value().place, binder.value().path,
                   "no topics can be named after " + quote(camera.name) + ", as ROS's names have other characters",
                   "give 'topics' or 'preset'");
  }
  bool rectified = false;
  if (binder.read("rectified", rectified)) topics.rectified = rectified;
  return topics;
}

void check_new_topics(const LocatedValue& item, const belief::CameraTopics& topics, NamedTopics& named,
                      Problems& problems) {
  for (const std::string* topic : {&topics.depth, &topics.color, &topics.camera_info}) {
    if (topic->empty()) continue;
    const auto [other, is_new] = named.emplace(*topic, item.place.line);
    if (!is_new)
      problems.add(item.place, item.path,
                   "its topic " + *topic + " is named on line " + std::to_string(other->second) + " already",
                   "give each camera topics of its own: with 'topics', or 'preset' and 'namespace'");
  }
}

}  // namespace

belief::SceneCamera read_camera(const LocatedValue& value, SceneContext& context) {
  belief::SceneCamera camera;
  Binder binder(value, context.problems);
  binder.read("name", camera.name);
  read_view(binder, true, camera);
  return camera;
}

void read_cameras(const LocatedValue& value, SceneContext& context) {
  Problems& problems = context.problems;
  if (value.kind != LocatedValue::Kind::kList || value.items.empty()) {
    report_type(value, problems, "give a list of cameras, each '- {name: front, fov_deg: 60, look: {...}}'");
    return;
  }
  if (value.items.size() > belief::kMostCameras)
    problems.add(value.place, value.path, "there are " + std::to_string(value.items.size()) + " cameras",
                 "give at most " + std::to_string(belief::kMostCameras));
  std::map<std::string, int> lines;  // of the names
  NamedTopics named;
  for (const LocatedValue& item : value.items) {
    belief::SceneCamera camera;
    Binder binder(item, problems);
    if (const LocatedValue* at = binder.require("name", "name the camera")) {
      camera.name = read_text(*at, problems).value_or("");
      const auto [other, is_new] = lines.emplace(camera.name, at->place.line);
      if (!belief::check_name(camera.name).ok())
        problems.add(at->place, at->path,
                     "the name " + quote(camera.name) + " is empty or has characters that names can't have",
                     "use letters, digits, '_', '-' and '.', at most 128");
      else if (!is_new)
        problems.add(at->place, at->path, "the name is taken on line " + std::to_string(other->second),
                     "rename one of the two");
    }
    read_view(binder, false, camera);
    binder.read("frame", camera.frame);
    camera.topics = read_topics(binder, camera);
    check_new_topics(item, *camera.topics, named, problems);
    if (const LocatedValue* at = binder.find("depth_noise")) camera.depth_noise = read_depth_noise(*at, problems);
    if (!context.scene.camera)
      context.scene.camera = std::move(camera);
    else
      context.scene.more_cameras.push_back(std::move(camera));
  }
}

}  // namespace prescene::interfaces
