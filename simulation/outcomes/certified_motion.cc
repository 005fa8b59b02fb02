// SPDX-License-Identifier: Apache-2.0
#include "certified_motion.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "prescene/simulation/outcomes/bearing_body.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/similarity.h"

namespace prescene::simulation {
namespace {

// Room for what the integrator and the solver add to the energy.
constexpr double kEnergy = 1.05;
// Sliding to a stop takes at most this many times what friction says.
constexpr double kSlide = 1.25;
// rad: supports are level to this, and objects that others stand on.
constexpr double kLevel = 1e-3;
constexpr double kLevelObject = 0.02;
// Share of its energy above the floor that a body keeps when it lands; more would be a bouncing ball.
constexpr double kKeptInLanding = 0.75;
constexpr double kBouncy = 0.7;
// A body rolls over edges that lift its centre of mass by less than this share.
constexpr double kRollingRise = 0.05;

/// Level direction in which the body tips off the side of a thing, over which its centre of mass is already: x, y, -x
/// or -y as 0 to 3.
std::optional<int> tips_off(const SureMotion& motion, const geometry::Box& thing, const Vector3d& relative_velocity,
                            double tipped) {
  if (relative_velocity.z() > 0.0) return std::nullopt;
  for (int side = 0; side < 4; ++side) {
    const int k = side % 2;
    const double sign = side < 2 ? 1.0 : -1.0;
    const double beyond = sign > 0.0 ? motion.center[k] - thing.max()[k] : thing.min()[k] - motion.center[k];
    const Vector3d tipping_axis = Vector3d::UnitZ().cross(sign * Vector3d::Unit(k));
    if (beyond >= tipped && sign * relative_velocity[k] >= 0.0 && motion.angular_velocity.dot(tipping_axis) >= 0.0)
      return side;
  }
  return std::nullopt;
}

bool disjoint_and_parting(const geometry::Box& a, const geometry::Box& b, const Vector3d& v) {
  for (int k = 0; k < 2; ++k) {
    if (a.min()[k] >= b.max()[k] && v[k] >= 0.0) return true;
    if (a.max()[k] <= b.min()[k] && v[k] <= 0.0) return true;
  }
  return false;
}

bool rolls(const ConvexPolytope& hull, const Vector3d& center_of_mass) {
  for (const ConvexPolytope::Face& face : hull.faces) {
    const double depth = face.offset - face.normal.dot(center_of_mass);
    const Vector3d foot = center_of_mass + depth * face.normal;
    for (std::size_t i = 0; i < face.loop.size(); ++i) {
      const Vector3d& from = hull.vertices[face.loop[i]];
      const Vector3d side = hull.vertices[face.loop[(i + 1) % face.loop.size()]] - from;
      const double arm = face.normal.dot(side.cross(foot - from)) / side.norm();
      if (arm >= 0.0 && std::hypot(depth, arm) < (1.0 + kRollingRise) * depth) return true;
    }
  }
  return false;
}

std::optional<CertifiedObject> certified_object(const belief::ObjectModel& model, const CertifierOptions& options,
                                                const Rooms& rooms) {
  auto hull = make_polytope(belief::collision_mesh(model).vertices);
  if (!hull) return std::nullopt;
  CertifiedObject object;
  object.hull = *std::move(hull);
  object.bearing = object.hull;
  object.shapes = shape_hulls(model.collision);
  object.center_of_mass = belief::mean(model.center_of_mass);
  object.center_play = belief::dimensions(model.center_of_mass) > 0 ? rooms.center : 1e-9 * options.length_scale;
  if (collides_as_spheres(model.collision)) {
    if (!options.shapes) return std::nullopt;
    std::optional<BearingBody> body =
        bearing_body(model.collision, object.hull, object.center_of_mass, *options.shapes, options.length_scale);
    if (!body) return std::nullopt;
    object.bearing = std::move(body->polytope);
    object.rise = body->rise;
    object.inner_radius = std::max(0.0, body->inner_radius - object.center_play);
  }
  object.edge_radius = std::max(options.edge_rounding * options.length_scale, model.contact.edge_radius);
  object.convex = model.collision.size() == 1 && object.shapes.size() == 1 && object.rise == 0.0;
  object.rolls = rolls(object.hull, object.center_of_mass);
  object.rolling_arm = model.contact.rolling_friction;
  for (const ConvexPolytope& shape : object.shapes)
    object.inner_radius = std::max(object.inner_radius, least_depth(shape, object.center_of_mass) - object.center_play);
  for (const Vector3d& v : object.hull.vertices)
    object.outer_radius =
        std::max(object.outer_radius, (v - object.center_of_mass).norm() + object.rise + object.center_play);
  return object;
}

}  // namespace

Rooms Rooms::of(double length_scale) {
  Rooms rooms;
  for (double* length : {&rooms.rise, &rooms.barrier, &rooms.slide, &rooms.tipped, &rooms.sunk, &rooms.beside,
                         &rooms.air, &rooms.ball, &rooms.center})
    *length *= length_scale;
  for (double* time : {&rooms.settle_time, &rooms.collapse_time}) *time *= Similarity{length_scale}.time();
  return rooms;
}

std::unique_ptr<const MotionCertifier> MotionCertifier::make(const belief::Scene& scene,
                                                             const CertifierOptions& options, double world_radius) {
  const Vector3d& gravity = scene.gravity_W;
  if (gravity.x() != 0.0 || gravity.y() != 0.0 || !(gravity.z() < 0.0)) return nullptr;
  // Between spheres of a fixed thing others come lower than its faces, hulls and water levels say.
  for (const belief::Support& support : scene.supports)
    if (collides_as_spheres(support.collision)) return nullptr;
  auto made = std::make_unique<MotionCertifier>();
  made->rooms_ = Rooms::of(options.length_scale);
  made->shorten_arms_ = options.shorten_arms;
  made->world_radius_ = world_radius;
  made->gravity_ = -gravity.z();
  made->robot_ = !scene.robot.empty();
  for (const belief::SceneObject& object : scene.objects) {
    std::optional<CertifiedObject> certified = certified_object(scene.model_of(object), options, made->rooms_);
    if (!certified) return nullptr;
    made->objects_.push_back(*std::move(certified));
    made->unit_inertias_.push_back(scene.model_of(object).unit_inertia);
  }
  for (std::size_t s = 0; s < scene.supports.size(); ++s) {
    const belief::Support& support = scene.supports[s];
    std::vector<LevelFace> faces;
    append_level_faces(shape_hulls(support.collision), support.X_WS, kLevel, faces);
    for (LevelFace& face : faces) made->faces_.push_back({std::move(face), static_cast<int>(s)});
    const belief::ContactProperties& contact = support.contact;
    made->support_friction_.push_back(
        std::min(belief::mean(contact.friction),
                 contact.impact_friction ? belief::mean(*contact.impact_friction) : belief::mean(contact.friction)));
    made->support_rolling_arm_.push_back(contact.rolling_friction);
    made->support_edge_radius_ =
        std::max({made->support_edge_radius_, options.edge_rounding * options.length_scale, contact.edge_radius});
    made->least_support_friction_ = std::min(made->least_support_friction_, made->support_friction_.back());
    for (const belief::CollisionShape& shape : support.collision) {
      const geometry::Box box =
          geometry::bounding_box(geometry::transformed(belief::collision_mesh({shape}), support.X_WS));
      made->shapes_.push_back({box, static_cast<int>(s)});
    }
  }
  std::ranges::stable_sort(made->faces_, std::ranges::greater{}, [](const FixedFace& f) { return f.face.height; });
  return made;
}

bool MotionCertifier::assess(const belief::WorldState& state, double seconds_left,
                             std::vector<SureMotion>& motions) const {
  if (state.objects.size() != objects_.size()) return false;
  motions.assign(objects_.size(), SureMotion{});
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const belief::ObjectState& object = state.objects[i];
    const CertifiedObject& known = objects_[i];
    const Vector3d& center_O = object.physical.center_of_mass;
    if (object.mode == belief::MotionMode::kHeld || (center_O - known.center_of_mass).norm() > known.center_play)
      return false;
    SureMotion& motion = motions[i];
    const geometry::Matrix3d R = object.X_WO.rotation.toRotationMatrix();
    motion.center = object.X_WO * center_O;
    motion.velocity = object.V_WO.linear + object.V_WO.angular.cross(R * center_O);
    motion.angular_velocity = object.V_WO.angular;
    const Vector3d w_O = R.transpose() * object.V_WO.angular;
    motion.weight = object.physical.mass * gravity_;
    motion.spin = 0.5 * object.physical.mass * w_O.dot(unit_inertias_[i] * w_O);
    motion.kinetic = motion.spin + 0.5 * object.physical.mass * motion.velocity.squaredNorm();
    motion.box.setEmpty();
    for (const Vector3d& v : known.hull.vertices) motion.box.extend(object.X_WO.translation + R * v);
    motion.box.min().array() -= known.rise;
    motion.box.max().array() += known.rise;
  }
  stand(state, motions);
  bound_heights(state, seconds_left, motions);
  let_roll(state, motions);
  for (std::size_t i = 0; i < motions.size(); ++i)
    if (!stays_in_world(motions[i], objects_[i])) return false;
  if (!robot_)
    for (std::size_t i = 0; i < motions.size(); ++i)
      motions[i].landing = landing_of(motions, i, state.objects[i].physical.restitution, seconds_left);
  return true;
}

