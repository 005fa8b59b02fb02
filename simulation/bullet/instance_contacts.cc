// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: which bodies touch in a step, and what that does to them.
#include <algorithm>
#include <cmath>

#include "instance_world.h"
#include "prescene/belief/body_names.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/rules/sphere_rules.h"

namespace prescene::simulation {
namespace {

// A step with more contacts may take seconds: whether it is cancelled is looked at on the way.
constexpr std::size_t kManyContacts = 256;

}  // namespace

InstanceWorld::Bounds InstanceWorld::parts_box(int index, const Frame& X_WO) const {
  Bounds box{Vector3d::Constant(1e30), Vector3d::Constant(-1e30)};
  const Matrix3d absolute = X_WO.R.cwiseAbs();
  for (const Part& part : compiled(index).parts) {
    const Vector3d center = X_WO * part.box_center;
    const Vector3d half = absolute * part.box_half_size;
    box.low = box.low.cwiseMin(center - half);
    box.high = box.high.cwiseMax(center + half);
  }
  return box;
}

void InstanceWorld::sweep(int index) {
  Moving& m = moving_[static_cast<std::size_t>(index)];
  const CompiledBody& body = compiled(index);
  const Bounds box = parts_box(index, m.X_WO);
  m.low = box.low;
  m.high = box.high;
  const double speed = std::max((m.velocity + m.fall).norm(), m.velocity_before.norm());
  const double spin = std::max(m.spin.norm(), m.spin_after.norm());
  m.travel = part_ * (speed + spin * (body.radius + (m.p_WCm - m.X_WO.p).norm()));
  const Vector3d swell = Vector3d::Constant(m.travel + 0.5 * kContactMargin);
  m.low -= swell;
  m.high += swell;
}

bool InstanceWorld::find_contacts(const core::Cancellation* cancellation) {
  contacts_.clear();
  contact_keys_.clear();
  const int count = body_count();
  for (int a = 0; a < scene_->object_count; ++a) {
    const Moving& ma = moving_[static_cast<std::size_t>(a)];
    if (!ma.present) continue;
    if (cancellation && contacts_.size() >= kManyContacts && cancellation->requested()) return false;
    for (int b = a + 1; b < count; ++b) {
      const Moving& mb = moving_[static_cast<std::size_t>(b)];
      if (!mb.present || !(ma.dynamic || mb.dynamic)) continue;
      if ((ma.low.array() > mb.high.array()).any() || (mb.low.array() > ma.high.array()).any()) continue;
      if (!scene_->joints.empty() && scene_->are_jointed(a, b)) continue;
      find_pair(a, b);
    }
  }
  return true;
}

void InstanceWorld::find_parts(const Part& part_a, const Moving& ma, const Part& part_b, const Moving& mb,
                               double range) {
  const Frame X_WA = ma.X_WO * part_a.X_OS;
  const Frame X_WB = mb.X_WO * part_b.X_OS;
  if (part_a.core && part_b.core) return finder_.convex_convex(*part_a.core, X_WA, *part_b.core, X_WB, range, points_);
  if (part_a.core && part_b.surface)
    return finder_.convex_surface(*part_a.core, X_WA, *part_b.surface, X_WB, range, points_);
  const MovingFrame a{X_WA, {ma.p_WCm, ma.velocity, ma.spin}};
  const MovingFrame b{X_WB, {mb.p_WCm, mb.velocity, mb.spin}};
  if (part_a.spheres && part_b.spheres)
    return sphere_finder_.spheres_spheres(*part_a.spheres, a, *part_b.spheres, b, range, part_, points_);
  if (part_a.spheres && part_b.surface)
    return sphere_finder_.spheres_surface(*part_a.spheres, a, *part_b.surface, b, range, part_, points_);
  if (part_a.spheres) return sphere_finder_.spheres_convex(*part_a.spheres, a, *part_b.core, b, range, part_, points_);
  sphere_finder_.spheres_convex(*part_b.spheres, b, *part_a.core, a, range, part_, points_);
  for (ContactPoint& point : points_) point.normal = -point.normal;
}

void InstanceWorld::find_pair(int a, int b) {
  const Moving& ma = moving_[static_cast<std::size_t>(a)];
  const Moving& mb = moving_[static_cast<std::size_t>(b)];
  const CompiledBody& body_a = compiled(a);
  const CompiledBody& body_b = compiled(b);
  const double range = ma.travel + mb.travel + kContactMargin;
  const std::size_t first = contacts_.size();
  for (std::uint32_t i = 0; i < body_a.parts.size(); ++i) {
    const Part& part_a = body_a.parts[i];
    if (part_a.surface) continue;  // surfaces never move by themselves and never meet each other
    const Vector3d center_a = ma.X_WO * part_a.box_center;
    const Vector3d half_a = ma.X_WO.R.cwiseAbs() * part_a.box_half_size + Vector3d::Constant(range);
    for (std::uint32_t j = 0; j < body_b.parts.size(); ++j) {
      const Part& part_b = body_b.parts[j];
      const Vector3d center_b = mb.X_WO * part_b.box_center;
      const Vector3d half_b = mb.X_WO.R.cwiseAbs() * part_b.box_half_size;
      if (((center_a - center_b).cwiseAbs().array() > (half_a + half_b).array()).any()) continue;
      points_.clear();
      find_parts(part_a, ma, part_b, mb, range);
      add_contacts(a, b, i, j);
    }
  }
  const int robot = b - scene_->robot_body(0);
  if (robot < 0 || robot >= scene_->robot_count) return;
  std::uint8_t& parting = parting_[static_cast<std::size_t>(a * scene_->robot_count + robot)];
  if (!parting) return;
  const bool overlap = std::any_of(contacts_.begin() + static_cast<std::ptrdiff_t>(first), contacts_.end(),
                                   [](const SolverContact& c) { return c.gap <= 0.0; });
  if (overlap) {
    contacts_.resize(first);
    contact_keys_.resize(first);
  } else {
    parting = 0;
  }
}

void InstanceWorld::add_contacts(int a, int b, std::uint32_t part_a, std::uint32_t part_b) {
  if (points_.empty()) return;
  const Moving& ma = moving_[static_cast<std::size_t>(a)];
  const Moving& mb = moving_[static_cast<std::size_t>(b)];
  const auto surface_of = [&](int body) {
    SurfaceCoefficients surface = compiled(body).surface;
    if (body >= scene_->object_count) return surface;
    const auto& drawn = objects_[static_cast<std::size_t>(body)].physical;
    surface.friction = drawn.friction;
    surface.impact_friction = drawn.impact_friction;
    surface.restitution = drawn.restitution;
    return surface;
  };
  const SurfaceCoefficients pair = pair_of(surface_of(a), surface_of(b));
  const std::uint64_t key = (static_cast<std::uint64_t>(a) << 48) | (static_cast<std::uint64_t>(b) << 32) |
                            (static_cast<std::uint64_t>(part_a & 0xffffu) << 16) | (part_b & 0xffffu);
  const std::size_t first = contacts_.size();
  for (const ContactPoint& point : points_) {
    SolverContact c;
    c.body_a = a;
    c.body_b = b;
    c.position = point.position;
    c.normal = point.normal;
    c.gap = point.gap;
    c.friction = pair.friction;
    c.impact_friction = pair.impact_friction;
    c.restitution = pair.restitution;
    c.rolling_arm = pair.rolling_arm;
    c.turning = point.turning;
    c.speed_before = point.normal.dot(ma.velocity_before + ma.spin_before.cross(point.position - ma.p_WCm) -
                                      mb.velocity_before - mb.spin_before.cross(point.position - mb.p_WCm)) +
                     point.turning;
    contacts_.push_back(c);
    contact_keys_.push_back(key);
  }
  // A contact moves on its bodies by what they slide in a step.
  inherit(first, key, ma.travel + mb.travel + kSameContact);
}

/// Impulses of the step before, to the contacts from `first` on. Each goes to the one that is nearest to where it acted
/// among those that bear (kBearing), and to no other: what bore is borne once.
void InstanceWorld::inherit(std::size_t first, std::uint64_t key, double reach) {
  const Frame& X_WB = moving_[static_cast<std::size_t>(contacts_[first].body_b)].X_WO;
  for (const Warm& warm : warm_) {
    if (warm.key != key) continue;
    const Vector3d position = X_WB * warm.position;
    std::size_t heir = contacts_.size();
    double nearest = reach * reach;
    for (std::size_t i = first; i < contacts_.size(); ++i) {
      const SolverContact& c = contacts_[i];
      const double distance = (c.position - position).squaredNorm();
      if (distance >= nearest || c.gap + part_ * std::min(0.0, c.speed_before) > kBearing) continue;
      nearest = distance;
      heir = i;
    }
    if (heir == contacts_.size()) continue;
    contacts_[heir].impulse += warm.impulse;
    contacts_[heir].friction_impulse += warm.friction_impulse;
  }
}

/// By how much the normal velocity that a contact acts on differs from that before, while nothing presses, m/s.
double InstanceWorld::free_change(const SolverContact& c) const {
  const Moving& a = moving_[static_cast<std::size_t>(c.body_a)];
  const Moving& b = moving_[static_cast<std::size_t>(c.body_b)];
  return c.normal.dot(a.velocity - a.velocity_before - b.velocity + b.velocity_before);
}

/// How fast the normal velocity of a contact grows while nothing presses, m/s^2.
double InstanceWorld::free_acceleration(const SolverContact& c) const {
  const auto falls = [&](int body) { return moving_[static_cast<std::size_t>(body)].dynamic ? 1.0 : 0.0; };
  if (any_loaded_) {
    const auto pulled = [&](int body) {
      const bool moves = moving_[static_cast<std::size_t>(body)].dynamic;
      return moves ? pull_on(objects_[static_cast<std::size_t>(body)]) : Vector3d(Vector3d::Zero());
    };
    return c.normal.dot(pulled(c.body_a) - pulled(c.body_b));
  }
  return (falls(c.body_a) - falls(c.body_b)) * c.normal.dot(scene_->scene.gravity_W);
}

void InstanceWorld::fill_bodies() {
  const auto count = static_cast<std::size_t>(body_count());
  for (std::size_t i = 0; i < count; ++i) {
    const Moving& m = moving_[i];
    btRigidBody& body = *rigid_[i];
    const bool fixed = !m.dynamic && m.velocity.isZero(0.0) && m.spin.isZero(0.0);
    const CompiledBody& shape = compiled(static_cast<int>(i));
    if (m.dynamic) {
      const double mass = objects_[i].physical.mass;
      body.setMassProps(mass, to_bullet(mass * shape.unit_moments));
      body.setCollisionFlags(0);
    } else {
      body.setMassProps(0.0, btVector3(0, 0, 0));
      body.setCollisionFlags(fixed ? btCollisionObject::CF_STATIC_OBJECT : btCollisionObject::CF_KINEMATIC_OBJECT);
    }
    body.setWorldTransform(to_bullet(m.dynamic ? Matrix3d(m.X_WO.R * shape.R_OP) : m.X_WO.R, m.p_WCm));
    body.setLinearVelocity(to_bullet(m.velocity));
    body.setAngularVelocity(to_bullet(m.spin));
    body.updateInertiaTensor();
  }
  for (std::size_t i = count; i < rigid_pointers_.size(); ++i) {  // the world
    rigid_[i]->setMassProps(0.0, btVector3(0, 0, 0));
    rigid_[i]->setCollisionFlags(btCollisionObject::CF_STATIC_OBJECT);
    rigid_[i]->setWorldTransform(btTransform::getIdentity());
    rigid_[i]->setLinearVelocity(btVector3(0, 0, 0));
    rigid_[i]->setAngularVelocity(btVector3(0, 0, 0));
    rigid_[i]->updateInertiaTensor();
  }
}

/// What a contact hits starts from its velocity as the step begins: what bore it since the middle of the step before
/// may let it go, and has done its share until then.
void InstanceWorld::note_struck() {
  for (Moving& m : moving_) m.struck = false;
  for (SolverContact& c : contacts_) {
    const Moving& a = moving_[static_cast<std::size_t>(c.body_a)];
    const Moving& b = moving_[static_cast<std::size_t>(c.body_b)];
    c.fall = c.normal.dot(a.fall - b.fall);
    c.acceleration = free_acceleration(c);
    c.hit = closes(c, part_) && c.speed_before < -settings_.restitution_speed;
    if (!c.hit) continue;
    for (const int body : {c.body_a, c.body_b}) moving_[static_cast<std::size_t>(body)].struck = true;
  }
  for (std::size_t i = 0; i < objects_.size(); ++i)
    if (moving_[i].struck && moving_[i].dynamic) begin_anew(i);
  for (SolverContact& c : contacts_) {
    // A guess, never more than it was: an impact that something at rest bore was as much in a part of a step.
    const double pulled = std::max(moving_[static_cast<std::size_t>(c.body_a)].pulled,
                                   moving_[static_cast<std::size_t>(c.body_b)].pulled);
    const double share = std::min(1.0, pulled / dt());
    c.impulse *= share;
    c.friction_impulse *= share;
  }
}

bool InstanceWorld::solve(const core::Cancellation* cancellation) {
  // What stays open throughout, the solver would leave as it is.
  const auto stays_open = [&](const SolverContact& c) {
    const double speed = c.speed_before - c.turning + free_change(c);
    return c.gap > 0.0 && c.impulse == 0.0 && c.gap + part_ * speed > 0.0;
  };
  note_struck();
  list_joints();
  if (joints_.empty() && std::all_of(contacts_.begin(), contacts_.end(), stays_open)) {
    for (BodyResult& result : results_) result = BodyResult{};
    warm_.clear();
    return true;
  }
  settings_.overlap_recovery = share() * scene_->options.overlap_recovery;
  const bool many = contacts_.size() >= kManyContacts;
  if (!solve_with_joints(many ? cancellation : nullptr)) return false;
  warm_.clear();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const SolverContact& c = contacts_[i];
    if (c.impulse <= 0.0 || c.hit) continue;
    warm_.push_back({contact_keys_[i], moving_[static_cast<std::size_t>(c.body_b)].X_WO.inverse_times(c.position),
                     c.impulse, c.friction_impulse});
  }
  return true;
}

void InstanceWorld::note_overlap() {
  overlap_ = 0.0;
  if (steps_ > 0 && released_.empty()) return;
  for (const SolverContact& c : contacts_) overlap_ = std::max(overlap_, -c.gap);
}

void InstanceWorld::note_touches() {
  touches_.clear();
  const Vector3d up = belief::up_of(scene_->scene);
  Vector3d normal = Vector3d::Zero();
  const auto close = [&] {
    const double norm = normal.norm();
    if (!touches_.empty()) touches_.back().normal_z = norm > 0.0 ? up.dot(normal) / norm : 0.0;
    normal.setZero();
  };
  // Contacts of a pair lie together, and pairs ascend.
  for (const SolverContact& c : contacts_) {
    if (c.impulse <= 0.0 && c.gap > scene_->options.touching_distance) continue;
    if (touches_.empty() || touches_.back().first != c.body_a || touches_.back().second != c.body_b) {
      close();
      touches_.push_back({c.body_a, c.body_b, 0.0, 0.0});
    }
    touches_.back().impulse += c.impulse;
    // The mean is weighted by impulse; touching without pressing counts only where nothing presses.
    normal += std::max(c.impulse, 1e-12) * c.normal;
  }
  close();
}

}  // namespace prescene::simulation
