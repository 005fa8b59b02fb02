// SPDX-License-Identifier: Apache-2.0
#include "motion_following.h"

#include <algorithm>
#include <cmath>

#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

using belief::EpisodeKind;
using belief::MotionEpisode;
using belief::MotionRecord;
using belief::MotionSample;
using geometry::Vector6d;

/// Share of a new frame in the mean pose of what lies still, at least: supports and cameras may drift.
constexpr double kLeastGain = 0.02;

constexpr int kRestFrames = 10;      // an object that is tracked for so many frames without moving lies still; chosen
constexpr double kBefore = 0.4;      // s; an episode begins so long before motion was noticed
constexpr double kLongest = 2.0;     // s; what lasts longer is judged by its beginning
constexpr double kLongestGap = 0.3;  // s; an episode in which the object is not tracked for longer is given up
constexpr int kFewestSamples = 5;    // of an episode
constexpr double kRestTime = 0.5;    // s; what lies still is simulated for so long

double seconds_between(core::TimeNs from, core::TimeNs to) { return 1e-9 * static_cast<double>(to - from); }

MotionSample sample_of(const belief::Belief& belief, const belief::ObjectEstimate& estimate) {
  return {belief.stamp_ns, estimate.mean, estimate.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), belief.robot};
}

std::vector<Pose> poses_of(const belief::Belief& belief) {
  std::vector<Pose> poses;
  for (const belief::ObjectBelief& object : belief.objects) poses.push_back(belief::heaviest(object.particles).X_WO);
  return poses;
}

/// So often in a row it is seen elsewhere before it counts as moved: a single frame may be wrong.
constexpr int kMovedFrames = 2;

/// Where what lies still is better known than from one frame. Errors of neighbouring frames are not independent: the
/// deviation shrinks to a third at most.
Vector6d still_deviation(const Vector6d& deviation, int frames) {
  return deviation / std::min(3.0, std::sqrt(static_cast<double>(std::max(1, frames))));
}

/// Moves the mean pose towards the new one.
void average(const Pose& X_WO, MotionRecord& record) {
  ++record.still_frames;
  const double gain = std::max(1.0 / record.still_frames, kLeastGain);
  record.X_still =
      geometry::normalized(geometry::box_plus(record.X_still, gain * geometry::box_minus(X_WO, record.X_still)));
}

void begin_anew(const Pose& X_WO, MotionRecord& record) {
  record.X_still = X_WO;
  record.still_frames = 1;
  record.moved_frames = 0;
  record.place_judged = false;
  record.recent.clear();
}

/// Stamps ascend: of cameras that take frames at one instant the last one counts.
void append(const MotionSample& sample, std::vector<MotionSample>& samples) {
  if (!samples.empty() && samples.back().stamp_ns == sample.stamp_ns)
    samples.back() = sample;
  else
    samples.push_back(sample);
}

void keep_recent(const MotionSample& sample, MotionRecord& record) {
  append(sample, record.recent);
  const auto first = std::find_if(record.recent.begin(), record.recent.end(), [&](const MotionSample& kept) {
    return seconds_between(kept.stamp_ns, sample.stamp_ns) <= kBefore;
  });
  record.recent.erase(record.recent.begin(), first);
}

/// It lies still: what lying here says is judged once.
MotionEpisode rest_episode(const belief::Belief& belief, const MotionSample& now, const MotionRecord& record) {
  MotionEpisode episode;
  episode.kind = EpisodeKind::kRest;
  episode.others = poses_of(belief);
  episode.closed = true;
  MotionSample sample = now;
  sample.X_WO = record.X_still;
  sample.deviation = still_deviation(now.deviation, record.still_frames);
  for (int i = 0; i <= 2; ++i) {
    sample.stamp_ns = now.stamp_ns + static_cast<core::TimeNs>(std::llround(0.5e9 * i * kRestTime));
    episode.samples.push_back(sample);
  }
  return episode;
}

MotionEpisode motion_episode(const belief::Belief& belief, const MotionSample& now, const MotionRecord& record) {
  MotionEpisode episode;
  episode.others = poses_of(belief);
  episode.samples = record.recent;
  MotionSample& start = episode.samples.front();
  start.X_WO = record.X_still;
  start.deviation = still_deviation(start.deviation, record.still_frames);
  append(now, episode.samples);
  return episode;
}

}  // namespace

