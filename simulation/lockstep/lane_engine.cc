// SPDX-License-Identifier: Apache-2.0
#include "lane_engine.h"

#include <algorithm>

#include "prescene/simulation/rules/impact_split.h"

namespace prescene::simulation {
namespace {

using geometry::Pose;
using geometry::Quaterniond;

void set_vector(const Rows<3>& rows, int at, const Vector3d& value) {
  for (std::size_t i = 0; i < 3; ++i) rows[i][at] = static_cast<Real>(value[static_cast<Eigen::Index>(i)]);
}

void set_rotation(const Rows<4>& rows, int at, const Quaterniond& q) {
  rows[0][at] = static_cast<Real>(q.w());
  rows[1][at] = static_cast<Real>(q.x());
  rows[2][at] = static_cast<Real>(q.y());
  rows[3][at] = static_cast<Real>(q.z());
}

/// After so many parts of a step in which it goes straight and turns evenly.
Pose pose_after(const Pose& X_now, const Pose& X_next, int parts) {
  if (parts == 0) return X_now;
  if (parts == kStepParts) return X_next;
  return geometry::interpolate(X_now, X_next, static_cast<double>(parts) / kStepParts);
}

template <std::size_t N>
void copy(const Rows<N>& rows, int from, int to) {
  for (Real* row : rows) row[to] = row[from];
}

}  // namespace

LaneEngine::LaneEngine(std::shared_ptr<const CompiledLockstep> scene, int slots)
    : scene_(std::move(scene)), state_(slots, scene_->lanes), scratch_(state_.slots(), scene_->lanes) {
  const auto most = static_cast<std::size_t>(state_.slots());
  const LockstepScene& lanes = scene_->lanes;
  const auto of_objects = most * static_cast<std::size_t>(lanes.objects);
  moved_.resize(of_objects);
  kept_.resize(of_objects);
  present_.resize(most * lanes.bodies.size() - of_objects);
  driven_.resize(most);
  ways_.resize(most * lanes.bodies.size());
  if (lanes.objects > 1) {
    footing_counts_.resize(of_objects);
    footings_.resize(of_objects * kMostFooting);
    woken_.reserve(most);
  }
  pairs_.planes.reserve(most * lanes.fixed.size());
  pairs_.boxes.reserve(2 * most * lanes.fixed.size());
  pairs_.shapes.resize(lanes.parts.size());
  for (std::size_t i = 0; i < lanes.parts.size(); ++i) {
    const bool box = i < lanes.fixed.size() && lanes.fixed[i].shape.kind == CoreKind::kBox;
    if (!box) pairs_.shapes[i].reserve(most);
  }
  listed_.reserve(most);
  touching_.reserve(most);
  flying_.reserve(of_objects);
  totals_.reserve(most);
  for (auto* flags : {&going_, &shortened_}) flags->reserve(most);
  for (auto* parts : {&left_, &taken_}) parts->reserve(most);
  pressed_.reserve(8 * most);
  starts_.resize(static_cast<std::size_t>(state_.room() * lanes.objects) + 2);
}

void LaneEngine::reset(int slot, const belief::WorldState& start) {
  for (int object = 0; object < objects(); ++object) {
    const belief::ObjectState& given = start.objects[static_cast<std::size_t>(object)];
    const belief::PhysicalParameters& physical = given.physical;
    const int at = state_.at(object, slot);
    const Pose X_WO{given.X_WO.rotation.normalized(), given.X_WO.translation};
    set_vector(state_.com, at, scene_->R_OP[static_cast<std::size_t>(object)].conjugate() * physical.center_of_mass);
    // The arm from the exact centre of mass, not from that of single precision.
    const Vector3d arm = X_WO.rotation * physical.center_of_mass;
    const auto& origin = scene_->lanes.origin;
    set_vector(state_.p, at, X_WO.translation + arm - Vector3d(origin[0], origin[1], origin[2]));
    set_rotation(state_.q, at, (X_WO.rotation * scene_->R_OP[static_cast<std::size_t>(object)]).normalized());
    set_vector(state_.v, at, given.V_WO.linear + given.V_WO.angular.cross(arm));
    set_vector(state_.w, at, given.V_WO.angular);
    state_.friction[at] = static_cast<Real>(physical.friction);
    state_.impact_friction[at] = static_cast<Real>(physical.impact_friction);
    state_.restitution[at] = static_cast<Real>(physical.restitution);
    set_vector(state_.middle_v, at, Vector3d::Zero());
    set_vector(state_.middle_w, at, Vector3d::Zero());
    state_.lag[at] = state_.owed[at] = Real(0);
    state_.warm_count[static_cast<std::size_t>(at)] = 0;
    state_.contact_count[static_cast<std::size_t>(at)] = 0;
    Moved& moved = moved_[static_cast<std::size_t>(at)];
    moved = Moved{};
    moved.inverse_mass = static_cast<Real>(1.0 / physical.mass);
    set_motion(slot, object, LaneMotion::kFree);
  }
  for (int body = objects(); body < static_cast<int>(scene_->lanes.bodies.size()); ++body) remove(slot, body);
  drive(slot, false);
}

Vector3d LaneEngine::center_of_mass(int slot, int object) const { return vector_at(state_.p, state_.at(object, slot)); }

Vector3d LaneEngine::velocity(int slot, int object) const { return vector_at(state_.v, state_.at(object, slot)); }

Quaterniond LaneEngine::rotation(int slot, int object) const {
  const int at = state_.at(object, slot);
  return Quaterniond(static_cast<double>(state_.q[0][at]), static_cast<double>(state_.q[1][at]),
                     static_cast<double>(state_.q[2][at]), static_cast<double>(state_.q[3][at]))
      .normalized();
}

void LaneEngine::read(int slot, int object, belief::ObjectState& state) const {
  const int at = state_.at(object, slot);
  const auto& origin = scene_->lanes.origin;
  state.X_WO.rotation =
      (rotation(slot, object) * scene_->R_OP[static_cast<std::size_t>(object)].conjugate()).normalized();
  const Vector3d arm = state.X_WO.rotation * state.physical.center_of_mass;
  state.X_WO.translation = vector_at(state_.p, at) + Vector3d(origin[0], origin[1], origin[2]) - arm;
  state.V_WO.angular = vector_at(state_.w, at);
  state.V_WO.linear = vector_at(state_.v, at) - state.V_WO.angular.cross(arm);
}

void LaneEngine::move(int from, int to) {
  driven_[static_cast<std::size_t>(to)] = driven_[static_cast<std::size_t>(from)];
  for (int body = 0; body < static_cast<int>(scene_->lanes.bodies.size()); ++body) {
    const int a = state_.at(body, from);
    const int b = state_.at(body, to);
    ways_[static_cast<std::size_t>(b)] = ways_[static_cast<std::size_t>(a)];
    copy(state_.p, a, b);
    copy(state_.v, a, b);
    copy(state_.w, a, b);
    if (body >= objects()) {
      copy(state_.R, a, b);
      state_.travel[b] = state_.travel[a];
      present_[kinematic_of(body, to)] = present_[kinematic_of(body, from)];
      continue;
    }
    copy(state_.q, a, b);
    copy(state_.com, a, b);
    copy(state_.middle_v, a, b);
    copy(state_.middle_w, a, b);
    for (Real* row :
         {state_.friction, state_.impact_friction, state_.restitution, state_.inverse_mass, state_.lag, state_.owed})
      row[b] = row[a];
    moved_[static_cast<std::size_t>(b)] = moved_[static_cast<std::size_t>(a)];
    const int warm = state_.warm_count[static_cast<std::size_t>(a)];
    state_.warm_count[static_cast<std::size_t>(b)] = warm;
    std::copy_n(state_.warm(a), warm, state_.warm(b));
    if (motion(to, body) == LaneMotion::kAsleep) copy_footing(place_of(body, from), place_of(body, to));
  }
}

void LaneEngine::save(int slot, SlotState& saved) const {
  saved.resize(static_cast<std::size_t>(objects()));
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    ObjectSlot& out = saved[static_cast<std::size_t>(object)];
    for (std::size_t i = 0; i < 3; ++i) {
      out.p[i] = state_.p[i][at];
      out.v[i] = state_.v[i][at];
      out.w[i] = state_.w[i][at];
      out.middle_v[i] = state_.middle_v[i][at];
      out.middle_w[i] = state_.middle_w[i][at];
    }
    for (std::size_t i = 0; i < 4; ++i) out.q[i] = state_.q[i][at];
    out.lag = state_.lag[at];
    out.owed = state_.owed[at];
    out.motion = motion(slot, object);
    out.parting = moved_[static_cast<std::size_t>(at)].parting;
    out.warm_count = state_.warm_count[static_cast<std::size_t>(at)];
    std::copy_n(const_cast<LaneState&>(state_).warm(at), out.warm_count, out.warm);
    save_footing(place_of(object, slot), out);
  }
}