void MotionCertifier::stand(const belief::WorldState& state, std::vector<SureMotion>& motions) const {
  std::vector<LevelFace> tops;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    SureMotion& motion = motions[i];
    const Eigen::Vector2d foot = motion.center.head<2>();
    const LevelFace* best = nullptr;
    const auto consider = [&](const LevelFace& face) {
      const bool better = face.height <= motion.center.z() && (!best || face.height > motion.plane);
      if (!better || distance_inside(face, foot) <= 0.0) return false;
      best = &face;
      motion.plane = face.height;
      return true;
    };
    for (const FixedFace& fixed : faces_)
      if (consider(fixed.face)) motion.base = static_cast<int>(objects_.size()) + fixed.support;
    LevelFace on_object;
    for (std::size_t j = 0; j < motions.size(); ++j) {
      if (j == i || !motions[j].box.intersects(geometry::Box(Vector3d(foot.x(), foot.y(), -1e30),
                                                             Vector3d(foot.x(), foot.y(), motion.center.z()))))
        continue;
      tops.clear();
      append_level_faces(objects_[j].shapes, state.objects[j].X_WO, kLevelObject, tops);
      for (const LevelFace& top : tops)
        if (consider(top)) {
          on_object = top;
          best = &on_object;
          motion.base = static_cast<int>(j);
        }
    }
    if (!best) continue;

    const belief::PhysicalParameters& physical = state.objects[i].physical;
    const auto count = static_cast<int>(objects_.size());
    const bool on_support = motion.base >= count;
    const belief::PhysicalParameters* under =
        on_support ? nullptr : &state.objects[static_cast<std::size_t>(motion.base)].physical;
    const double friction = std::min(physical.friction, physical.impact_friction) *
                            (on_support ? friction_about(motion) : std::min(under->friction, under->impact_friction));
    const Vector3d relative = on_support
                                  ? motion.velocity
                                  : Vector3d(motion.velocity - motions[static_cast<std::size_t>(motion.base)].velocity);
    // All turning may become sliding or hopping; a hop's way is that of a throw.
    const double turning = 2.0 * motion.spin * gravity_ / motion.weight;
    const double sideways = relative.head<2>().squaredNorm() + turning;
    const double gap = std::max(0.0, motion.box.min().z() - motion.plane);
    const double upwards = relative.z() * relative.z() + turning + 2.0 * gravity_ * gap;
    motion.hop = 2.0 * std::sqrt(sideways * upwards) / gravity_;
    motion.slide_time = kSlide * std::sqrt(sideways) / (std::max(friction, 1e-6) * gravity_);
    motion.reach = kSlide * sideways / (2.0 * std::max(friction, 1e-6) * gravity_) + rooms_.slide + motion.hop;
    // What is below ends in round edges, too.
    const double round =
        on_support ? support_edge_radius_ : objects_[static_cast<std::size_t>(motion.base)].edge_radius;
    motion.inside = distance_inside(*best, foot) - round;
    const double edge = shorten_arms_ ? motion.inside - motion.reach : 1e30;
    motion.trap = trap_of(objects_[i].bearing, state.objects[i].X_WO, physical.center_of_mass,
                          {motion.plane, edge, rooms_.sunk}, objects_[i].edge_radius);
  }
}

