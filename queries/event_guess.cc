// SPDX-License-Identifier: Apache-2.0
// Guesses of an event's parameters from what the tracker made of the window. They only say where to look first: frames
// weigh what is drawn, and the guess's own density is divided out again.
#include <algorithm>
#include <cmath>

#include "event_paths.h"
#include "prescene/belief/body_names.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using geometry::Vector3d;

constexpr double kTrackedElsewhere = 0.006,
                 kTrackedTurned = 0.1;  // m and rad: tracked further from where it was, it has moved
constexpr double kTippedOver = 0.85;    // cosine of a tilt
constexpr double kSameHeight = 0.02;    // m; what ends within that of its height did not fall
constexpr double kFirstStep = 0.35;     // s
constexpr double kStopped = 0.03;       // m/s: it moves no more

double z_of(double uniform) { return core::inverse_normal_cdf(std::clamp(uniform, 1e-4, 1.0 - 1e-4)); }

/// The deviation in z of a deviation of the uniform number.
double z_deviation(double z, double deviation) {
  return std::clamp(deviation * std::sqrt(2.0 * 3.141592653589793) * std::exp(0.5 * z * z), 0.005, 1.0);
}

}  // namespace

TrackedMotion EventPaths::motion_of(std::size_t object) const {
  TrackedMotion motion;
  const SeenTrack& track = tracks_[object];
  const auto start = start_pose(object);
  const std::size_t n = track.times.size();
  const auto centre = [&](const belief::Pose& X_WO) {
    return Vector3d(X_WO * belief::mean(model(object).center_of_mass));
  };
  if (n > 0) motion.last = track.estimates.back().mode;
  if (!start) {  // not there at the start
    motion.moved = n > 0;
    motion.after = motion.back = n > 0 ? track.times.front() : duration_;
    for (const WindowFrame& frame : window_.frames) {
      const double t = core::seconds_of(frame.observation.stamp_ns - window_.start->stamp_ns);
      if (t < motion.after) motion.before = t;
    }
    motion.onset = 0.5 * (motion.before + motion.after);
    return motion;
  }
  std::size_t m = 0;
  while (m < n && (centre(track.estimates[m].mean) - centre(*start)).norm() < kTrackedElsewhere &&
         geometry::symmetric_angle(track.estimates[m].mean, *start, model(object).symmetry) < kTrackedTurned)
    ++m;
  motion.moved = m < n;
  motion.before = m > 0 ? track.times[m - 1] : 0.0;
  motion.after = duration_;
  for (auto frame = window_.frames.rbegin(); frame != window_.frames.rend(); ++frame) {
    const double t = core::seconds_of(frame->observation.stamp_ns - window_.start->stamp_ns);
    if (t > motion.before + 1e-6) motion.after = t;
  }
  motion.lost = motion.after < (m < n ? track.times[m] : duration_) - 1e-6;
  motion.back = m < n ? track.times[m] : duration_;
  motion.until = motion.after;
  motion.onset = 0.5 * (motion.before + motion.after);
  if (!motion.moved) return motion;
  std::size_t last = m;
  while (last + 1 < n && track.times[last + 1] <= track.times[m] + kFirstStep) ++last;
  motion.first_step = centre(track.estimates[last].mean) - centre(*start);
  const std::size_t second = std::min(m + 2, n - 1);
  const double between = track.times[second] - track.times[m];
  if (between > 0.0)
    motion.speed = (centre(track.estimates[second].mean) - centre(track.estimates[m].mean)).norm() / between;
  const double gone = (centre(track.estimates[m].mean) - centre(*start)).norm();
  motion.speed = std::max(motion.speed, gone / std::max(1e-3, track.times[m] - motion.before));
  motion.onset = std::clamp(track.times[m] - gone / std::max(0.02, motion.speed), motion.before, motion.after);
  for (std::size_t j = m; j + 1 < n; ++j) {
    const double dt = track.times[j + 1] - track.times[j];
    const double v = (centre(track.estimates[j + 1].mean) - centre(track.estimates[j].mean)).norm() / dt;
    if (v > kStopped) motion.until = track.times[j + 1];
  }
  return motion;
}

EventPaths::Hit EventPaths::hit_of(std::size_t object, const TrackedMotion& motion) const {
  Hit hit;
  const auto start = start_pose(object);
  if (!start) return hit;
  const Vector3d up = belief::up_of(*scene_);
  double lowest = 1e300, highest = -1e300;
  for (const Vector3d& vertex : shapes_[object].vertices) {
    lowest = std::min(lowest, up.dot(*start * vertex));
    highest = std::max(highest, up.dot(*start * vertex));
  }
  const belief::PhysicalParameters& physical = prior_.likeliest.objects[object].physical;
  const double middle = (up.dot(*start * physical.center_of_mass) - lowest) / std::max(1e-6, highest - lowest);
  const double upright = (start->rotation.conjugate() * up).dot(motion.last.rotation.conjugate() * up);
  // What stays upright was hit about as high as its centre, and slid until friction stopped it.
  const bool tipped = upright < kTippedOver;
  hit.height = tipped ? 0.5 * (middle + priors_.highest_touch) : middle;
  const Vector3d way = *start * physical.center_of_mass - motion.last * physical.center_of_mass;
  if (!tipped && std::abs(up.dot(way)) < kSameHeight)
    hit.speed = std::sqrt(2.0 * physical.friction * scene_->gravity_W.norm() * (way - up * up.dot(way)).norm());
  return hit;
}

