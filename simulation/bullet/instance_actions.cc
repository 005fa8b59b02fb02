// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: what actions do to the bodies of a step: hands hold, load and let go of objects, robot and pushers
// move.
#include "body_motion.h"
#include "instance_world.h"

namespace prescene::simulation {

void InstanceWorld::run_actions() {
  poses_.clear();
  for (const Object& object : objects_) poses_.push_back(object_pose(object));
  released_.clear();
  player_.advance(time(), dt(), poses_, released_);
  set_free(released_);
  if (any_loaded_ || player_.has_loads(time())) load_objects();
  for (std::size_t i = 0; i < objects_.size(); ++i) objects_[i].held = player_.kinematic(static_cast<int>(i));
}

void InstanceWorld::set_free(const std::vector<ActionPlayer::Released>& released) {
  for (const ActionPlayer::Released& event : released) {
    Object& object = objects_[static_cast<std::size_t>(event.object)];
    object.w_WO = event.V_WO.angular;
    object.v_WCm = event.V_WO.linear + event.V_WO.angular.cross(object.R_WO * object.physical.center_of_mass);
    object.lag = object.owed = 0.0;
    object.calm_steps = 0;
    for (int r = 0; r < scene_->robot_count; ++r) {
      parting_[static_cast<std::size_t>(event.object * scene_->robot_count + r)] = 1;
    }
  }
}

void InstanceWorld::load_objects() {
  any_loaded_ = false;
  felt_.clear();
  for (Object& object : objects_) {
    object.loaded = false;
    object.acceleration = object.spin_up = Vector3d::Zero();
    felt_.push_back(
        {object_pose(object), object.p_WCm, object.v_WCm, object.w_WO, object.physical.mass, object.physical.friction});
  }
  if (!player_.has_loads(time())) return;
  const std::size_t freed = released_.size();
  loads_.clear();
  player_.load(time(), dt(), felt_, released_, loads_);
  set_free({released_.begin() + static_cast<std::ptrdiff_t>(freed), released_.end()});
  for (const ActionPlayer::Load& load : loads_) {
    Object& object = objects_[static_cast<std::size_t>(load.object)];
    if (object.frozen) continue;
    const CompiledBody& body = scene_->bodies[static_cast<std::size_t>(load.object)];
    const Vector3d velocity = load.impulse / object.physical.mass;
    const Vector3d spin = world_inertia(object.R_WO, body, object.physical.mass).inverse() * load.turn;
    object.calm_steps = 0;
    if (load.blow) {
      object.v_WCm = begun(object);
      object.lag = object.owed = 0.0;
      object.v_WCm += velocity;
      object.w_WO += spin;
      continue;
    }
    any_loaded_ = object.loaded = true;
    object.acceleration += velocity / dt();
    object.spin_up += spin / dt();
    if (load.keeps_attitude) object.w_WO = load.spin;
  }
}

void InstanceWorld::place_kinematic() {
  const double now = time();
  const auto place = [&](int body, const Pose& X_now, const Pose& X_next) {
    Moving& m = moving_[static_cast<std::size_t>(body)];
    m.X_WO = Frame(X_now);
    m.p_WCm = X_now.translation;
    m.velocity = (X_next.translation - X_now.translation) / dt();
    m.spin = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt();
    m.velocity_before = m.velocity;
    m.spin_before = m.spin_after = m.spin;
    m.fall = Vector3d::Zero();
    m.pulled = 0.0;
    m.dynamic = false;
    m.present = true;
    sweep(body);
  };
  for (int r = 0; r < scene_->robot_count; ++r) {
    place(scene_->robot_body(r), player_.robot_pose(r, now), player_.robot_pose(r, now + dt()));
  }
  for (int i = 0; i < player_.pusher_count(); ++i) {
    const int body = static_cast<int>(scene_->bodies.size()) + i;
    place(body, Pose::from_translation(player_.pusher_position(i, now)),
          Pose::from_translation(player_.pusher_position(i, now + dt())));
    moving_[static_cast<std::size_t>(body)].present = player_.pusher_present(i, now);
  }
  for (int i = 0; i < scene_->object_count; ++i) {
    Object& object = objects_[static_cast<std::size_t>(i)];
    if (!object.held) continue;
    const Pose X_next = player_.object_pose(i, now + dt());
    place(i, object_pose(object), X_next);
    Moving& m = moving_[static_cast<std::size_t>(i)];
    object.v_WCm = m.velocity + m.spin.cross(object.p_WCm - m.p_WCm);
    object.w_WO = m.spin;
    object.lag = object.owed = 0.0;
  }
}

}  // namespace prescene::simulation