double MotionCertifier::friction_about(const SureMotion& motion) const {
  double least = support_friction_[static_cast<std::size_t>(motion.base) - objects_.size()];
  const Vector3d room = Vector3d::Constant(rooms_.beside);
  geometry::Box about(motion.box.min() - room, motion.box.max() + room);
  about.min().z() = std::min(about.min().z(), motion.plane);
  for (const FixedShape& shape : shapes_)
    if (about.intersects(shape.box))
      least = std::min(least, support_friction_[static_cast<std::size_t>(shape.support)]);
  return least;
}

std::vector<double> MotionCertifier::lowest_centers(const belief::WorldState& state, double seconds_left,
                                                    const std::vector<SureMotion>& motions) const {
  std::vector<double> lowest(motions.size(), -world_radius_);
  std::vector<std::size_t> free;
  double energy = 0.0, lowest_touch = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < motions.size(); ++j) {
    const SureMotion& motion = motions[j];
    energy += kEnergy * motion.kinetic;
    if (!motion.trap) {
      free.push_back(j);
      continue;
    }
    lowest[j] = motion.plane + motion.trap->lowest;
    energy += motion.weight * std::max(0.0, motion.center.z() - lowest[j]);
    lowest_touch = std::min(lowest_touch, lowest[j] - objects_[j].outer_radius - rooms_.rise);
  }
  // One alone can give its energy to those that stay on their faces only where it touches one of them.
  if (free.size() == 1) lowest[free[0]] = std::max(-world_radius_, lowest_touch - objects_[free[0]].outer_radius);

  // None gets through a level face above which all of them stay: with all energy that there is above the face none gets
  // to its edge in the time that is left, or slides that far.
  for (const FixedFace& fixed : faces_) {
    const double height = fixed.face.height;
    const auto center_above = [&](std::size_t j) {
      return height + std::max(0.0, objects_[j].inner_radius - rooms_.rise);
    };
    double all = energy;
    for (const std::size_t j : free) all += motions[j].weight * std::max(0.0, motions[j].center.z() - center_above(j));
    const bool stay = std::ranges::all_of(free, [&](std::size_t j) {
      const SureMotion& motion = motions[j];
      const belief::PhysicalParameters& physical = state.objects[j].physical;
      double friction = least_support_friction_ * std::min(physical.friction, physical.impact_friction);
      if (objects_[j].rolls) friction = std::min(friction, objects_[j].rolling_arm / objects_[j].outer_radius);
      const double speed2 = 2.0 * gravity_ * all / motion.weight;
      const double way = std::min(std::sqrt(speed2) * seconds_left,
                                  kSlide * speed2 / (2.0 * std::max(friction, 1e-6) * gravity_) + rooms_.slide);
      return motion.center.z() > height &&
             distance_inside(fixed.face, motion.center.head<2>()) > way + objects_[j].outer_radius;
    });
    if (!stay) continue;
    for (const std::size_t j : free) lowest[j] = std::max(lowest[j], center_above(j));
    break;  // the others are lower
  }
  return lowest;
}