std::vector<belief::KinematicBody::Waypoint> with_corners(const std::vector<belief::KinematicBody::Waypoint>& seen) {
  std::vector<belief::KinematicBody::Waypoint> path;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    path.push_back(seen[k]);
    if (k == 0 || k + 2 >= seen.size()) continue;
    const auto velocity = [&](std::size_t from) -> geometry::Vector3d {
      return (seen[from + 1].X_WG.translation - seen[from].X_WG.translation) / (seen[from + 1].time - seen[from].time);
    };
    const geometry::Vector3d before = velocity(k - 1), after = velocity(k + 1), change = before - after;
    const double fastest = std::max(before.norm(), after.norm());
    if (!(change.norm() > 0.2 * fastest)) continue;
    const double length = seen[k + 1].time - seen[k].time;
    const geometry::Vector3d step = seen[k + 1].X_WG.translation - seen[k].X_WG.translation;
    const double corner = (step - length * after).dot(change) / change.squaredNorm();
    if (!(corner > 0.02 * length && corner < 0.98 * length)) continue;
    Pose X_WG = geometry::interpolate(seen[k].X_WG, seen[k + 1].X_WG, corner / length);
    X_WG.translation =
        0.5 * (seen[k].X_WG.translation + corner * before + seen[k + 1].X_WG.translation - (length - corner) * after);
    path.push_back({seen[k].time + corner, X_WG});
  }
  return path;
}

void note_known_better(const Pose& X_WO, MotionRecord& record) {
  if (record.still_frames == 0) return;
  if (record.episode && !record.episode->closed) record.episode.reset();
  const bool place_judged = record.place_judged;
  begin_anew(X_WO, record);
  record.place_judged = place_judged;
}

void follow_motion(const belief::Belief& belief, int object, MotionRecord& record) {
  const belief::ObjectBelief& mine = belief.objects[static_cast<std::size_t>(object)];
  const bool judging = record.episode && record.episode->closed;
  const bool held = holder_of(*belief.scene, object).has_value();
  const bool let_go = record.held && !held;
  record.held = held;
  if (held) {
    record.still_frames = 0;
    record.recent.clear();
    if (!judging) record.episode.reset();
    return;
  }
  if (record.episode && !judging &&
      seconds_between(record.episode->samples.back().stamp_ns, belief.stamp_ns) > kLongestGap)
    record.episode.reset();
  if (mine.state != belief::TrackState::kTracked) return;

  const belief::ObjectEstimate estimate = belief::estimate(belief, mine);
  MotionSample now = sample_of(belief, estimate);
  if (let_go && !judging) {
    begin_anew(now.X_WO, record);
    keep_recent(now, record);
    record.episode.emplace();
    record.episode->kind = EpisodeKind::kRelease;
    record.episode->samples = {now};
    record.episode->V_start = estimate.twist;
    record.episode->others = poses_of(belief);
    return;
  }
  if (record.still_frames == 0) {
    begin_anew(now.X_WO, record);
    keep_recent(now, record);
    return;
  }
  const belief::ObjectModel& model = belief::model_of(belief, mine);
  now.X_WO = geometry::closest_equivalent(now.X_WO, record.X_still, model.symmetry);
  const Vector6d moved = geometry::box_minus(now.X_WO, record.X_still);
  // What rests and is believed to be turned otherwise from one frame to the next has not moved: it is known better.
  if (estimate.motion == belief::MotionMode::kResting && !record.recent.empty() &&
      geometry::symmetric_angle(now.X_WO, record.recent.back().X_WO, model.symmetry) >= kRivalTurn) {
    note_known_better(now.X_WO, record);
    keep_recent(now, record);
    return;
  }
  const bool moves = moved.tail<3>().norm() > std::max(kStartShift, 3.0 * now.deviation.tail<3>().maxCoeff()) ||
                     moved.head<3>().norm() > std::max(kStartTurn, 3.0 * now.deviation.head<3>().maxCoeff());
  // It came here while nothing showed how.
  const bool was_followed =
      !record.recent.empty() && seconds_between(record.recent.back().stamp_ns, belief.stamp_ns) <= kLongestGap;
  if (moves && !was_followed) {
    begin_anew(now.X_WO, record);
    keep_recent(now, record);
    return;
  }
  record.moved_frames = moves ? record.moved_frames + 1 : 0;
  const bool lay_still = record.still_frames >= kRestFrames;
  const bool moved_for_good = moves && (!lay_still || record.moved_frames >= kMovedFrames);
  if (record.episode && !judging) {
    append(now, record.episode->samples);
    const bool long_enough = seconds_between(record.episode->samples.front().stamp_ns, now.stamp_ns) >= kLongest;
    record.episode->closed = long_enough || (!moves && record.still_frames + 1 >= kRestFrames);
    if (record.episode->closed && std::ssize(record.episode->samples) < kFewestSamples) record.episode.reset();
  } else if (!record.episode && moved_for_good && lay_still) {
    record.episode = motion_episode(belief, now, record);
  }
  if (moved_for_good) {
    begin_anew(now.X_WO, record);
  } else if (!moves) {
    average(now.X_WO, record);
    if (!record.episode && !record.place_judged && record.still_frames >= kRestFrames) {
      record.place_judged = true;
      record.episode = rest_episode(belief, now, record);
    }
  }
  keep_recent(now, record);
}

}  // namespace prescene::filter
