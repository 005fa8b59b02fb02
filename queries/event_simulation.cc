// SPDX-License-Identifier: Apache-2.0
// How events begin, and the instances that follow.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "event_paths.h"
#include "prescene/belief/body_names.h"
#include "prescene/collision/ray_triangle.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using belief::Pose;
using geometry::Vector3d;

constexpr double kMovedPlace = 0.003;   // m and ...
constexpr double kMovedTurn = 0.015;    // ... rad: what is further from the base counts as moved
constexpr double kStandingTilt = 0.03;  // rad; by which what is put down as it stood is tilted
constexpr double kHighestLift = 3.0;    // deviations of the height at which things are put down, that are looked at
constexpr std::size_t kMostTrianglesBelow = 20'000;  // of a shape on which things may be put down
constexpr double kPusherGap = 1e-3;                  // m between what pushes and the object, at first
// s: what is let go elsewhere is there after the first, and free after the second.
constexpr double kCarried = 1e-3, kLetGo = 0.02;
constexpr double kOpening = 1e-3;  // m by which the hand then rises: simulators count it as done with after that only

bool is_simulated(EventKind kind) {
  return kind == EventKind::kPushed || kind == EventKind::kBumped || kind == EventKind::kSlipped;
}

bool differs(const std::optional<Pose>& a, const std::optional<Pose>& b) {
  if (a.has_value() != b.has_value()) return true;
  if (!a) return false;
  return (a->translation - b->translation).norm() > kMovedPlace ||
         geometry::angle_between(a->rotation, b->rotation) > kMovedTurn;
}

}  // namespace

belief::WorldState state_in(const belief::Trajectory& run, double time) {
  const auto later = std::upper_bound(run.states.begin(), run.states.end(), time + 1e-9,
                                      [](double t, const belief::WorldState& state) { return t < state.time; });
  belief::WorldState state = later == run.states.begin() ? *later : *std::prev(later);
  if (later != run.states.begin() && later != run.states.end()) {  // velocities of what a hand carries
    const belief::WorldState& before = *std::prev(later);
    const double dt = later->time - before.time;
    for (std::size_t i = 0; i < state.objects.size(); ++i) {
      if (state.objects[i].mode != belief::MotionMode::kHeld || !(dt > 0.0)) continue;
      const Pose& X_a = before.objects[i].X_WO;
      const Pose& X_b = later->objects[i].X_WO;
      state.objects[i].V_WO.linear = (X_b.translation - X_a.translation) / dt;
      state.objects[i].V_WO.angular = geometry::log_rotation(X_b.rotation * X_a.rotation.conjugate()) / dt;
    }
  }
  state.time = std::max(state.time, time - kEventInterval);
  return state;
}

Pose pose_in(const belief::Trajectory& run, std::size_t object, double time) {
  const auto later = std::lower_bound(run.states.begin(), run.states.end(), time,
                                      [](const belief::WorldState& state, double t) { return state.time < t; });
  if (later == run.states.begin()) return later->objects[object].X_WO;
  if (later == run.states.end()) return run.states.back().objects[object].X_WO;
  const belief::WorldState& before = *std::prev(later);
  const double span = later->time - before.time;
  const double share = span > 0.0 ? (time - before.time) / span : 1.0;
  return geometry::interpolate(before.objects[object].X_WO, later->objects[object].X_WO, share);
}

/// W's x, laid flat: what directions count from.
Vector3d horizontal_x(const Vector3d& up) {
  const Vector3d x = Vector3d::UnitX() - up * up.x();
  return (x.norm() > 1e-6 ? x : Vector3d(Vector3d::UnitY() - up * up.y())).normalized();
}

Vector3d EventPaths::direction_of(const EventDraw& draw) const {
  const Vector3d up = belief::up_of(*scene_);
  const Vector3d x = horizontal_x(up);
  return std::cos(draw.direction) * x + std::sin(draw.direction) * up.cross(x);
}

