// SPDX-License-Identifier: Apache-2.0
#include "lane_engine.h"

#include <algorithm>
#include <cmath>

#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

using geometry::Pose;
using geometry::Quaterniond;

Vector3d vector_at(const Rows<3>& rows, int at) {
  return {static_cast<double>(rows[0][at]), static_cast<double>(rows[1][at]), static_cast<double>(rows[2][at])};
}

void set_vector(const Rows<3>& rows, int at, const Vector3d& value) {
  for (std::size_t i = 0; i < 3; ++i) rows[i][at] = static_cast<Real>(value[static_cast<Eigen::Index>(i)]);
}

void set_rotation(const Rows<4>& rows, int at, const Quaterniond& q) {
  rows[0][at] = static_cast<Real>(q.w());
  rows[1][at] = static_cast<Real>(q.x());
  rows[2][at] = static_cast<Real>(q.y());
  rows[3][at] = static_cast<Real>(q.z());
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
  present_.resize(most * lanes.bodies.size() - of_objects);
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
  for (int body = 0; body < static_cast<int>(scene_->lanes.bodies.size()); ++body) {
    const int a = state_.at(body, from);
    const int b = state_.at(body, to);
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
  const int at = state_.at(object, slot);
  const double dt = scene_->options.step;
  set_motion(slot, object, LaneMotion::kHeld);
  set_pose(slot, object, X_next);
  Moved& moved = moved_[static_cast<std::size_t>(at)];
  for (std::size_t i = 0; i < 3; ++i) moved.next_p[i] = state_.p[i][at];
  for (std::size_t i = 0; i < 4; ++i) moved.next_q[i] = state_.q[i][at];
  set_pose(slot, object, X_now);
  const Vector3d spin = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt;
  const Quaterniond R_WP = X_now.rotation * scene_->R_OP[static_cast<std::size_t>(object)];
  const Vector3d arm = R_WP * vector_at(state_.com, at);
  set_vector(state_.v, at, (X_next.translation - X_now.translation) / dt + spin.cross(arm));
  set_vector(state_.w, at, spin);
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

void LaneEngine::place(int slot, int body, const Pose& X_now, const Pose& X_next) {
  const int at = state_.at(body, slot);
  const double dt = scene_->options.step;
  const auto& origin = scene_->lanes.origin;
  set_vector(state_.p, at, X_now.translation - Vector3d(origin[0], origin[1], origin[2]));
  const geometry::Matrix3d R = X_now.rotation.toRotationMatrix();
  for (int i = 0; i < 9; ++i) state_.R[static_cast<std::size_t>(i)][at] = static_cast<Real>(R(i / 3, i % 3));
  const Vector3d velocity = (X_next.translation - X_now.translation) / dt;
  const Vector3d spin = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt;
  set_vector(state_.v, at, velocity);
  set_vector(state_.w, at, spin);
  const double radius = scene_->lanes.bodies[static_cast<std::size_t>(body)].radius;
  state_.travel[at] = static_cast<Real>(dt * (velocity.norm() + spin.norm() * radius));
  present_[kinematic_of(body, slot)] = 1;
}

void LaneEngine::guide(std::span<const std::uint8_t> wanted) {
  const auto dt = static_cast<Real>(scene_->options.step);
  for (int object = 0; object < objects(); ++object) {
    for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
      const int at = state_.at(object, slot);
      const Moved& moved = moved_[static_cast<std::size_t>(at)];
      if (moved.motion == LaneMotion::kFree) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        state_.flown_p[i][at] = moved.next_p[i];
        state_.flown_v[i][at] = state_.v[i][at];
        state_.flown_w[i][at] = state_.w[i][at];
      }
      for (std::size_t i = 0; i < 4; ++i) state_.flown_q[i][at] = moved.next_q[i];
      const Vector3d com = vector_at(state_.com, at);
      const double radius = scene_->lanes.bodies[static_cast<std::size_t>(object)].radius + com.norm();
      state_.travel[at] =
          dt * static_cast<Real>(vector_at(state_.v, at).norm() + vector_at(state_.w, at).norm() * radius);
    }
  }
}

