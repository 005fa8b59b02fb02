// SPDX-License-Identifier: Apache-2.0
#include "instance_world.h"

#include <algorithm>
#include <cmath>

#include "body_motion.h"
#include "prescene/core/check.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/rules/impact_split.h"

namespace prescene::simulation {
namespace {

constexpr std::size_t kTypicalContacts = 64;

std::unique_ptr<btRigidBody> make_rigid_body() {
  btRigidBody::btRigidBodyConstructionInfo info(0.0, nullptr, nullptr);
  auto body = std::make_unique<btRigidBody>(info);
  body->setFlags(0);  // no gyroscopic term of Bullet's: place_dynamic() has a better one
  return body;
}

}  // namespace

InstanceWorld::InstanceWorld(std::shared_ptr<const CompiledScene> scene)
    : scene_(std::move(scene)), player_(scene_->scene) {
  set_part(kStepParts);
  const BulletOptions& options = scene_->options;
  settings_.iterations = options.solver_iterations;
  settings_.converged = options.solver_accuracy;
  settings_.restitution_speed = options.restitution_speed;
  settings_.impact_speed = options.impact_speed;
  contacts_.reserve(kTypicalContacts);
  pressed_.reserve(kTypicalContacts);
  contact_keys_.reserve(kTypicalContacts);
  warm_.reserve(kTypicalContacts);
  points_.reserve(kTypicalContacts);
  for (int i = 0; i < scene_->support_count; ++i) {
    const CompiledBody& body = scene_->bodies[static_cast<std::size_t>(scene_->object_count + i)];
    const Frame X_WS(body.X_WO);
    for (const Part& part : body.parts) {
      const Vector3d center = X_WS * part.box_center;
      const Vector3d half = X_WS.R.cwiseAbs() * part.box_half_size + Vector3d::Constant(kContactMargin);
      fixed_parts_.push_back({center - half, center + half});
    }
  }
}

const CompiledBody& InstanceWorld::compiled(int body) const {
  const auto count = static_cast<int>(scene_->bodies.size());
  return body < count ? scene_->bodies[static_cast<std::size_t>(body)]
                      : pushers_[static_cast<std::size_t>(body - count)];
}

void InstanceWorld::reset(const belief::WorldState& given_start, const std::vector<belief::Action>& actions,
                          core::RandomStream stream) {
  PRESCENE_CHECK(static_cast<int>(given_start.objects.size()) == scene_->object_count);
  belief::WorldState on_joints;
  if (!scene_->joints.empty()) {
    on_joints = given_start;
    belief::obey_joints(scene_->scene, on_joints);
  }
  const belief::WorldState& start = scene_->joints.empty() ? given_start : on_joints;
  start_time_ = start.time;
  steps_ = 0;
  warm_.clear();
  contacts_.clear();
  contact_keys_.clear();
  touches_.clear();
  any_loaded_ = false;
  player_.reset(actions, start, stream);
  objects_.assign(start.objects.size(), Object{});
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const belief::ObjectState& given = start.objects[i];
    Object& object = objects_[i];
    object.R_WO = given.X_WO.rotation.normalized();
    object.physical = given.physical;
    const Vector3d arm = object.R_WO * given.physical.center_of_mass;
    object.p_WCm = given.X_WO.translation + arm;
    object.w_WO = given.V_WO.angular;
    object.v_WCm = given.V_WO.linear + given.V_WO.angular.cross(arm);
    object.held = player_.kinematic(static_cast<int>(i));
  }
  hinged_.assign(scene_->joints.size(), Hinged{});
  jointed_.assign(objects_.size(), 0);
  for (std::size_t j = 0; j < hinged_.size(); ++j) {
    hinged_[j].drawn = belief::parameters_of(scene_->scene, start, static_cast<int>(j));
    const CompiledJoint& joint = scene_->joints[j];
    jointed_[static_cast<std::size_t>(joint.child)] = 1;
    if (joint.parent >= 0 && joint.parent < scene_->object_count) jointed_[static_cast<std::size_t>(joint.parent)] = 1;
  }
  parting_.assign(objects_.size() * static_cast<std::size_t>(scene_->robot_count), 0);
  pushers_.clear();
  for (int i = 0; i < player_.pusher_count(); ++i) {
    CompiledBody body;
    body.name = "pusher";
    Part part;
    part.core = ConvexCore::from_primitive(geometry::Sphere{player_.pusher_radius(i)}, scene_->options.edge_rounding);
    part.box_center = Vector3d::Zero();
    part.box_half_size = part.core->box_half_size();
    body.parts.push_back(std::move(part));
    body.radius = player_.pusher_radius(i);
    body.surface = kPusherSurface;
    pushers_.push_back(std::move(body));
  }
  const auto count = static_cast<std::size_t>(body_count());
  moving_.assign(count, Moving{});
  flights_.resize(objects_.size());
  // The last is the world, which joints may hang on.
  const std::size_t with_world = count + (scene_->joints.empty() ? 0 : 1);
  results_.resize(with_world);
  while (rigid_.size() < with_world) rigid_.push_back(make_rigid_body());
  rigid_pointers_.resize(with_world);
  for (std::size_t i = 0; i < with_world; ++i) rigid_pointers_[i] = rigid_[i].get();
  for (int i = 0; i < scene_->support_count; ++i) {
    const auto body = static_cast<std::size_t>(scene_->object_count + i);
    moving_[body].X_WO = Frame(scene_->bodies[body].X_WO);
    moving_[body].p_WCm = moving_[body].X_WO.p;
    sweep(static_cast<int>(body));
  }
}