bool EventPaths::touch(std::size_t object, const belief::WorldState& state, EventDraw& draw) const {
  const Pose& X_WO = state.objects[object].X_WO;
  const Vector3d up = belief::up_of(*scene_);
  const Vector3d along = direction_of(draw);
  const Vector3d across = up.cross(along);
  const Vector3d p_WCm = X_WO * state.objects[object].physical.center_of_mass;
  double lowest = 1e300, highest = -1e300, half_width = 0.0, reach = 0.0;
  for (const Vector3d& vertex : shapes_[object].vertices) {
    const Vector3d p = X_WO * vertex;
    lowest = std::min(lowest, up.dot(p));
    highest = std::max(highest, up.dot(p));
    half_width = std::max(half_width, std::abs(across.dot(p - p_WCm)));
    reach = std::max(reach, (p - p_WCm).norm());
  }
  draw.touched_height = draw.height * (highest - lowest);
  Vector3d target = p_WCm + draw.sideways * half_width * across;
  target += (lowest + draw.touched_height - up.dot(target)) * up;
  collision::Ray ray;
  ray.origin = X_WO.inverse() * (target - 2.0 * reach * along);
  ray.direction = X_WO.rotation.conjugate() * along;
  const auto sheared = collision::shear(ray);
  if (!sheared) return false;
  double nearest = 1e300;
  for (const auto& t : shapes_[object].triangles) {
    const Vector3d &a = shapes_[object].vertices[t[0]], &b = shapes_[object].vertices[t[1]],
                   &c = shapes_[object].vertices[t[2]];
    const auto hit = collision::meet(*sheared, {a.cast<float>(), b.cast<float>(), c.cast<float>()});
    if (!hit || hit->s >= nearest) continue;
    nearest = hit->s;
    draw.touched_W = X_WO * Vector3d(hit->weights[0] * a + hit->weights[1] * b + hit->weights[2] * c);
  }
  draw.mass = state.objects[object].physical.mass;
  return nearest < 1e300;
}

belief::Push EventPaths::push_of(const EventDraw& draw) const {
  const Vector3d along = direction_of(draw);
  belief::Push push;
  push.radius = priors_.pusher_radius;
  push.from = draw.touched_W - (push.radius + kPusherGap) * along;
  push.to = push.from + draw.speed * draw.duration * along;
  push.duration = draw.duration;
  return push;
}

void EventPaths::begin_event(const Hypothesis& hypothesis, belief::WorldState& state, EventDraw& draw,
                             std::vector<belief::Action>& actions, bool* possible) const {
  belief::ObjectState& object = state.objects[hypothesis.object];
  *possible = true;
  if (hypothesis.kind == EventKind::kSlipped) {
    *possible = object.mode == belief::MotionMode::kHeld;
    object.mode = belief::MotionMode::kMoving;
    object.V_WO.linear += draw.added.linear;
    object.V_WO.angular += draw.added.angular;
    return;
  }
  const bool free = object.mode != belief::MotionMode::kHeld;
  *possible = free && touch(hypothesis.object, state, draw);
  if (hypothesis.kind == EventKind::kPushed) {
    actions.push_back({0.0, push_of(draw)});
    return;
  }
  const Vector3d along = direction_of(draw);
  object.mode = belief::MotionMode::kMoving;
  const belief::ObjectModel& moved = model(hypothesis.object);
  const geometry::Matrix3d R = object.X_WO.rotation.toRotationMatrix();
  const Vector3d p_OCm_W = R * object.physical.center_of_mass;
  const Vector3d arm = draw.touched_W - (object.X_WO.translation + p_OCm_W);
  const Vector3d rate = (R * moved.unit_inertia * R.transpose()).inverse() * arm.cross(draw.speed * along);
  object.V_WO.linear += draw.speed * along - rate.cross(p_OCm_W);
  object.V_WO.angular += rate;
}

/// The hand that holds it goes there at once, rests, and lets go: so that its bodies are where they would have been.
std::vector<belief::Action> EventPaths::let_go_at(std::size_t object, const Pose& X_WO, const EventDraw& draw) const {
  belief::Transport transport;
  transport.object = objects_[object].name;
  transport.X_WO = belief::FixedPose{X_WO};
  transport.duration = kCarried;
  belief::Release release;
  release.object = objects_[object].name;
  release.retreat = kOpening * belief::up_of(*scene_);
  release.disturbance.linear = belief::Vector3Distribution::fixed(draw.added.linear);
  release.disturbance.angular = belief::Vector3Distribution::fixed(draw.added.angular);
  return {{0.0, transport}, {kLetGo, release}};
}