/// Lists the slots in which an object and another body may touch. Returns whether there are any.
bool LaneEngine::list_pair(int object, int body, std::span<const std::uint8_t> wanted) {
  const bool with_object = body >= 0 && body < objects();
  listed_.assign(wanted.begin(), wanted.end());
  std::uint8_t any = 0;
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    const LaneMotion a = motion(slot, object);
    bool meets = a == LaneMotion::kFree;
    if (with_object) {
      const LaneMotion b = motion(slot, body);
      meets = (meets || b == LaneMotion::kFree) && a != LaneMotion::kFrozen && b != LaneMotion::kFrozen;
    } else if (body >= 0) {
      meets = meets && present_[kinematic_of(body, slot)] != 0;
    }
    std::uint8_t& listed = listed_[static_cast<std::size_t>(slot)];
    listed = listed != 0 && meets ? 1 : 0;
    any |= listed;
  }
  return any != 0;
}

void LaneEngine::touch_objects(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  const auto& parts = lanes.bodies[static_cast<std::size_t>(object)].parts;
  for (int other = object + 1; other < objects(); ++other) {
    if (!list_pair(object, other, wanted)) continue;
    const auto first = static_cast<std::size_t>(lanes.first_part[static_cast<std::size_t>(other)]);
    const std::size_t last = first + lanes.bodies[static_cast<std::size_t>(other)].parts.size();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = first; j < last; ++j) pairs_.shapes[j].clear();
      find_body_pairs(lanes, {object, static_cast<int>(i), listed_}, other, state_, pairs_);
      for (std::size_t j = first; j < last; ++j) {
        touch_part(parts[i], j);
      }
    }
  }
}

/// The pairs of a part with another one.
void LaneEngine::touch_part(const ConvexPart& part, std::size_t other) {
  if (pairs_.shapes[other].empty()) return;
  const LockstepScene& lanes = scene_->lanes;
  const bool spheres = part.spheres || lanes.part_of(lanes.parts[other]).spheres;
  if (spheres) {
    touch_spheres(lanes, part, static_cast<int>(other), pairs_.shapes[other], state_, spheres_);
  } else {
    touch_shape(lanes, part, static_cast<int>(other), pairs_.shapes[other], state_);
  }
}

void LaneEngine::touch_surroundings(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  const auto& parts = lanes.bodies[static_cast<std::size_t>(object)].parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!list_pair(object, -1, wanted)) return;
    pairs_.planes.clear();
    pairs_.boxes.clear();
    for (auto& list : pairs_.shapes) list.clear();
    find_pairs(lanes, {object, static_cast<int>(i), listed_}, state_, pairs_);
    for (int body = objects(); body < static_cast<int>(lanes.bodies.size()); ++body) {
      if (!list_pair(object, body, wanted)) continue;
      find_body_pairs(lanes, {object, static_cast<int>(i), listed_}, body, state_, pairs_);
    }
    if (parts[i].spheres) {
      // Of a face or about an edge: the spheres see which.
      for (const LanePairs::Plane& plane : pairs_.planes)
        pairs_.boxes.push_back({plane.object, lanes.planes[static_cast<std::size_t>(plane.plane)].part});
      for (const LanePairs::Near& box : pairs_.boxes)
        touch_spheres(lanes, parts[i], box.other, std::span(&box, 1), state_, spheres_);
    } else {
      touch_planes(lanes, parts[i], pairs_.planes, state_);
      touch_boxes(lanes, parts[i], pairs_.boxes, state_);
    }
    for (std::size_t j = 0; j < pairs_.shapes.size(); ++j) touch_part(parts[i], j);
  }
}

