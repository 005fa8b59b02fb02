// SPDX-License-Identifier: Apache-2.0
// Whether an object is tracked, doubtful, unseen or lost, and how probable it is that it is there at all, from the
// evidence of a frame.
#pragma once

#include "prescene/belief/belief.h"
#include "prescene/filter/operators/weight.h"

namespace prescene::filter {

struct TrackStateOptions {
  double tracked_evidence = 3.0;  ///< Nats per visible pixel from which a pose counts as tracked ...
  int tracked_pixels = 5;      ///< ... if so many pixels show it, at the likelihood's resolution; else it is doubtful.
  double lost_evidence = 1.0;  ///< Below this it is refuted; between, it is doubtful.
  int lost_after_frames = 4;   ///< Refuted so often without a better frame or hiding in between, it is lost.
  double min_visible_share = 0.08;   ///< Of the covered pixels: with less, nothing can be said.
  double unseen_lost_after = 60.0;   ///< s
  double existence_rate = 0.5;       ///< Largest change of the log odds of existence by one frame.
  double min_existence_odds = -5.0;  ///< Log odds are kept between these.
  double max_existence_odds = 7.0;
};

/// Sets state, evidence, visible share, counters and existence of `object` from a frame's report.
void update_track(const WeightReport& report, core::TimeNs stamp_ns, const TrackStateOptions& options,
                  belief::ObjectBelief& object);

/// The same for a frame that showed nothing of it.
void mark_unseen(core::TimeNs stamp_ns, const TrackStateOptions& options, belief::ObjectBelief& object);

}  // namespace prescene::filter