void MotionCertifier::bound_heights(const belief::WorldState& state, double seconds_left,
                                    std::vector<SureMotion>& motions) const {
  double kinetic = 0.0;
  for (const SureMotion& motion : motions) kinetic += motion.kinetic;
  // Suppose that all that may be trapped are, and let go those that the energy of that supposition frees, until none is
  // left over: the first to break out would have had to do it with this energy.
  for (bool changed = true; changed;) {
    changed = false;
    const std::vector<double> lowest = lowest_centers(state, seconds_left, motions);
    double potential = 0.0;
    const auto falls_by = [&](std::size_t j) {
      return motions[j].weight * std::max(0.0, motions[j].center.z() - lowest[j]);
    };
    for (std::size_t j = 0; j < motions.size(); ++j) potential += falls_by(j);
    for (std::size_t i = 0; i < motions.size(); ++i) {
      SureMotion& motion = motions[i];
      motion.highest = motion.center.z() + rooms_.rise + (kEnergy * kinetic + potential - falls_by(i)) / motion.weight;
      if (!motion.trap) continue;
      const bool base_stays = motion.base >= static_cast<int>(motions.size()) ||
                              motions[static_cast<std::size_t>(motion.base)].trap.has_value();
      if (base_stays && motion.highest - motion.plane < motion.trap->barrier - rooms_.barrier) continue;
      motion.trap.reset();
      changed = true;
      break;  // the others had counted on it
    }
  }
}

void MotionCertifier::let_roll(const belief::WorldState& state, std::vector<SureMotion>& motions) const {
  const auto count = static_cast<int>(objects_.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    SureMotion& motion = motions[i];
    const CertifiedObject& known = objects_[i];
    if (motion.trap) motion.lowest = motion.plane + motion.trap->lowest;
    if (motion.trap || !known.rolls || motion.base < count) continue;
    const auto support = static_cast<std::size_t>(motion.base - count);
    const belief::PhysicalParameters& physical = state.objects[i].physical;
    const double friction = std::min(physical.friction, physical.impact_friction) * friction_about(motion);
    const double rolling_arm =
        alone_on_base(motions, i) ? std::max(known.rolling_arm, support_rolling_arm_[support]) : known.rolling_arm;
    const double resistance = std::min(friction, rolling_arm / (motion.highest - motion.plane));
    const double lowest = motion.plane + least_depth(known.bearing, physical.center_of_mass);
    motion.reach =
        kSlide * (motion.highest - rooms_.rise - lowest) / std::max(resistance, 1e-9) + rooms_.slide + motion.hop;
    if (motion.reach < motion.inside) motion.lowest = lowest;
  }
}

