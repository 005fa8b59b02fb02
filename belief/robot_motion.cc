// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/robot_motion.h"

#include <algorithm>

namespace prescene::belief {
namespace {

/// X_GO while the body holds the object, at the scene's start.
Pose grip(const KinematicBody& body, const SceneObject& object) {
  return pose_at(body, 0.0).inverse() * mean(object.pose);
}

struct Duration {
  double operator()(const Release& release) const {
    return release.retreat.squaredNorm() > 0.0 ? release.retreat_duration : 0.0;
  }
  double operator()(const Grasp&) const { return 0.0; }
  double operator()(const Bump&) const { return 0.0; }
  template <class Lasting>
  double operator()(const Lasting& lasting) const {
    return lasting.duration;
  }
};

}  // namespace

double share_done(double begin, double duration, double time) {
  return duration > 0.0 ? std::clamp((time - begin) / duration, 0.0, 1.0) : (time >= begin ? 1.0 : 0.0);
}

double duration_of(const Action& action) { return std::visit(Duration{}, action.what); }

double moved_share(double begin, double duration, double time) {
  return share_done(begin, kMovingShare * duration, time);
}

Pose turned_about(const Pose& X_WO, const Vector3d& pivot_O, const Vector3d& axis_W, double angle) {
  const Vector3d p_W = X_WO * pivot_O;
  Pose turned;
  turned.rotation = geometry::exp_rotation(angle * axis_W.normalized()) * X_WO.rotation;
  turned.translation = p_W - turned.rotation * pivot_O;
  return turned;
}

Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, int body_index, double time) {
  const KinematicBody& body = scene.robot[static_cast<std::size_t>(body_index)];
  const auto held = [&](const std::string& name) -> const SceneObject* {
    const std::optional<int> index = find_object(scene, name);
    if (!index) return nullptr;
    const SceneObject& object = scene.objects[static_cast<std::size_t>(*index)];
    return object.held_by == body.name ? &object : nullptr;
  };

  Pose X_WG = pose_at(body, time);
  bool carried = false;  // by an action, no more by the timeline
  for (const Action& action : actions) {
    if (action.time > time) break;
    if (const auto* release = std::get_if<Release>(&action.what)) {
      if (!held(release->object)) continue;
      X_WG.translation += share_done(action.time, release->retreat_duration, time) * release->retreat;
      continue;
    }
    const auto carry = [&](const SceneObject& object, const PoseDistribution& X_WO, double duration) {
      const Pose X_WG_end = mean(X_WO) * grip(body, object).inverse();
      const Pose X_WG_begin = carried ? X_WG : pose_at(body, action.time);
      X_WG = geometry::interpolate(X_WG_begin, X_WG_end, share_done(action.time, duration, time));
      carried = true;
    };
    if (const auto* place = std::get_if<Place>(&action.what)) {
      if (const SceneObject* object = held(place->object)) carry(*object, place->X_WO, place->duration);
    } else if (const auto* transport = std::get_if<Transport>(&action.what)) {
      if (const SceneObject* object = held(transport->object)) carry(*object, transport->X_WO, transport->duration);
    } else if (const auto* insert = std::get_if<Insert>(&action.what)) {
      if (!held(insert->object)) continue;
      X_WG.translation +=
          moved_share(action.time, insert->duration, time) * insert->distance * insert->axis_W.normalized();
    }
    const auto turn = [&](const std::string& name, const Vector3d& pivot_O, const Vector3d& axis_W, double angle) {
      const SceneObject* object = held(name);
      if (object == nullptr) return;
      const Pose X_GO = grip(body, *object);
      if (!carried) X_WG = pose_at(body, action.time);
      X_WG = turned_about(X_WG * X_GO, pivot_O, axis_W, angle) * X_GO.inverse();
      carried = true;
    };
    const double share = share_done(action.time, duration_of(action), time);
    if (const auto* pour = std::get_if<Pour>(&action.what))
      turn(pour->container, Vector3d::Zero(), pour->axis_W, share * pour->angle);
    if (const auto* tilt = std::get_if<Tilt>(&action.what))
      turn(tilt->object, tilt->pivot_O, tilt->axis_W, share * tilt->angle);
  }
  return X_WG;
}

}  // namespace prescene::belief
