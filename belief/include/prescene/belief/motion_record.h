// SPDX-License-Identifier: Apache-2.0
// What the filter remembers of an object's motion: where it is in the hand that holds it, where it lies still, and,
// while it moves and until its physical parameters were learned from that, how it moved. Part of the belief, so that a
// filter itself remembers nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/geometry/pose.h"

namespace prescene::belief {

using geometry::Pose;
using geometry::Twist;
using geometry::Vector6d;

/// Where an object was seen to be.
struct MotionSample {
  core::TimeNs stamp_ns = 0;
  Pose X_WO;
  /// Standard deviations of X_WO, in the coordinates of geometry::box_plus (rad, m).
  Vector6d deviation = Vector6d::Zero();
  std::vector<Pose> robot;  ///< Poses of the scene's robot bodies at that time.
  friend bool operator==(const MotionSample&, const MotionSample&) = default;
};

/// What an episode is evidence of.
enum class EpisodeKind {
  kRest,     ///< It lies still where it lies, for a while.
  kMotion,   ///< It lay still, then something moved it.
  kRelease,  ///< A hand let go of it.
};

/// A piece of motion whose start is known, compared with the simulator's prediction under each draw of the parameters.
struct MotionEpisode {
  EpisodeKind kind = EpisodeKind::kMotion;
  /// The first is the start, from where it is simulated; stamps ascend.
  std::vector<MotionSample> samples;
  Twist V_start;             ///< Of O's origin, in W.
  std::vector<Pose> others;  ///< Poses of the belief's objects at the start, by index.
  bool closed = false;       ///< Nothing is added any more; it is being judged.
  bool probed = false;       ///< The extreme draws were found to differ.
  /// Of the runs that were simulated so far, those of one after those of the other.
  std::vector<double> run_errors;
  friend bool operator==(const MotionEpisode&, const MotionEpisode&) = default;
};

/// Where a held object is in the hand that holds it.
struct GripRecord {
  Pose X_GO;             ///< In the hand, the mean over `frames`.
  int frames = 0;        ///< 0 = not known yet.
  int apart_frames = 0;  ///< Consecutive frames in which it was seen elsewhere.
  friend bool operator==(const GripRecord&, const GripRecord&) = default;
};

struct MotionRecord {
  Pose X_still;                      ///< Where it lies still, the mean over `still_frames`.
  int still_frames = 0;              ///< 0 = it does not.
  int moved_frames = 0;              ///< Consecutive frames in which it was seen elsewhere.
  bool place_judged = false;         ///< The evidence of its lying there has been used.
  bool held = false;                 ///< In the step before.
  int episodes_unexplained = 0;      ///< That no draw explained, and that therefore changed nothing.
  std::vector<MotionSample> recent;  ///< The last frames, while it lies still.
  std::optional<MotionEpisode> episode;
  friend bool operator==(const MotionRecord&, const MotionRecord&) = default;
};

}  // namespace prescene::belief