void LaneEngine::restore(int slot, const SlotState& saved) {
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    const ObjectSlot& in = saved[static_cast<std::size_t>(object)];
    for (std::size_t i = 0; i < 3; ++i) {
      state_.p[i][at] = in.p[i];
      state_.v[i][at] = in.v[i];
      state_.w[i][at] = in.w[i];
      state_.middle_v[i][at] = in.middle_v[i];
      state_.middle_w[i][at] = in.middle_w[i];
    }
    for (std::size_t i = 0; i < 4; ++i) state_.q[i][at] = in.q[i];
    state_.lag[at] = in.lag;
    state_.owed[at] = in.owed;
    set_motion(slot, object, in.motion);
    moved_[static_cast<std::size_t>(at)].parting = in.parting;
    state_.warm_count[static_cast<std::size_t>(at)] = in.warm_count;
    std::copy_n(in.warm, in.warm_count, state_.warm(at));
    restore_footing(place_of(object, slot), in);
  }
}

void LaneEngine::set_pose(int slot, int object, const Pose& X_WO) {
  const int at = state_.at(object, slot);
  const auto& origin = scene_->lanes.origin;
  const Quaterniond R_WP = (X_WO.rotation * scene_->R_OP[static_cast<std::size_t>(object)]).normalized();
  set_vector(state_.p, at,
             X_WO.translation + R_WP * vector_at(state_.com, at) - Vector3d(origin[0], origin[1], origin[2]));
  set_rotation(state_.q, at, R_WP);
}

