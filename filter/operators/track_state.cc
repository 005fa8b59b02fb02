// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/track_state.h"

#include <algorithm>
#include <cmath>

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::TrackState;

constexpr double kExistenceRate = 0.5;        // nats; largest change of the log odds of existence by one frame
constexpr double kLeastExistenceOdds = -5.0;  // nats; log odds are kept between these
constexpr double kMostExistenceOdds = 7.0;

/// nats per pixel; a pose of which so much or more is expected has to reach the limits in full. That of opaque things
/// in front of what is far or not known is 5.5 to 6.5.
constexpr double kFullEvidence = 6.0;
constexpr int kTrackedPixels = 5;            // at the likelihood's resolution; a pose with fewer is doubtful; chosen
constexpr double kLeastVisibleShare = 0.08;  // of the covered pixels; with less in sight nothing can be said; chosen
constexpr double kLeastScale = 0.15;         // however little is expected, some of it has to be seen

void change_existence(double nats, ObjectBelief& object) {
  const double p = std::clamp(object.existence, 1e-6, 1.0 - 1e-6);
  const double odds = std::log(p / (1.0 - p)) + std::clamp(nats, -kExistenceRate, kExistenceRate);
  const double kept = std::clamp(odds, kLeastExistenceOdds, kMostExistenceOdds);
  object.existence = 1.0 / (1.0 + std::exp(-kept));
}

}  // namespace

bool is_present(const ObjectBelief& object) {
  return object.state != TrackState::kLost && object.existence >= 0.5 && !object.particles.empty();
}

double evidence_scale(double expected_evidence) {
  return std::clamp(expected_evidence / kFullEvidence, kLeastScale, 1.0);
}

void mark_unseen(core::TimeNs stamp_ns, const TrackStateOptions& options, ObjectBelief& object) {
  ++object.frames_unseen;
  object.frames_refuted = 0;
  object.evidence_per_pixel = 0.0;
  object.visible_share = 0.0;
  const double unseen = 1e-9 * static_cast<double>(stamp_ns - object.last_seen_ns);
  if (object.state != TrackState::kLost)
    object.state = unseen > options.unseen_lost_after ? TrackState::kLost : TrackState::kUnseen;
}

void update_track(const WeightReport& report, core::TimeNs stamp_ns, const TrackStateOptions& options,
                  ObjectBelief& object) {
  if (report.hidden_weight > 0.5 || report.visible_share < kLeastVisibleShare) {
    mark_unseen(stamp_ns, options, object);
    object.visible_share = report.visible_share;
    return;
  }
  const double scale = evidence_scale(report.expected_evidence);
  const double lost_evidence = scale * options.lost_evidence;
  object.evidence_per_pixel = report.evidence_per_pixel;
  object.visible_share = report.visible_share;
  change_existence(report.evidence_per_pixel - lost_evidence, object);
  object.frames_refuted = report.evidence_per_pixel >= lost_evidence ? 0 : object.frames_refuted + 1;
  if (report.evidence_per_pixel >= scale * options.tracked_evidence && report.visible_pixels >= kTrackedPixels) {
    object.state = TrackState::kTracked;
    object.frames_unseen = 0;
    object.last_seen_ns = stamp_ns;
    return;
  }
  ++object.frames_unseen;
  if (object.frames_refuted >= options.lost_after_frames) {
    object.state = TrackState::kLost;
  } else if (object.frames_refuted == 0 || object.state != TrackState::kLost) {
    object.state = TrackState::kDoubtful;
  }
}

}  // namespace prescene::filter