double InstanceWorld::time() const { return start_time_ + static_cast<double>(steps_) * dt(); }

Pose InstanceWorld::object_pose(const Object& object) const {
  return {object.R_WO, object.p_WCm - object.R_WO * object.physical.center_of_mass};
}

bool InstanceWorld::step(const core::Cancellation* cancellation) {
  run_actions();
  place_kinematic();
  place_dynamic();
  if (!find_contacts(cancellation)) return false;
  note_overlap();
  const bool done = take_parts(cancellation);
  set_part(kStepParts);
  if (!done) return false;
  ++steps_;
  note_touches();
  note_calm();
  return true;
}

void InstanceWorld::place_dynamic() {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Object& object = objects_[i];
    Moving& m = moving_[i];
    m.present = !object.frozen;
    if (object.held || object.frozen) continue;
    flights_[i] = flight_of(object, scene_->bodies[i]);
    const Flight& flight = flights_[i];
    m.dynamic = true;
    m.X_WO = Frame(object_pose(object));
    m.p_WCm = object.p_WCm;
    begin_anew(i);
    if (object.lag > 0.0 && !object.loaded) {
      m.pulled = object.lag + 0.5 * part_;
      m.velocity = object.v_middle + m.pulled * scene_->scene.gravity_W;
      m.spin = object.w_middle;
    }
    m.spin_before = object.w_WO;
    m.velocity_before = object.v_WCm;
    m.spin_after = flight.w_WO;
    sweep(static_cast<int>(i));
  }
}

/// What contacts act on in an object's step, from its velocities as the step begins.
void InstanceWorld::begin_anew(std::size_t i) {
  const Object& object = objects_[i];
  Moving& m = moving_[i];
  // What hands and joints do is meant for the whole step; what falls is taken at the middle of it.
  const bool whole = object.loaded || jointed_[i] != 0;
  m.fall = whole ? Vector3d(Vector3d::Zero()) : Vector3d(0.5 * part_ * scene_->scene.gravity_W);
  m.velocity = flights_[i].v_WCm - m.fall;
  m.pulled = object.owed + (whole ? 1.0 : 0.5) * part_;
  // Contacts act at the step's beginning, on the spin of there: its energy is that of this pose.
  m.spin = object.loaded ? Vector3d(object.w_WO + part_ * object.spin_up) : object.w_WO;
}

/// After a step in which contacts or joints acted on an object: `spin` is its new attitude and spin.
void InstanceWorld::keep_velocity(std::size_t i, const Spin& spin, bool borne, bool hit) {
  Object& object = objects_[i];
  const Moving& m = moving_[i];
  const Vector3d middle = from_bullet(rigid_[i]->getLinearVelocity());
  object.R_WO = spin.R_WO;
  object.w_WO = spin.w_WO;
  object.v_WCm = middle;
  object.lag = object.owed = 0.0;
  if (!borne || object.loaded) {
    object.v_WCm += m.fall;
    return;
  }
  object.v_middle = middle;
  object.w_middle = spin.w_WO;
  object.lag = 0.5 * part_;
  if (hit) {
    object.owed = object.lag;
    return;
  }
  // What bears it goes on as it did since the middle of the step before.
  const double ahead = object.lag / m.pulled;
  object.v_WCm += ahead * (middle - m.velocity + m.pulled * scene_->scene.gravity_W);
  object.w_WO += ahead * (from_bullet(rigid_[i]->getAngularVelocity()) - m.spin);
}