/// What came free inside of what held it does not touch that until they have parted.
void LaneEngine::part(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    const std::size_t place = place_of(object, slot);
    std::uint64_t& parting = moved_[place].parting;
    if (!wanted[static_cast<std::size_t>(slot)] || parting == 0) continue;
    LaneContact* contacts = state_.contacts(state_.at(object, slot));
    int& count = state_.contact_count[place];
    for (int body = objects(); body < static_cast<int>(lanes.bodies.size()); ++body) {
      const std::uint64_t bit = std::uint64_t{1} << body;
      if (!(parting & bit)) continue;
      const auto with_body = [&](const LaneContact& c) {
        return lanes.parts[static_cast<std::size_t>(c.part)].body == body;
      };
      const bool overlap =
          std::any_of(contacts, contacts + count, [&](const LaneContact& c) { return with_body(c) && c.gap <= 0; });
      if (overlap) {
        count = static_cast<int>(std::remove_if(contacts, contacts + count, with_body) - contacts);
      } else {
        parting &= ~bit;
      }
    }
  }
}

void LaneEngine::fly_all(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) fly(scene_->lanes, object, wanted, state_);
  guide(wanted);
}

void LaneEngine::touch_all(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) {
    touch_objects(object, wanted);
    touch_surroundings(object, wanted);
    if (scene_->lanes.has_kinematic()) part(object, wanted);
  }
}

void LaneEngine::find_contacts(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) {
    std::fill_n(state_.contact_count.begin() + state_.at(object, 0), wanted.size(), 0);
    std::fill_n(state_.dropped_count.begin() + state_.at(object, 0), wanted.size(), 0);
  }
  fly_and_touch(wanted);
}

void LaneEngine::end_part(std::span<const std::uint8_t> wanted) {
  const auto count = static_cast<int>(wanted.size());
  touching_.clear();
  flying_.clear();
  totals_.assign(wanted.size(), 0);
  // By the number of contacts, most first, so that slots that share a vector have about as many.
  std::fill(starts_.begin(), starts_.end(), 0);
  const int most = state_.room() * objects();
  std::size_t touching = 0;
  for (int slot = 0; slot < count; ++slot) {
    if (!wanted[static_cast<std::size_t>(slot)]) continue;
    int& total = totals_[static_cast<std::size_t>(slot)];
    for (int object = 0; object < objects(); ++object) total += state_.contact_count[place_of(object, slot)];
    if (total == 0) {
      for (int object = 0; object < objects(); ++object) {
        state_.warm_count[place_of(object, slot)] = 0;
        flying_.push_back(state_.at(object, slot));
      }
    } else {
      ++starts_[static_cast<std::size_t>(most - total) + 1];
      ++touching;
    }
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  touching_.resize(touching);
  for (int slot = 0; slot < count; ++slot) {
    const int total = totals_[static_cast<std::size_t>(slot)];
    if (total == 0) continue;
    touching_[static_cast<std::size_t>(starts_[static_cast<std::size_t>(most - total)]++)] = slot;
  }
  solve(scene_->lanes, touching_, state_, scratch_);
  land(flying_, state_);
  keep_places(wanted);
}

bool LaneEngine::diverged(int slot) const {
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    const Real q = state_.q[0][at] + state_.q[1][at] + state_.q[2][at] + state_.q[3][at];
    const bool sound = std::isfinite(state_.distance2[at]) && std::isfinite(q) &&
                       static_cast<double>(state_.speed2[at]) < kLargestSpeed * kLargestSpeed;
    if (!sound) return true;
  }
  return false;
}

void LaneEngine::nudge(int slot, int object, const Vector3d& axis_W, double angle) {
  const int at = state_.at(object, slot);
  set_rotation(state_.q, at, (geometry::exp_rotation(angle * axis_W) * rotation(slot, object)).normalized());
  for (std::size_t i = 0; i < 3; ++i) state_.v[i][at] = state_.w[i][at] = Real(0);
  state_.lag[at] = state_.owed[at] = Real(0);
}

}  // namespace prescene::simulation
