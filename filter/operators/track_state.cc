// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/track_state.h"

#include <algorithm>
#include <cmath>

#include "motion_following.h"

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
// Evidence is averaged over so many frames that the limit is this far below what a right pose says, but over no more
// than half a second at 30 Hz.
constexpr double kClearDeviations = 3.0;
constexpr double kMostFrames = 15.0;

// A camera's newest frame counts for so many of its frame periods: one frame may be lost. Chosen.
constexpr double kFreshPeriods = 2.5;
constexpr core::TimeNs kFirstFreshNs = 250'000'000;  // where the period is not known yet
constexpr core::TimeNs kMostFreshNs = 3'000'000'000;

/// What frames say of an object.
struct Verdict {
  bool sees = false;
  double evidence_per_pixel = 0.0;
  double scale = 1.0;  // evidence_scale
  double newest_share = 1.0;
  double visible_share = 0.0;
  int visible_pixels = 0;
};

/// Share of this frame in the average of the evidence: 1 where one frame is enough to tell a right pose from a wrong
/// one. With a share g, the average has g / (2 - g) of the variance of a frame.
double newest_share(const WeightReport& report, const TrackStateOptions& options) {
  const double clear = report.expected_evidence - evidence_scale(report.expected_evidence) * options.tracked_evidence;
  const double ratio = kClearDeviations * report.evidence_deviation / std::max(clear, 1e-9);
  return 2.0 / (std::clamp(ratio * ratio, 1.0, kMostFrames) + 1.0);
}

Verdict verdict_of(const WeightReport& report, const TrackStateOptions& options) {
  Verdict verdict;
  verdict.sees = !(report.hidden_weight > 0.5 || report.visible_share < kLeastVisibleShare);
  verdict.evidence_per_pixel = report.evidence_per_pixel;
  verdict.scale = evidence_scale(report.expected_evidence);
  verdict.newest_share = newest_share(report, options);
  verdict.visible_share = report.visible_share;
  verdict.visible_pixels = report.visible_pixels;
  return verdict;
}

/// Evidence of the frame and of those before it, which `before` is of.
double averaged(const Verdict& frame, double before) {
  if (frame.newest_share >= 1.0) return frame.evidence_per_pixel;
  return before + frame.newest_share * (frame.evidence_per_pixel - before);
}

/// Whether the object's evidence is of a frame.
bool was_seen(const ObjectBelief& object) {
  return (object.state == TrackState::kTracked || object.state == TrackState::kDoubtful) &&
         object.evidence_per_pixel != 0.0;
}

void show(const Verdict& verdict, belief::CameraView& view) {
  view.sees = verdict.sees;
  view.evidence_per_pixel = verdict.evidence_per_pixel;
  view.evidence_scale = verdict.scale;
  view.visible_share = verdict.visible_share;
  view.visible_pixels = verdict.visible_pixels;
}

/// The camera's, made where there is none yet; null where one camera sees the scene.
belief::CameraView* view_of(const TrackedBy& by, ObjectBelief& object) {
  if (by.cameras.empty()) return nullptr;
  object.views.resize(by.cameras.size());
  return &object.views[static_cast<std::size_t>(by.camera)];
}

/// Those that see the object and count still.
std::vector<const belief::CameraView*> fresh_views(const TrackedBy& by, const ObjectBelief& object) {
  std::vector<const belief::CameraView*> fresh;
  for (std::size_t i = 0; i < std::min(object.views.size(), by.cameras.size()); ++i) {
    const belief::CameraRecord& camera = by.cameras[i];
    const core::TimeNs counts_for =
        camera.period_ns > 0
            ? std::min(kMostFreshNs,
                       static_cast<core::TimeNs>(std::llround(kFreshPeriods * static_cast<double>(camera.period_ns))))
            : kFirstFreshNs;
    if (object.views[i].sees && camera.frames > 0 && by.stamp_ns - camera.stamp_ns <= counts_for)
      fresh.push_back(&object.views[i]);
  }
  return fresh;
}

/// At least one view.
Verdict together(const std::vector<const belief::CameraView*>& views) {
  Verdict all{.sees = true};
  double evidence = 0.0, scale = 0.0;
  for (const belief::CameraView* view : views) {
    evidence += view->visible_pixels * view->evidence_per_pixel;
    scale += view->visible_pixels * view->evidence_scale;
    all.visible_share = std::max(all.visible_share, view->visible_share);
    all.visible_pixels += view->visible_pixels;
  }
  if (all.visible_pixels == 0) return all;
  all.evidence_per_pixel = evidence / all.visible_pixels;
  all.scale = scale / all.visible_pixels;
  return all;
}

void change_existence(double nats, ObjectBelief& object) {
  const double p = std::clamp(object.existence, 1e-6, 1.0 - 1e-6);
  const double odds = std::log(p / (1.0 - p)) + std::clamp(nats, -kExistenceRate, kExistenceRate);
  const double kept = std::clamp(odds, kLeastExistenceOdds, kMostExistenceOdds);
  object.existence = 1.0 / (1.0 + std::exp(-kept));
}