void EventPaths::guess(const Hypothesis& hypothesis, TemperedTarget& target) const {
  const auto dimensions = static_cast<std::size_t>(event_dimensions(hypothesis));
  target.dimensions = this->dimensions(hypothesis);
  target.moved = static_cast<int>(dimensions);
  const TrackedMotion motion = motion_of(hypothesis.object);
  if (dimensions == 0 || hypothesis.kind == EventKind::kExchanged || (!motion.moved && !motion.lost)) return;
  std::vector<double> mean(dimensions, 0.0), deviation(dimensions, 1.0);
  const auto set = [&](std::size_t i, double value, double spread) {
    mean[i] = std::clamp(value, -3.5, 3.5);
    deviation[i] = std::clamp(spread, 0.01, 1.0);
  };
  const auto set_uniform = [&](std::size_t i, double value, double spread) {
    mean[i] = z_of(value);
    deviation[i] = z_deviation(mean[i], spread);
  };
  const bool carried = hypothesis.kind == EventKind::kMoved || hypothesis.kind == EventKind::kPutIn ||
                       hypothesis.kind == EventKind::kTakenAway || hypothesis.begins_otherwise;
  const bool was_there = is_present(hypothesis.object);
  SeenTimes seen = {motion.before, motion.after, was_there ? motion.after : motion.before,
                    was_there ? motion.back : motion.after};
  if (seen_[hypothesis.object]) seen = *seen_[hypothesis.object];
  const bool comes = hypothesis.kind == EventKind::kPutIn;
  const double before = !carried ? motion.before : comes ? seen.came_after : seen.left_after;
  const double after = !carried ? motion.after : comes ? seen.came_before : seen.left_before;
  const double when = carried ? 0.5 * (before + after) : motion.onset;
  if (!hypothesis.begins_otherwise) set_uniform(0, when / duration_, (0.02 + 0.4 * (after - before)) / duration_);
  if ((hypothesis.kind == EventKind::kPushed || hypothesis.kind == EventKind::kBumped) && motion.moved) {
    set_uniform(1, 0.5, 0.06);
    const bool pushed = hypothesis.kind == EventKind::kPushed;
    const double median = pushed ? priors_.push_speed : priors_.bump_speed;
    const double spread = pushed ? priors_.push_speed_spread : priors_.bump_speed_spread;
    double speed = std::max(0.03, motion.speed), speed_spread = 0.5;
    if (!pushed) {
      const Hit hit = hit_of(hypothesis.object, motion);
      set_uniform(2, (hit.height - priors_.lowest_touch) / (priors_.highest_touch - priors_.lowest_touch), 0.15);
      set_uniform(3, 0.5, 0.15);
      if (hit.speed > speed) speed = hit.speed, speed_spread = 0.35;
    }
    set(4, std::log(speed / median) / spread, speed_spread);
    if (pushed)
      set(5,
          std::log(std::max(0.05, motion.until - motion.onset) / priors_.push_duration) / priors_.push_duration_spread,
          0.6);
  }
  const bool put_down = hypothesis.kind == EventKind::kMoved || hypothesis.kind == EventKind::kPutIn;
  if ((put_down || hypothesis.begins_otherwise) && motion.moved) {
    const bool moved = hypothesis.kind == EventKind::kMoved;
    const bool drawn = seen_in_the_end_[hypothesis.object] == 0;  // else the frames say where
    const geometry::Vector3d from =
        moved ? start_pose(hypothesis.object)->translation : put_in_at_[hypothesis.object].translation;
    const geometry::Vector3d shift = motion.last.translation - from;
    if (moved)
      set(1,
          std::log(std::max(0.05, 0.5 * (seen.came_after + seen.came_before) - when) / priors_.carry_duration) /
              priors_.carry_duration_spread,
          0.5);
    for (std::size_t axis = 0; drawn && axis < 3; ++axis) {
      const double scale = axis < 2 ? priors_.carry_distance : priors_.carry_height;
      set(2 + axis, shift[static_cast<Eigen::Index>(axis)] / scale, 0.004 / scale);
    }
    if (drawn) {
      set_uniform(5, 0.5, 0.01);
      set(6, 1.0, 0.7);
    }
  }
  target.guess_mean = std::move(mean);
  target.guess_deviation = std::move(deviation);
}

}  // namespace prescene::queries
