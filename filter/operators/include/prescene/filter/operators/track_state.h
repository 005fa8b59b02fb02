// SPDX-License-Identifier: Apache-2.0
// Whether an object is tracked, doubtful, unseen or lost, and how probable it is that it is there at all, from the
// evidence of a frame.
//
// Where several cameras see the scene, it is what the newest frames of all of them say together: evidence per pixel is
// the mean over the pixels of those that see the object, and an object is unseen when none of them sees it. The frame
// of a camera counts for two and a half of that camera's frame periods, so that one that stops soon says nothing more.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/operators/weight.h"

namespace prescene::filter {

struct TrackStateOptions {
  /// nats per pixel. A pose counts as tracked if the frame says at least this much for each of its visible pixels.
  /// Range 0 to 10. Measured: docs/studies/tracking.md.
  double tracked_evidence = 3.0;
  /// nats per pixel. A pose for which the frame says less than this is refuted; between the two limits it is doubtful.
  /// Range 0 to 10. Chosen.
  double lost_evidence = 1.0;
  /// frames. An object is lost when it was refuted in this many frames and was neither hidden nor better in any frame
  /// between them. Range 1 to 100. Chosen.
  int lost_after_frames = 4;
  /// s. An object that is unseen for longer than this is lost. Range 1 to 100000. Chosen.
  double unseen_lost_after = 60.0;
};

/// Whether the object is believed to be there: not lost, and more probably there than not.
bool is_present(const belief::ObjectBelief& object);

/// Whether others may take the object's surface for granted, where it hides them.
bool hides_others(const belief::ObjectBelief& object);

/// By how much the limits of evidence are lowered for a pose that, were it right, would say so much on average (nats
/// per visible pixel): thin things on a known surface, transparent ones. In (0, 1], 1 for everything else.
double evidence_scale(double expected_evidence);

/// Which cameras there are, and the frames that they have given. `newest`: the frame that is taken now.
struct TrackedBy {
  const std::vector<belief::CameraRecord>& cameras;  ///< As belief::Belief's: empty where there is one.
  int camera = 0;                                    ///< Whose frame it is.
  core::TimeNs stamp_ns = 0;
};

/// Counts a frame that is used among those of its camera. Nothing where one camera sees the scene.
void note_frame(const belief::Observation& observation, belief::Belief& belief);
/// The number of this camera's frames up to now, by which what is done in every n-th frame takes turns; belief.step
/// where one camera sees the scene.
std::uint64_t frames_of(const belief::Belief& belief, int camera);

/// Whether the camera's newest frame shows the object: true where one camera sees the scene.
bool is_shown_by(const belief::ObjectBelief& object, int camera);
/// Whether it was unseen in the frame of this camera before. In a camera's first frame it was.
bool was_unseen_by(const belief::ObjectBelief& object, int camera);
/// How many cameras' newest frames show it, at least 1.
int seeing_cameras(const TrackedBy& by, const belief::ObjectBelief& object);

/// Sets state, evidence, visible share, counters and existence of `object` from a frame's report.
void update_track(const WeightReport& report, const TrackedBy& by, const TrackStateOptions& options,
                  belief::ObjectBelief& object);

/// The same for a frame that showed nothing of it.
void mark_unseen(const TrackedBy& by, const TrackStateOptions& options, belief::ObjectBelief& object);

/// The camera's frame shows it where it was found just now; its evidence comes with the next frame. That it is
/// elsewhere is no motion that anything is learned from.
void mark_found(const TrackedBy& by, belief::ObjectBelief& object);

}  // namespace prescene::filter