std::optional<Pose> EventPaths::put_down(const Hypothesis& hypothesis, const EventDraw& draw, const Pose& X_WO) const {
  const SeenTrack& track = tracks_[hypothesis.object];
  const Vector3d up = belief::up_of(*scene_);
  Pose X = X_WO;
  if (draw.other_face) {
    if (track.estimates.empty()) return std::nullopt;
    X.rotation = track.estimates.back().mode.rotation;
  }
  X.rotation = (geometry::exp_rotation(draw.turn * up) * X.rotation).normalized();
  X.translation = X_WO.translation + draw.shift;
  const std::optional<double> above = lift(hypothesis.object, X);
  if (above && std::abs(*above) > kHighestLift * priors_.carry_height) return std::nullopt;
  if (above) X.translation -= *above * up;
  return X;
}

std::optional<double> EventPaths::lift(std::size_t object, const Pose& X_WO) const {
  const Vector3d up = belief::up_of(*scene_);
  const Vector3d p_WCm = X_WO * belief::mean(model(object).center_of_mass);
  double lowest = 1e300;
  for (const Vector3d& vertex : shapes_[object].vertices) lowest = std::min(lowest, up.dot(X_WO * vertex));
  const Vector3d from = p_WCm + kHighestLift * priors_.carry_height * up;
  std::optional<double> nearest;
  const auto look_at = [&](const geometry::TriangleMesh& mesh, const Pose& X_WM) {
    const auto ray = collision::shear({X_WM.inverse() * from, X_WM.rotation.conjugate() * -up});
    if (!ray || mesh.triangles.size() > kMostTrianglesBelow) return;
    for (const auto& t : mesh.triangles) {
      const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const auto hit = collision::meet(*ray, {a.cast<float>(), b.cast<float>(), c.cast<float>()});
      if (!hit || !hit->front) continue;
      const Vector3d below = X_WM * Vector3d(hit->weights[0] * a + hit->weights[1] * b + hit->weights[2] * c);
      const double above = lowest - up.dot(below);
      if (!nearest || std::abs(above) < std::abs(*nearest)) nearest = above;
    }
  };
  for (const geometry::TriangleMesh& support : supports_) look_at(support, Pose::identity());
  for (std::size_t i = 0; i < present(); ++i)
    if (i != object) look_at(shapes_[i], prior_.likeliest.objects[i].X_WO);
  return nearest;
}

double EventPaths::log_put_down(std::size_t object, const Pose& X_WO, double height_variance) const {
  const Vector3d up = belief::up_of(*scene_);
  const Pose& from = put_in_at_[object];
  const geometry::SymmetryGroup& symmetry = model(object).symmetry;
  const double log_root = 0.5 * std::log(2.0 * std::numbers::pi);
  const auto log_normal = [&](double x, double deviation) {
    return -0.5 * x * x / (deviation * deviation) - std::log(deviation) - log_root;
  };
  const Vector3d shift = X_WO.translation - from.translation;
  const double lift = up.dot(shift), away = (shift - up * lift).norm();
  double log_density = log_normal(away, priors_.carry_distance) - std::log(priors_.carry_distance) - log_root;
  if (const std::optional<double> above = this->lift(object, X_WO)) {
    const double rise = (lift - *above) / priors_.carry_height;
    log_density += log_normal(*above, std::sqrt(height_variance + kRestHeight * kRestHeight)) - 0.5 * rise * rise;
  } else {
    log_density += log_normal(lift, priors_.carry_height);
  }
  if (symmetry.ball) return log_density;
  // Half of what is put down stands as before, turned about the vertical; the rest lies anyhow.
  const double copies = static_cast<double>(symmetry.rotations.size() + 1);
  const Pose X = geometry::closest_equivalent(X_WO, from, symmetry);
  const double tilt =
      std::acos(std::clamp((X.rotation.conjugate() * up).dot(from.rotation.conjugate() * up), -1.0, 1.0));
  double log_upright = log_normal(tilt, kStandingTilt) - std::log(kStandingTilt) - log_root;
  double log_anyhow = std::log(copies / (4.0 * std::numbers::pi));
  if (!symmetry.axis) {
    log_upright -= std::log(2.0 * std::numbers::pi);
    log_anyhow -= std::log(2.0 * std::numbers::pi);
  }
  const double top = std::max(log_upright, log_anyhow);
  return log_density + std::log(0.5) + top + std::log(std::exp(log_upright - top) + std::exp(log_anyhow - top));
}

