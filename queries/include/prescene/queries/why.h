// SPDX-License-Identifier: Apache-2.0
// Why a pose is believed: what the frames of the last seconds, and each pixel of them, say for it and against it.
//
//   WhyContext context{frames_context, pixel_ratios};  // rendering::log_ratio_map, by whoever chooses backends
//   PRESCENE_TRY(WhyAnswer answer, why(frames, {.object = "mug"}, context));
//   answer.comparisons.front().text;          // "That the mug is there and not absent: 54.1 nats ..."
//
// An object's most probable pose is compared with its absence, with the likeliest alternative of the belief, or with a
// given pose. Each frame is weighed as the filter weighs it, by the same likelihood, with everything else where the
// belief after that frame has it. docs/reference/queries.md says what the numbers mean.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/why_question.h"
#include "prescene/core/clock.h"
#include "prescene/geometry/image.h"
#include "prescene/queries/explain.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::queries {

struct WhyQuery {
  std::string object;
  belief::WhyAgainst against = belief::WhyAgainst::kAbsenceAndAlternative;
  std::optional<belief::Pose> X_WO;  ///< Of WhyAgainst::kPose: where it would be now.
  int images = 3;                    ///< Frames of each comparison whose pixels are given. In [0, kMostWhyImages].
  core::TimeNs begin_ns = 0;         ///< Stamp that the texts' seconds count from.
};

/// What each pixel of the frame's camera says about a hypothesis, nats, NaN where it says nothing: they add up to
/// PoseEvidence::log_ratio. rendering::log_ratio_map is one.
using PixelRatios = std::function<geometry::Image<float>(const rendering::FrameTerms& frame,
                                                         const rendering::PoseHypothesis& hypothesis)>;

struct WhyContext {
  ExplainContext explain;
  PixelRatios pixels;
};

/// A log ratio by terms of the sensor model, nats; they add up to it.
struct WhyTerms {
  double surface = 0.0;  ///< Depth that both poses account for; against absence, depth within the outline.
  double outline = 0.0;  ///< Depth where one of both poses has the object alone; against absence, at the outline.
  double color = 0.0;    ///< What learned or given colours add to the two.
  double missing = 0.0;  ///< Pixels without depth.
  double sum() const { return surface + outline + color + missing; }
};

/// So many pixels of an object are hidden by something that is known.
struct HiddenBy {
  std::string name;  ///< Of an object; "" of others.
  enum class Kind { kObject, kRobot, kSupport } kind = Kind::kObject;
  int pixels = 0;
};

/// What a frame shows of the object at its most probable pose.
struct WhyView {
  core::TimeNs stamp_ns = 0;
  int camera = 0;
  belief::Pose X_WO;                 ///< In that frame.
  rendering::PoseEvidence evidence;  ///< Against absence; counts of pixels of the likelihood.
  std::vector<HiddenBy> hidden_by;   ///< Most pixels first.
};

/// What a frame says for the most probable pose and against what it is compared with.
struct WhyFrame {
  double log_ratio = 0.0;                         ///< nats, as the likelihood has it.
  double tempered = 0.0;                          ///< What it counts in the window.
  WhyTerms terms;                                 ///< Of log_ratio.
  double speaks_for = 0.0, speaks_against = 0.0;  ///< Sums of the pixels above 0, and below (negative).
  int pixels_for = 0, pixels_against = 0;         ///< How many these are.
};

/// Pixels of a frame, nats, NaN where neither pose has the object in sight. Of the size of the likelihood's image.
struct WhyImage {
  std::size_t frame = 0;
  geometry::Image<float> nats;
};

/// Where on the object the evidence of the deciding frame that says most lies, of the sign of the sum.
struct WhyPlace {
  std::string in_image;  ///< "on the left", ...; "" = all over it.
  /// The centroid of those pixels on the most probable pose's surface, in the object's frame, m; empty: none is on it.
  std::optional<geometry::Vector3d> p_OQ;
};

struct WhyComparison {
  belief::WhyAgainst against = belief::WhyAgainst::kAbsence;  ///< One of the last three.
  std::optional<belief::Pose> X_WO;                           ///< What it is compared with, now; empty: absence.
  std::optional<double> probability;                          ///< That the belief gives it; empty: of a given pose.
  double log_ratio = 0.0;                                     ///< Of all frames.
  double tempered = 0.0;
  WhyTerms terms, tempered_terms;     ///< Of the two.
  std::vector<WhyFrame> frames;       ///< In the order of WhyAnswer::views.
  std::vector<std::size_t> deciding;  ///< Fewest frames that hold half of what all say, either way; ascending.
  std::optional<WhyPlace> place;      ///< Where any pixel says anything.
  std::vector<WhyImage> images;       ///< Of the frames that say most, ascending.
  std::string text;                   ///< A paragraph.
};

struct WhyAnswer {
  std::string object;
  std::uint64_t step = 0;  ///< Of the belief whose pose is asked about, that after the newest frame.
  belief::Pose X_WO;       ///< Its most probable pose.
  double existence = 0.0;
  std::vector<WhyView> views;  ///< In the order of time.
  std::vector<WhyComparison> comparisons;
  std::vector<double> tempering;  ///< That a log ratio of each frame is multiplied by, in the order of `views`.
  std::string text;               ///< The texts of all comparisons, and what is seen of it.
  std::vector<std::string> remarks;
  bool cut_short = false;  ///< Time ran out: only the newest frames were looked at.
};

/// The most frames that are looked at; of more, evenly spread ones with the newest.
inline constexpr std::size_t kMostWhyFrames = 300;

/// `frames`, in the order of time, with the beliefs after them. kInvalidInput without frames and for a query out of
/// range; kNotFound for an object that the newest belief does not have (with the nearest names) or has lost, and where
/// it is compared with an alternative and has none; kResourceExhausted where images don't fit into
/// QueryContext::most_bytes; errors of filter::prepare_frame; kCancelled. After QueryContext::simulate_until no further
/// frame is looked at.
core::Result<WhyAnswer> why(std::span<const WindowFrame> frames, const WhyQuery& query, const WhyContext& context);

}  // namespace prescene::queries