bool MotionCertifier::stays_in_world(const SureMotion& motion, const CertifiedObject& known) const {
  return motion.center.norm() + (motion.lowest ? motion.reach : 0.0) + known.outer_radius < world_radius_;
}

std::optional<double> MotionCertifier::landing_of(const std::vector<SureMotion>& motions, std::size_t object,
                                                  double restitution, double seconds_left) const {
  if (restitution > kBouncy) return std::nullopt;
  const SureMotion& motion = motions[object];
  double floor = -std::numeric_limits<double>::infinity();
  double lowest_beside = std::numeric_limits<double>::infinity();
  std::optional<int> tipped_side;
  const auto falls_past = [&](const geometry::Box& thing, const Vector3d& relative_velocity) {
    lowest_beside = std::min(lowest_beside, thing.max().z());
    if (disjoint_and_parting(motion.box, thing, relative_velocity)) return true;
    // Things on two sides could hold it between them.
    const std::optional<int> side =
        objects_[object].convex ? tips_off(motion, thing, relative_velocity, rooms_.tipped) : std::nullopt;
    if (!side || side != tipped_side.value_or(*side)) return false;
    tipped_side = side;
    return true;
  };
  for (const FixedShape& shape : shapes_) {
    if (shape.box.max().z() <= motion.box.min().z())
      floor = std::max(floor, shape.box.max().z());
    else if (!falls_past(shape.box, motion.velocity))
      return std::nullopt;
  }
  for (std::size_t j = 0; j < motions.size(); ++j)
    if (j != object && !falls_past(motions[j].box, motion.velocity - motions[j].velocity)) return std::nullopt;
  const double rebound = floor + kKeptInLanding * (motion.highest - floor);
  if (!(floor < motion.box.min().z() && (std::isinf(floor) || rebound < lowest_beside + objects_[object].inner_radius)))
    return std::nullopt;
  // It is still in the world when it gets there.
  const double landing = std::max(floor, -0.5 * world_radius_);
  const double height = motion.center.z() - landing;
  if (!(height > 0.0)) return std::nullopt;
  const double up = motion.velocity.z();
  const double time = (up + std::sqrt(up * up + 2.0 * gravity_ * height)) / gravity_;
  // Bounces take 2 e / (1 - e) of the time in which its speed of landing is gained.
  const double landing_speed = std::sqrt(2.0 * gravity_ * std::max(0.0, motion.highest - landing));
  const double bouncing = 2.0 * restitution / (1.0 - restitution) * landing_speed / gravity_;
  if (seconds_left < time + (std::isfinite(floor) ? bouncing + rooms_.collapse_time : 0.0)) return std::nullopt;
  const double sideways = motion.center.head<2>().norm() + time * motion.velocity.head<2>().norm();
  const double farthest_up = std::max(std::abs(motion.highest), std::abs(landing));
  if (std::hypot(sideways, farthest_up) + objects_[object].outer_radius >= world_radius_) return std::nullopt;
  return landing;
}

bool MotionCertifier::alone_on_base(const std::vector<SureMotion>& motions, std::size_t object) const {
  const SureMotion& motion = motions[object];
  const Vector3d room = Vector3d::Constant(motion.reach + rooms_.beside);
  geometry::Box around(motion.box.min() - room, motion.box.max() + room);
  around.min().z() = motion.box.min().z() - rooms_.sunk;
  const auto count = static_cast<int>(objects_.size());
  for (const FixedShape& shape : shapes_)
    if (count + shape.support != motion.base && around.intersects(shape.box)) return false;
  for (std::size_t j = 0; j < motions.size(); ++j)
    if (j != object && static_cast<int>(j) != motion.base && around.intersects(motions[j].box)) return false;
  return !robot_;
}

bool MotionCertifier::support_above(int support, double height) const {
  return std::all_of(shapes_.begin(), shapes_.end(),
                     [&](const FixedShape& shape) { return shape.support != support || shape.box.min().z() > height; });
}

}  // namespace prescene::simulation
