// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/robot_motion.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace prescene::belief {
namespace {

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

constexpr double kTimeRounding = 1e-9;  // s; times that differ by less are the same

/// What the hands and what they hold do by plan, action by action.
class Plan {
 public:
  Plan(const Scene& scene, const MotionStart& start)
      : scene_(scene), start_(start), bodies_(scene.robot.size()), objects_(scene.objects.size()) {
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      const SceneObject& object = scene.objects[i];
      objects_[i].hand = object.held_by ? find_robot_body(scene, *object.held_by) : std::nullopt;
      if (objects_[i].hand) objects_[i].X_GO = timeline_pose(*objects_[i].hand, start_time()).inverse() * start_pose(i);
    }
  }

  Pose pose_of(int hand, double time) const {
    const Body& body = bodies_[static_cast<std::size_t>(hand)];
    Pose X_WG = body.carries ? body.carries(time) : timeline_pose(hand, time);
    for (const Shift& shift : body.shifts) X_WG.translation += share_done(shift.begin, shift.duration, time) * shift.by;
    return X_WG;
  }

  /// Where its hand has it, or where it is since a hand let go of it, or from the start.
  Pose object_pose(int index, double time) const {
    const Object& object = objects_[static_cast<std::size_t>(index)];
    if (object.hand) return pose_of(*object.hand, std::min(time, object.until)) * object.X_GO;
    return object.X_WO ? *object.X_WO : start_pose(static_cast<std::size_t>(index));
  }

  /// What begins by `time`.
  void begin(std::span<const Action> actions, double time) {
    for (const Action& action : actions) {
      if (start_time() + action.time > time) break;
      begin(action);
    }
  }

 private:
  void begin(const Action& action) {
    const double from = start_time() + action.time;
    for (std::size_t i = 0; i < objects_.size(); ++i)
      if (objects_[i].until <= from + kTimeRounding) let_go(i, objects_[i].until);
    const std::optional<int> found = find_object(scene_, object_of(action));
    if (!found) return;
    const auto index = static_cast<std::size_t>(*found);
    Object& object = objects_[index];
    if (const auto* grasp = std::get_if<Grasp>(&action.what)) {
      const std::optional<int> hand = find_robot_body(scene_, grasp->hand);
      if (!hand) return;
      let_go(index, from);
      object.hand = hand;
      if (!object.X_WO) object.X_WO = start_pose(index);
      const auto X_WG = [&](double time) { return pose_of(*hand, time); };
      object.X_GO = start_.grasped ? start_.grasped(*found, from, X_WG) : X_WG(from).inverse() * *object.X_WO;
      return;
    }
    if (!object.hand) return;
    const int hand = *object.hand;
    Body& body = bodies_[static_cast<std::size_t>(hand)];
    if (const auto* release = std::get_if<Release>(&action.what)) {
      let_go(index, from);
      // A hand that carries another object goes on with that.
      if (body.until <= from + kTimeRounding)
        body.shifts.push_back({from, release->retreat_duration, release->retreat});
      return;
    }
    const Pose X_WG = pose_of(hand, from);
    const Pose X_GO = object.X_GO;
    const auto carry = [&](double moves_for, std::function<Pose(double share)> at_share) {
      body.carries = [=, at = std::move(at_share)](double time) { return at(share_done(from, moves_for, time)); };
      body.shifts.clear();  // it begins where these ended
      body.object = index;
      body.until = from + duration_of(action);
      object.until = lets_go(action) ? body.until : kForever;
    };
    const auto go = [&](const PoseDistribution& X_WO) {  // the object takes the straight line
      carry(duration_of(action),
            [X_WO_begin = X_WG * X_GO, X_WO_end = mean(X_WO), X_OG = X_GO.inverse()](double share) {
              return geometry::interpolate(X_WO_begin, X_WO_end, share) * X_OG;
            });
    };
    const auto turn = [&](const Vector3d& pivot_O, const Vector3d& axis_W, double angle) {
      carry(duration_of(action),
            [=](double share) { return turned_about(X_WG * X_GO, pivot_O, axis_W, share * angle) * X_GO.inverse(); });
    };
    if (const auto* place = std::get_if<Place>(&action.what)) go(place->X_WO);
    if (const auto* transport = std::get_if<Transport>(&action.what)) go(transport->X_WO);
    if (const auto* pour = std::get_if<Pour>(&action.what)) turn(Vector3d::Zero(), pour->axis_W, pour->angle);
    if (const auto* tilt = std::get_if<Tilt>(&action.what)) turn(tilt->pivot_O, tilt->axis_W, tilt->angle);
    if (const auto* insert = std::get_if<Insert>(&action.what)) {
      const Vector3d way = insert->distance * insert->axis_W.normalized();
      carry(kMovingShare * insert->duration, [=](double share) { return Pose::from_translation(share * way) * X_WG; });
    }
  }

  static constexpr double kForever = std::numeric_limits<double>::infinity();
  struct Shift {
    double begin = 0.0, duration = 0.0;  // s
    Vector3d by = Vector3d::Zero();      // m, in W
  };
  struct Body {
    std::function<Pose(double time)> carries;  // of its last carrying, which ends where it stays; empty = the timeline
    std::vector<Shift> shifts;                 // since then
    std::size_t object = 0;                    // that it carries ...
    double until = -kForever;                  // ... until then, s
  };
  struct Object {
    std::optional<int> hand;   // that holds it
    Pose X_GO;                 // in this hand
    std::optional<Pose> X_WO;  // where a hand let go of it; nothing: none did
    double until = kForever;   // s; when the hand lets go of it by what it does now
  };

  /// The object is in no hand from then on; one that is on its way with it stops there.
  void let_go(std::size_t index, double time) {
    Object& object = objects_[index];
    if (!object.hand) return;
    const Pose X_WG = pose_of(*object.hand, time);
    Body& body = bodies_[static_cast<std::size_t>(*object.hand)];
    if (body.object == index && time < body.until) {
      body.carries = [X_WG](double) { return Pose(X_WG); };
      body.shifts.clear();
      body.until = time;
    }
    object.X_WO = X_WG * object.X_GO;
    object.hand.reset();
    object.until = kForever;
  }

  double start_time() const { return start_.state ? start_.state->time : 0.0; }

  /// The mean of samples takes long: asked only of what hands hold or grasp.
  Pose start_pose(std::size_t index) const {
    return start_.state ? start_.state->objects[index].X_WO : mean(scene_.objects[index].pose);
  }

  Pose timeline_pose(int hand, double time) const {
    return pose_at(scene_.robot[static_cast<std::size_t>(hand)], time);
  }

  const Scene& scene_;
  const MotionStart start_;
  std::vector<Body> bodies_;
  std::vector<Object> objects_;
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

Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, int body, double time) {
  if (actions.empty()) return pose_at(scene.robot[static_cast<std::size_t>(body)], time);
  return robot_pose_at(scene, actions, MotionStart{}, body, time);
}

Pose robot_pose_at(const Scene& scene, std::span<const Action> actions, const MotionStart& start, int body,
                   double time) {
  Plan plan(scene, start);
  plan.begin(actions, time);
  return plan.pose_of(body, time);
}

Pose object_pose_at(const Scene& scene, std::span<const Action> actions, const MotionStart& start, int object,
                    double time) {
  Plan plan(scene, start);
  plan.begin(actions, time);
  return plan.object_pose(object, time);
}

}  // namespace prescene::belief