void nothing_sees(core::TimeNs stamp_ns, const TrackStateOptions& options, ObjectBelief& object) {
  ++object.frames_unseen;
  object.evidence_per_pixel = 0.0;
  object.visible_share = 0.0;
  // What was doubtful until now was seen, if not well.
  if (object.state == TrackState::kDoubtful && object.frames_refuted == 0) object.last_seen_ns = stamp_ns;
  object.frames_refuted = 0;
  const double unseen = 1e-9 * static_cast<double>(stamp_ns - object.last_seen_ns);
  if (object.state != TrackState::kLost)
    object.state = unseen > options.unseen_lost_after ? TrackState::kLost : TrackState::kUnseen;
}

/// `own`: of the frame, which sees the object; `all`: of all cameras, and of the frames before.
void take(const Verdict& own, const Verdict& all, core::TimeNs stamp_ns, const TrackStateOptions& options,
          ObjectBelief& object) {
  const double lost_evidence = all.scale * options.lost_evidence;
  object.evidence_per_pixel = all.evidence_per_pixel;
  object.visible_share = all.visible_share;
  change_existence(own.evidence_per_pixel - own.scale * options.lost_evidence, object);
  object.frames_refuted = all.evidence_per_pixel >= lost_evidence ? 0 : object.frames_refuted + 1;
  if (all.evidence_per_pixel >= all.scale * options.tracked_evidence && all.visible_pixels >= kTrackedPixels) {
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

}  // namespace

bool is_present(const ObjectBelief& object) {
  return object.state != TrackState::kLost && object.existence >= 0.5 && !object.particles.empty();
}

bool hides_others(const ObjectBelief& object) {
  return object.existence >= 0.5 && (object.state == TrackState::kTracked || object.state == TrackState::kDoubtful);
}

double evidence_scale(double expected_evidence) {
  return std::clamp(expected_evidence / kFullEvidence, kLeastScale, 1.0);
}

void note_frame(const belief::Observation& observation, belief::Belief& belief) {
  if (belief.cameras.empty()) return;
  belief::CameraRecord& camera = belief.cameras[static_cast<std::size_t>(observation.camera)];
  if (camera.frames > 0) camera.period_ns = observation.stamp_ns - camera.stamp_ns;
  ++camera.frames;
  camera.stamp_ns = observation.stamp_ns;
  camera.X_WC = observation.X_WC;
}

std::uint64_t frames_of(const belief::Belief& belief, int camera) {
  return belief.cameras.empty() ? belief.step : belief.cameras[static_cast<std::size_t>(camera)].frames;
}

bool is_shown_by(const ObjectBelief& object, int camera) {
  const auto number = static_cast<std::size_t>(camera);
  return object.views.empty() || (number < object.views.size() && object.views[number].sees);
}

bool was_unseen_by(const ObjectBelief& object, int camera) {
  return object.views.empty() ? object.state == TrackState::kUnseen : !is_shown_by(object, camera);
}

int seeing_cameras(const TrackedBy& by, const ObjectBelief& object) {
  return std::max(1, static_cast<int>(fresh_views(by, object).size()));
}

void mark_unseen(const TrackedBy& by, const TrackStateOptions& options, ObjectBelief& object) {
  if (belief::CameraView* view = view_of(by, object)) show(Verdict{}, *view);
  if (fresh_views(by, object).empty()) nothing_sees(by.stamp_ns, options, object);
}

void mark_found(const TrackedBy& by, ObjectBelief& object) {
  object.last_seen_ns = by.stamp_ns;
  note_known_better(belief::heaviest(object.particles).X_WO, object.motion);  // it did not come here within a frame
  if (belief::CameraView* view = view_of(by, object)) show(Verdict{.sees = true}, *view);
}

void update_track(const WeightReport& report, const TrackedBy& by, const TrackStateOptions& options,
                  ObjectBelief& object) {
  const Verdict frame = verdict_of(report, options);
  Verdict own = frame;
  belief::CameraView* view = view_of(by, object);
  if (view != nullptr ? view->sees && view->evidence_per_pixel != 0.0 : was_seen(object))
    own.evidence_per_pixel = averaged(frame, view != nullptr ? view->evidence_per_pixel : object.evidence_per_pixel);
  if (view != nullptr) show(own, *view);
  if (own.sees) {
    take(frame, view == nullptr ? own : together(fresh_views(by, object)), by.stamp_ns, options, object);
    return;
  }
  // What one camera does not see is no news while another sees it.
  if (!fresh_views(by, object).empty()) return;
  nothing_sees(by.stamp_ns, options, object);
  object.visible_share = report.visible_share;
}

}  // namespace prescene::filter