void EventPaths::simulate(const Hypothesis& hypothesis, std::span<const LatentPoint> points, std::span<ScenePath> paths,
                          std::span<EventDraw> draws, std::span<belief::Trajectory> runs_out,
                          std::span<const Vector3d> moved) {
  const std::size_t n = points.size(), target = hypothesis.object;
  const bool gone_before = hypothesis.begins_otherwise && is_present(target);
  const bool put_in = hypothesis.kind == EventKind::kPutIn || (hypothesis.begins_otherwise && !is_present(target));
  const auto first = static_cast<std::size_t>(event_dimensions(hypothesis));
  std::vector<belief::WorldState> starts(n);
  std::vector<EventDraw> events(n);
  std::vector<std::vector<belief::Action>> actions(n);
  std::vector<std::uint8_t> possible(n, 1);
  context_.simulation.pool->for_blocks(n, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      events[i] = decode(hypothesis, points[i]);
      starts[i] = gone_before ? likeliest_start() : start_of(target, points[i], first);
      if (!moved.empty() && !is_held(target)) starts[i].objects[target].X_WO.translation += moved[i];
    }
  });
  // What happens without the event, up to it.
  std::vector<belief::Trajectory> before(n);
  if (!still_ && is_present(target)) {
    const std::vector<std::vector<belief::Action>> known(n, actions_from(0.0));
    before = run(starts, known);
  } else {
    for (std::size_t i = 0; i < n; ++i) before[i].states = {starts[i]};
  }
  std::vector<belief::Trajectory> after(n);
  if (is_simulated(hypothesis.kind)) {
    std::vector<belief::WorldState> states(n);
    context_.simulation.pool->for_blocks(n, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        states[i] = state_in(before[i], events[i].time);
        if (still_) states[i].time = events[i].time;
        actions[i] = actions_from(states[i].time);
        bool can_be = true;
        if (!moved.empty() && is_held(target) && hypothesis.kind == EventKind::kSlipped) {
          Pose X_WO = states[i].objects[target].X_WO;
          X_WO.translation += moved[i];
          actions[i] = let_go_at(target, X_WO, events[i]);
        } else {
          begin_event(hypothesis, states[i], events[i], actions[i], &can_be);
        }
        possible[i] = can_be ? 1 : 0;
      }
    });
    // A hand that moves may come near anything.
    const bool hand_moves = !moved.empty() && is_held(target);
    after = hand_moves ? run(states, actions) : run(states, actions, target);
  }
  const std::size_t count = times_.size();
  const auto make_path = [&](std::size_t i) {
    ScenePath& path = paths[i];
    path = {};
    const EventDraw& event = events[i];
    const bool simulated = is_simulated(hypothesis.kind);
    path.simulated = simulated || (hypothesis.kind == EventKind::kNothing && !still_);
    path.impossible = possible[i] == 0 || before[i].end == belief::TrajectoryEnd::kDiverged ||
                      (simulated && after[i].end == belief::TrajectoryEnd::kDiverged);
    const bool carried = hypothesis.kind == EventKind::kMoved || put_in;
    if (carried || hypothesis.kind == EventKind::kExchanged) {
      const auto down = std::lower_bound(times_.begin(), times_.end(), event.time + (carried ? event.duration : 0.0));
      if (down != times_.end()) path.put_down_from = static_cast<std::size_t>(down - times_.begin());
      path.put_anywhere = carried;
    }
    const auto add = [&](std::size_t object, ObjectPath poses, bool always) {
      bool moves = always;
      for (std::size_t k = 0; k < count && !moves; ++k) moves = differs(poses[k], base_[object][k]);
      if (!moves) return;
      path.moved.push_back(object);
      path.paths.push_back(std::move(poses));
    };
    const auto put = [&](ObjectPath& poses, std::size_t k, const Pose& from) {
      poses[k] = put_down(hypothesis, event, from);
      path.impossible = path.impossible || !poses[k];
    };
    const auto quiet = [&](std::size_t object, double time) -> std::optional<Pose> {
      if (!is_present(object)) return std::nullopt;
      return pose_in(before[i], object, time);
    };
    for (std::size_t object = 0; object < objects_.size(); ++object) {
      ObjectPath poses(count);
      const bool is_target = object == target;
      const bool is_partner = hypothesis.partner && object == *hypothesis.partner;
      for (std::size_t k = 0; k < count; ++k) {
        const double t = times_[k];
        poses[k] = is_target && (put_in || gone_before) ? std::nullopt : quiet(object, t);
        if (t < event.time || (hypothesis.kind == EventKind::kNothing && !put_in)) continue;
        if (simulated) {
          poses[k] = pose_in(after[i], object, t);
        } else if (hypothesis.kind == EventKind::kTakenAway && is_target) {
          poses[k].reset();
        } else if (hypothesis.kind == EventKind::kExchanged && (is_target || is_partner)) {
          poses[k] = quiet(is_target ? *hypothesis.partner : target, event.time);
        } else if (is_target && hypothesis.kind == EventKind::kMoved) {
          poses[k].reset();
          if (t >= event.time + event.duration) put(poses, k, pose_in(before[i], object, event.time));
        } else if (is_target && put_in) {
          put(poses, k, put_in_at_[object]);
        }
      }
      add(object, std::move(poses), is_target);
    }
  };
  context_.simulation.pool->for_blocks(n, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) make_path(i);
  });
  for (std::size_t i = 0; i < n; ++i) {
    failed_ += paths[i].impossible ? 1 : 0;
    if (!draws.empty()) draws[i] = events[i];
    if (!runs_out.empty() && is_simulated(hypothesis.kind)) runs_out[i] = std::move(after[i]);
    if (!runs_out.empty() && hypothesis.kind == EventKind::kNothing) runs_out[i] = std::move(before[i]);
  }
}