void LaneEngine::set_motion(int slot, int object, LaneMotion motion) {
  const int at = state_.at(object, slot);
  Moved& moved = moved_[static_cast<std::size_t>(at)];
  moved.motion = motion;
  if (motion != LaneMotion::kFree) state_.lag[at] = state_.owed[at] = Real(0);
  state_.inverse_mass[at] = motion == LaneMotion::kFree ? moved.inverse_mass : Real(0);
  if (motion != LaneMotion::kFrozen && motion != LaneMotion::kAsleep) return;
  for (std::size_t i = 0; i < 3; ++i) moved.next_p[i] = state_.p[i][at];
  for (std::size_t i = 0; i < 4; ++i) moved.next_q[i] = state_.q[i][at];
}

void LaneEngine::hold(int slot, int object, const Pose& X_now, const Pose& X_next) {
  set_motion(slot, object, LaneMotion::kHeld);
  ways_[place_of(object, slot)] = {X_now, X_next};
  lead_held(slot, object, 0, kStepParts);
}

/// From where to where it is led in these parts of the step.
void LaneEngine::lead_held(int slot, int object, int from, int to) {
  const int at = state_.at(object, slot);
  const double dt = scene_->options.step;
  const auto& [X_now, X_next] = ways_[static_cast<std::size_t>(at)];
  set_pose(slot, object, pose_after(X_now, X_next, to));
  Moved& moved = moved_[static_cast<std::size_t>(at)];
  for (std::size_t i = 0; i < 3; ++i) moved.next_p[i] = state_.p[i][at];
  for (std::size_t i = 0; i < 4; ++i) moved.next_q[i] = state_.q[i][at];
  const Pose X_WO = pose_after(X_now, X_next, from);
  set_pose(slot, object, X_WO);
  const Vector3d spin = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt;
  const Quaterniond R_WP = X_WO.rotation * scene_->R_OP[static_cast<std::size_t>(object)];
  const Vector3d arm = R_WP * vector_at(state_.com, at);
  set_vector(state_.v, at, (X_next.translation - X_now.translation) / dt + spin.cross(arm));
  set_vector(state_.w, at, spin);
}

/// What hands move, for these parts of the step.
void LaneEngine::lead(int slot, int from, int to) {
  for (int object = 0; object < objects(); ++object)
    if (motion(slot, object) == LaneMotion::kHeld) lead_held(slot, object, from, to);
  for (int body = objects(); body < static_cast<int>(scene_->lanes.bodies.size()); ++body) {
    const int at = state_.at(body, slot);
    if (present_[kinematic_of(body, slot)] == 0 || !(state_.travel[at] > 0)) continue;
    const auto& [X_now, X_next] = ways_[static_cast<std::size_t>(at)];
    set_place(slot, body, pose_after(X_now, X_next, from));
  }
}