void InstanceWorld::integrate() {
  impacts_.assign(objects_.size(), Impact{});
  for (const SolverContact& c : contacts_) {
    if (c.impulse <= 0.0) continue;
    for (const int body : {c.body_a, c.body_b}) {
      if (body >= scene_->object_count) continue;
      Impact& impact = impacts_[static_cast<std::size_t>(body)];
      impact.supported = impact.supported || !c.hit;
      impact.bounced = impact.bounced || c.bounced;
      if (c.hit) impact.time = std::min(impact.time.value_or(part_), c.hit_time);
    }
  }
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    Object& object = objects_[i];
    if (object.frozen) continue;
    if (object.held) {
      const Pose X_WO = player_.object_pose(static_cast<int>(i), time() + dt());
      object.R_WO = X_WO.rotation.normalized();
      object.p_WCm = X_WO.translation + object.R_WO * object.physical.center_of_mass;
      continue;
    }
    if (jointed_[i]) {
      integrate_jointed(static_cast<int>(i));
      continue;
    }
    const BodyResult& result = results_[i];
    const Flight& flight = flights_[i];
    if (result.touched) {
      // Up to the first hit within the step (its start if there is none) with the velocity of before, then with what
      // came out. Gravity counts within the step only while nothing holds the body up.
      const Impact& impact = impacts_[i];
      const double before = impact.time.value_or(0.0);
      const double after = part_ - before;
      const Vector3d gravity = pull_on(object);
      const bool flies_on = impact.bounced && !impact.supported;
      const Vector3d flown =
          before * (impact.supported ? object.v_WCm : Vector3d(begun(object) + 0.5 * before * gravity));
      const Vector3d middle = from_bullet(rigid_[i]->getLinearVelocity());
      const Vector3d fallen = flies_on ? Vector3d(moving_[i].fall - 0.5 * after * gravity) : Vector3d(Vector3d::Zero());
      object.p_WCm += flown + after * (middle + fallen) + part_ * result.push;
      const Vector3d w = from_bullet(rigid_[i]->getAngularVelocity());
      const CompiledBody& body = scene_->bodies[i];
      const Spin spin =
          turned(spun(object.R_WO, w, body, part_), before * (moving_[i].spin - w) + part_ * result.turn, body);
      keep_velocity(i, spin, !flies_on, impact.time.has_value());
    } else {
      object.v_WCm = flight.v_WCm;
      object.lag = object.owed = 0.0;
      object.p_WCm = flight.p_WCm + part_ * result.push;
      Spin spin{flight.R_WO, flight.w_WO};
      if (!result.turn.isZero(0.0)) spin = turned(spin, part_ * result.turn, scene_->bodies[i]);
      object.R_WO = spin.R_WO;
      object.w_WO = spin.w_WO;
    }
  }
}

void InstanceWorld::note_calm() {
  for (int i = 0; i < scene_->object_count; ++i) {
    Object& object = objects_[static_cast<std::size_t>(i)];
    object.calm_steps = free(i) && energy(i) < scene_->options.rest.energy ? object.calm_steps + 1 : 0;
  }
}

bool InstanceWorld::free(int object) const {
  const Object& o = objects_[static_cast<std::size_t>(object)];
  return !o.held && !o.frozen;
}

double InstanceWorld::energy(int object) const {
  const Object& o = objects_[static_cast<std::size_t>(object)];
  const CompiledBody& body = scene_->bodies[static_cast<std::size_t>(object)];
  return 0.5 * o.v_WCm.squaredNorm() + 0.5 * o.w_WO.dot(world_inertia(o.R_WO, body, 1.0) * o.w_WO);
}

bool InstanceWorld::diverged() const {
  return std::any_of(objects_.begin(), objects_.end(), [](const Object& o) {
    return !(o.p_WCm.allFinite() && o.R_WO.coeffs().allFinite() && o.v_WCm.norm() < kLargestSpeed &&
             o.w_WO.norm() < kLargestSpeed);
  });
}

bool InstanceWorld::freeze_beyond(double radius) {
  bool any = false;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    Object& object = objects_[i];
    if (!object.frozen && !object.held && object.p_WCm.norm() > radius) {
      object.frozen = true;
      object.v_WCm.setZero();
      object.w_WO.setZero();
      moving_[i].present = false;
      if (jointed_[i]) {  // what hangs on it is fixed from now on
        moving_[i].dynamic = false;
        moving_[i].velocity = moving_[i].spin = Vector3d::Zero();
      }
    }
    any = any || object.frozen;
  }
  return any;
}

bool InstanceWorld::all_frozen() const {
  return !objects_.empty() && std::all_of(objects_.begin(), objects_.end(), [](const Object& o) { return o.frozen; });
}

void InstanceWorld::read(belief::WorldState& state) const {
  state.time = time();
  state.objects.resize(objects_.size());
  const int rest_steps = static_cast<int>(std::ceil(scene_->options.rest.time / dt()));
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Object& object = objects_[i];
    belief::ObjectState& out = state.objects[i];
    out.X_WO = object_pose(object);
    out.V_WO.angular = object.w_WO;
    out.V_WO.linear = object.v_WCm - object.w_WO.cross(object.R_WO * object.physical.center_of_mass);
    out.mode = object.held                       ? belief::MotionMode::kHeld
               : object.calm_steps >= rest_steps ? belief::MotionMode::kResting
                                                 : belief::MotionMode::kMoving;
    out.physical = object.physical;
  }
  state.joints.resize(hinged_.size());
  for (std::size_t j = 0; j < hinged_.size(); ++j) state.joints[j] = hinged_[j].drawn;
}

}  // namespace prescene::simulation
