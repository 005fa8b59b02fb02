// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/scene.h"

#include <algorithm>

namespace prescene::belief {
namespace {

template <class Named>
std::optional<int> find_name(const std::vector<Named>& things, const std::string& name) {
  const auto found = std::find_if(things.begin(), things.end(), [&](const Named& thing) { return thing.name == name; });
  if (found == things.end()) return std::nullopt;
  return static_cast<int>(found - things.begin());
}

}  // namespace

bool operator==(const Support& a, const Support& b) {
  return a.name == b.name && a.collision == b.collision && same_mesh(a.visual, b.visual) && a.X_WS == b.X_WS &&
         a.contact == b.contact && a.color == b.color && a.hollow == b.hollow;
}

bool operator==(const KinematicBody& a, const KinematicBody& b) {
  return a.name == b.name && a.collision == b.collision && same_mesh(a.visual, b.visual) && a.contact == b.contact &&
         a.color == b.color && a.timeline == b.timeline;
}

Pose pose_at(const KinematicBody& body, double time) {
  if (body.timeline.empty()) return {};
  const auto after =
      std::upper_bound(body.timeline.begin(), body.timeline.end(), time,
                       [](double t, const KinematicBody::Waypoint& waypoint) { return t < waypoint.time; });
  if (after == body.timeline.begin()) return body.timeline.front().X_WG;
  if (after == body.timeline.end()) return body.timeline.back().X_WG;
  const KinematicBody::Waypoint& before = *(after - 1);
  return geometry::interpolate(before.X_WG, after->X_WG, (time - before.time) / (after->time - before.time));
}

int camera_count(const Scene& scene) { return 1 + static_cast<int>(scene.more_cameras.size()); }

const SceneCamera* camera_at(const Scene& scene, int number) {
  if (number == 0) return scene.camera ? &*scene.camera : nullptr;
  const bool is_there = number > 0 && number < camera_count(scene);
  return is_there ? &scene.more_cameras[static_cast<std::size_t>(number) - 1] : nullptr;
}

DepthNoiseSettings depth_noise_of(const Scene& scene, int camera) {
  DepthNoiseSettings noise = scene.depth_noise;
  const SceneCamera* of = camera_at(scene, camera);
  if (of == nullptr) return noise;
  const auto take = [](const auto& from, auto& to) {
    if (from) to = from;
  };
  take(of->depth_noise.sigma_per_depth_squared, noise.sigma_per_depth_squared);
  take(of->depth_noise.incidence_knee, noise.incidence_knee);
  take(of->depth_noise.incidence_missing, noise.incidence_missing);
  take(of->depth_noise.outline_missing, noise.outline_missing);
  return noise;
}

std::optional<int> find_object(const Scene& scene, const std::string& name) { return find_name(scene.objects, name); }
std::optional<int> find_support(const Scene& scene, const std::string& name) { return find_name(scene.supports, name); }
std::optional<int> find_robot_body(const Scene& scene, const std::string& name) { return find_name(scene.robot, name); }

}  // namespace prescene::belief