void EventPaths::go_on(const Hypothesis& hypothesis, double time, std::span<const EventDraw> draws,
                       std::span<const StateError> errors, std::span<const belief::Trajectory> runs,
                       std::span<ScenePath> paths) {
  const std::size_t n = runs.size();
  std::vector<belief::WorldState> states(n);
  std::vector<std::vector<belief::Action>> actions(n);
  bool alone = still_;
  for (std::size_t i = 0; i < n; ++i) {
    states[i] = state_in(runs[i], time);
    belief::ObjectState& object = states[i].objects[hypothesis.object];
    object.X_WO.rotation = (geometry::exp_rotation(errors[i].pose.head<3>()) * object.X_WO.rotation).normalized();
    object.X_WO.translation += errors[i].pose.tail<3>();
    object.V_WO.angular += errors[i].twist.head<3>();
    object.V_WO.linear += errors[i].twist.tail<3>();
    actions[i] = actions_from(states[i].time);
    if (hypothesis.kind == EventKind::kPushed)
      actions[i].push_back({draws[i].time - states[i].time, push_of(draws[i])});
    alone = alone && paths[i].moved.size() == 1;
  }
  const auto after = run(states, actions, alone ? std::optional(hypothesis.object) : std::nullopt);
  for (std::size_t i = 0; i < n; ++i) {
    paths[i].impossible = after[i].end == belief::TrajectoryEnd::kDiverged;
    failed_ += paths[i].impossible ? 1 : 0;
    for (std::size_t m = 0; m < paths[i].moved.size(); ++m)
      for (std::size_t k = 0; k < times_.size(); ++k)
        if (times_[k] > time && paths[i].paths[m][k])
          paths[i].paths[m][k] = pose_in(after[i], paths[i].moved[m], times_[k]);
  }
}

}  // namespace prescene::queries