void LaneEngine::arrive(int slot, int object) {
  const int at = state_.at(object, slot);
  const Moved& moved = moved_[static_cast<std::size_t>(at)];
  for (std::size_t i = 0; i < 3; ++i) state_.p[i][at] = moved.next_p[i];
  for (std::size_t i = 0; i < 4; ++i) state_.q[i][at] = moved.next_q[i];
}

void LaneEngine::release(int slot, int object, const Pose& X_WO, const geometry::Twist& V_WO) {
  const int at = state_.at(object, slot);
  set_pose(slot, object, X_WO);
  const Quaterniond R_WP = X_WO.rotation * scene_->R_OP[static_cast<std::size_t>(object)];
  set_vector(state_.v, at, V_WO.linear + V_WO.angular.cross(R_WP * vector_at(state_.com, at)));
  set_vector(state_.w, at, V_WO.angular);
  state_.lag[at] = state_.owed[at] = Real(0);
  set_motion(slot, object, LaneMotion::kFree);
  Moved& moved = moved_[static_cast<std::size_t>(at)];
  for (const int body : scene_->robot_bodies) {
    if (body >= 0) moved.parting |= std::uint64_t{1} << body;
  }
}

void LaneEngine::strike(int slot, int object, double mass, const Vector3d& impulse, const Vector3d& turn,
                        double within) {
  if (motion(slot, object) == LaneMotion::kAsleep) set_motion(slot, object, LaneMotion::kFree);
  if (!free(slot, object)) return;
  const int at = state_.at(object, slot);
  const auto& moments = scene_->lanes.bodies[static_cast<std::size_t>(object)].unit_moments;
  const Quaterniond R_WP = rotation(slot, object);
  const Vector3d spin_P = (R_WP.conjugate() * turn).cwiseQuotient(mass * Vector3d(moments[0], moments[1], moments[2]));
  const auto& g = scene_->lanes.settings.gravity;
  const Vector3d v = vector_at(state_.v, at) + static_cast<double>(state_.owed[at]) * Vector3d(g[0], g[1], g[2]);
  state_.lag[at] = state_.owed[at] = Real(0);
  set_vector(state_.v, at, v + impulse / mass);
  if (within > 0.0) set_vector(state_.p, at, vector_at(state_.p, at) - 0.5 * within * impulse / mass);
  set_vector(state_.w, at, vector_at(state_.w, at) + R_WP * spin_P);
}

void LaneEngine::turn_with(int slot, int object, const Vector3d& w_WO) {
  if (free(slot, object)) set_vector(state_.w, state_.at(object, slot), w_WO);
}

void LaneEngine::freeze(int slot, int object) {
  const int at = state_.at(object, slot);
  for (std::size_t i = 0; i < 3; ++i) state_.v[i][at] = state_.w[i][at] = Real(0);
  set_motion(slot, object, LaneMotion::kFrozen);
}

void LaneEngine::set_place(int slot, int body, const Pose& X_WB) {
  const int at = state_.at(body, slot);
  const auto& origin = scene_->lanes.origin;
  set_vector(state_.p, at, X_WB.translation - Vector3d(origin[0], origin[1], origin[2]));
  const geometry::Matrix3d R = X_WB.rotation.toRotationMatrix();
  for (int i = 0; i < 9; ++i) state_.R[static_cast<std::size_t>(i)][at] = static_cast<Real>(R(i / 3, i % 3));
}

void LaneEngine::place(int slot, int body, const Pose& X_now, const Pose& X_next) {
  const int at = state_.at(body, slot);
  const double dt = scene_->options.step;
  ways_[static_cast<std::size_t>(at)] = {X_now, X_next};
  set_place(slot, body, X_now);
  const Vector3d velocity = (X_next.translation - X_now.translation) / dt;
  const Vector3d spin = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt;
  set_vector(state_.v, at, velocity);
  set_vector(state_.w, at, spin);
  const double radius = scene_->lanes.bodies[static_cast<std::size_t>(body)].radius;
  state_.travel[at] = static_cast<Real>(dt * (velocity.norm() + spin.norm() * radius));
  present_[kinematic_of(body, slot)] = 1;
}

void LaneEngine::nudge(int slot, int object, const Vector3d& axis_W, double angle) {
  const int at = state_.at(object, slot);
  set_rotation(state_.q, at, (geometry::exp_rotation(angle * axis_W) * rotation(slot, object)).normalized());
  for (std::size_t i = 0; i < 3; ++i) state_.v[i][at] = state_.w[i][at] = Real(0);
  state_.lag[at] = state_.owed[at] = Real(0);
}

}  // namespace prescene::simulation
