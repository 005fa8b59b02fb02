// SPDX-License-Identifier: Apache-2.0
// Whether an object is tracked, doubtful, unseen or lost, and how probable it is that it is there at all, from the
// evidence of a frame.
#pragma once

#include "prescene/belief/belief.h"
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

/// By how much the limits of evidence are lowered for a pose that, were it right, would say so much on average (nats
/// per visible pixel): thin things on a known surface, transparent ones. In (0, 1], 1 for everything else.
double evidence_scale(double expected_evidence);

/// Sets state, evidence, visible share, counters and existence of `object` from a frame's report.
void update_track(const WeightReport& report, core::TimeNs stamp_ns, const TrackStateOptions& options,
                  belief::ObjectBelief& object);

/// The same for a frame that showed nothing of it.
void mark_unseen(core::TimeNs stamp_ns, const TrackStateOptions& options, belief::ObjectBelief& object);

}  // namespace prescene::filter
