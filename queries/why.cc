// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/why.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "prescene/belief/alternative_poses.h"
#include "prescene/core/check.h"
#include "prescene/core/spelling.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/symmetry.h"
#include "why_frames.h"
#include "why_text.h"
#include "window_likelihood.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using belief::WhyAgainst;

// Back in time, the pose is that of the likeliest particle near where the object was a frame later: nearer in turn than
// rivals are, and no farther than what is not thrown comes.
constexpr double kSameTurn = 15.0 * geometry::kDegree;
constexpr double kSamePlace = 0.05;       // m
constexpr double kFastestFollowed = 0.5;  // m/s

void add(const WhyTerms& terms, double factor, WhyTerms& sum) {
  sum.surface += factor * terms.surface;
  sum.outline += factor * terms.outline;
  sum.color += factor * terms.color;
  sum.missing += factor * terms.missing;
}

/// The fewest frames that hold half of what all say, either way.
std::vector<std::size_t> deciding_of(const std::vector<WhyFrame>& frames) {
  std::vector<std::size_t> order(frames.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(frames[a].tempered) > std::abs(frames[b].tempered);
  });
  double all = 0.0, sum = 0.0;
  for (const WhyFrame& frame : frames) all += std::abs(frame.tempered);
  std::vector<std::size_t> deciding;
  for (const std::size_t k : order) {
    if (!(sum < 0.5 * all)) break;
    sum += std::abs(frames[k].tempered);
    deciding.push_back(k);
  }
  std::sort(deciding.begin(), deciding.end());
  return deciding;
}

class Reasons {
 public:
  Reasons(std::span<const WindowFrame> frames, const WhyQuery& query, const WhyContext& context,
          const filter::FilterTools& tools)
      : frames_(frames), query_(query), context_(context), newest_(*frames.back().belief), judge_(context, tools) {}

  core::Result<WhyAnswer> run() {
    PRESCENE_TRY(const std::size_t object, asked_object());
    const belief::ObjectBelief& asked = newest_.objects[object];
    symmetry_ = belief::model_of(newest_, asked).symmetry;
    answer_.object = asked.name;
    answer_.step = newest_.step;
    answer_.X_WO = belief::heaviest(asked.particles).X_WO;
    answer_.existence = asked.existence;
    PRESCENE_RETURN_IF_ERROR(choose_comparisons(asked));
    PRESCENE_RETURN_IF_ERROR(judge_frames());
    finish();
    return std::move(answer_);
  }

 private:
  core::Result<std::size_t> asked_object() const {
    const auto index = belief::find_object(newest_, query_.object);
    if (!index) {
      std::vector<std::string> names;
      for (const belief::ObjectBelief& object : newest_.objects) names.push_back(object.name);
      const std::string near = core::did_you_mean(query_.object, names);
      return core::not_found("there is no object '" + query_.object + "': " +
                             (names.empty()  ? "the belief holds none"
                              : near.empty() ? "the objects are " + core::comma_list(names)
                                             : near));
    }
    const belief::ObjectBelief& object = newest_.objects[static_cast<std::size_t>(*index)];
    if (object.state == belief::TrackState::kLost || object.particles.empty())
      return core::not_found("'" + query_.object +
                             "' is lost, so that no pose of it is believed: ask again when it is found, or with 'to' "
                             "before it was lost");
    return static_cast<std::size_t>(*index);
  }

  core::Status choose_comparisons(const belief::ObjectBelief& asked) {
    const auto add_comparison = [&](WhyAgainst against, std::optional<Pose> X_WQ, std::optional<double> probability) {
      WhyComparison& comparison = answer_.comparisons.emplace_back();
      comparison.against = against;
      comparison.X_WO = std::move(X_WQ);
      comparison.probability = probability;
    };
    const bool both = query_.against == WhyAgainst::kAbsenceAndAlternative;
    if (both || query_.against == WhyAgainst::kAbsence)
      add_comparison(WhyAgainst::kAbsence, std::nullopt, 1.0 - asked.existence);
    if (both || query_.against == WhyAgainst::kAlternative) {
      const std::vector<belief::AlternativePose> alternatives = belief::alternative_poses(newest_, asked);
      if (!alternatives.empty())
        add_comparison(WhyAgainst::kAlternative, alternatives.front().X_WO, alternatives.front().probability);
      else if (!both)
        return core::not_found("the belief has no alternative to the pose of '" + query_.object +
                               "': compare with \"absence\" or with a pose");
    }
    if (query_.against == WhyAgainst::kPose) add_comparison(WhyAgainst::kPose, query_.X_WO, std::nullopt);
    return core::ok_status();
  }

  /// The newest first, evenly spread.
  std::vector<std::size_t> chosen() {
    const std::size_t every = (frames_.size() + kMostWhyFrames - 1) / kMostWhyFrames;
    std::vector<std::size_t> numbers;
    for (std::size_t back = 0; back < frames_.size(); back += every) numbers.push_back(frames_.size() - 1 - back);
    if (every > 1)
      answer_.remarks.push_back("Of " + std::to_string(frames_.size()) + " frames, " + std::to_string(numbers.size()) +
                                " were looked at.");
    return numbers;
  }

  /// Where it was in a belief before, if it was at X_WO `seconds` later; empty where that belief had lost it.
  std::optional<Pose> followed_back(const belief::Belief& belief, const belief::ObjectBelief& object, const Pose& X_WO,
                                    double seconds) {
    if (&belief == &newest_) return X_WO;
    if (object.state == belief::TrackState::kLost || object.particles.empty()) return std::nullopt;
    const double reach = kSamePlace + kFastestFollowed * seconds;
    const belief::Particle* likeliest = nullptr;
    for (const belief::Particle& particle : object.particles) {
      if ((particle.X_WO.translation - X_WO.translation).norm() > reach ||
          geometry::symmetric_angle(particle.X_WO, X_WO, symmetry_) > kSameTurn)
        continue;
      if (likeliest == nullptr || particle.log_weight > likeliest->log_weight) likeliest = &particle;
    }
    if (likeliest != nullptr) return geometry::closest_equivalent(likeliest->X_WO, X_WO, symmetry_);
    const Pose& other = belief::heaviest(object.particles).X_WO;
    // Turned otherwise, it is judged as it is believed to be turned now. Elsewhere, it was moved.
    if ((other.translation - X_WO.translation).norm() <= reach) {
      ++turned_;
      return X_WO;
    }
    ++jumped_;
    return geometry::closest_equivalent(other, X_WO, symmetry_);
  }

  core::Status judge_frames() {
    const std::vector<std::size_t> numbers = chosen();
    const Pose X_ON = answer_.X_WO.inverse();
    Pose X_WO = answer_.X_WO;
    core::TimeNs later_ns = frames_.back().observation.stamp_ns;
    const QueryContext& limits = context_.explain.simulation;
    std::size_t lost = 0;
    for (const std::size_t n : numbers) {
      if (limits.cancellation != nullptr && limits.cancellation->requested())
        return core::cancelled("stopped on request before all frames were looked at");
      if (limits.simulate_until && !judged_.empty() && core::Cancellation::Clock::now() >= *limits.simulate_until) {
        answer_.cut_short = true;
        break;
      }
      const WindowFrame& seen = frames_[n];
      const auto index = belief::find_object(*seen.belief, query_.object);
      std::optional<Pose> X_WOn;
      if (index)
        X_WOn = followed_back(*seen.belief, seen.belief->objects[static_cast<std::size_t>(*index)], X_WO,
                              core::seconds_of(later_ns - seen.observation.stamp_ns));
      if (!X_WOn) {
        ++lost;
        continue;
      }
      X_WO = *X_WOn;
      later_ns = seen.observation.stamp_ns;
      // What it is compared with is as far off as it is now, and goes with it.
      std::vector<std::optional<Pose>> others;
      for (const WhyComparison& comparison : answer_.comparisons)
        others.push_back(comparison.X_WO ? std::optional(X_WO * (X_ON * *comparison.X_WO)) : std::nullopt);
      PRESCENE_TRY(JudgedFrame judged,
                   judge_.judge(seen, static_cast<std::size_t>(*index), X_WO, others, kept_images()));
      judged_.push_back(std::move(judged));
      keep_largest_images();
      if (limits.progress)
        limits.progress({static_cast<double>(judged_.size() + lost) / static_cast<double>(numbers.size()), std::nullopt,
                         "looking at frames"});
    }
    PRESCENE_CHECK(!judged_.empty());  // The newest has it.
    std::reverse(judged_.begin(), judged_.end());
    const auto remark = [&](std::size_t count, const std::string& what) {
      if (count > 0) answer_.remarks.push_back(std::to_string(count) + (count == 1 ? " frame " : " frames ") + what);
    };
    remark(lost, "of when the object was not found, or lost, were left out.");
    remark(turned_, "of when the belief had it turned otherwise were judged as it is believed to be turned now.");
    remark(jumped_, "came before it moved too fast to be followed back: it is where the belief had it then.");
    if (answer_.cut_short)
      answer_.remarks.push_back("Time ran out: only the newest " + std::to_string(judged_.size()) +
                                " frames were looked at.");
    return core::ok_status();
  }

  std::size_t kept_images() const { return answer_.comparisons.size() * (static_cast<std::size_t>(query_.images) + 1); }

  /// Of the frames that say most, of each comparison.
  void keep_largest_images() {
    for (std::size_t c = 0; c < answer_.comparisons.size(); ++c) {
      std::size_t kept = 0;
      JudgedComparison* smallest = nullptr;
      for (JudgedFrame& judged : judged_) {
        JudgedComparison& one = judged.comparisons[c];
        if (one.nats.empty()) continue;
        ++kept;
        if (smallest == nullptr || std::abs(one.frame.log_ratio) <= std::abs(smallest->frame.log_ratio))
          smallest = &one;
      }
      if (kept > static_cast<std::size_t>(query_.images)) smallest->nats = {};
    }
  }

  void finish() {
    double pixels = 1.0;  // One number for all, so that all compare.
    for (const JudgedFrame& judged : judged_) pixels = std::max(pixels, judged.pixels);
    for (JudgedFrame& judged : judged_) {
      answer_.tempering.push_back(window_tempering(judged.tempering, pixels, judged.step, judged_.size()));
      answer_.views.push_back(std::move(judged.view));
    }
    for (std::size_t c = 0; c < answer_.comparisons.size(); ++c) {
      WhyComparison& comparison = answer_.comparisons[c];
      std::size_t most = 0;
      for (std::size_t k = 0; k < judged_.size(); ++k) {
        JudgedComparison& one = judged_[k].comparisons[c];
        one.frame.tempered = answer_.tempering[k] * one.frame.log_ratio;
        comparison.log_ratio += one.frame.log_ratio;
        comparison.tempered += one.frame.tempered;
        add(one.frame.terms, 1.0, comparison.terms);
        add(one.frame.terms, answer_.tempering[k], comparison.tempered_terms);
        if (std::abs(one.frame.tempered) > std::abs(judged_[most].comparisons[c].frame.tempered)) most = k;
        if (!one.nats.empty()) comparison.images.push_back({k, std::move(one.nats)});
        comparison.frames.push_back(one.frame);
      }
      comparison.deciding = deciding_of(comparison.frames);
      comparison.place = judged_[most].comparisons[c].place;
    }
    for (WhyComparison& comparison : answer_.comparisons) {
      comparison.text = text_of(comparison, answer_, symmetry_, query_.begin_ns);
      answer_.text += comparison.text;
    }
    answer_.text += seen_text(answer_);
    for (WhyComparison& comparison : answer_.comparisons) comparison.text.pop_back();  // the space at the end
    if (belief::model_of(newest_, newest_.objects[index_of_asked()]).look && context_.explain.settings.print.use)
      answer_.remarks.emplace_back(
          "The filter also weighs the print of its surface, which the kept frames are too coarse to show.");
  }

  std::size_t index_of_asked() const { return static_cast<std::size_t>(*belief::find_object(newest_, query_.object)); }

  std::span<const WindowFrame> frames_;
  const WhyQuery& query_;
  const WhyContext& context_;
  const belief::Belief& newest_;
  FrameJudge judge_;
  geometry::SymmetryGroup symmetry_;
  WhyAnswer answer_;
  std::vector<JudgedFrame> judged_;  // the newest first, until all are
  std::size_t turned_ = 0, jumped_ = 0;
};

}  // namespace

core::Result<WhyAnswer> why(std::span<const WindowFrame> frames, const WhyQuery& query, const WhyContext& context) {
  if (frames.empty())
    return core::invalid_input("there is no frame in the window: give a longer one, or one in which frames came");
  if (query.images < 0 || query.images > belief::kMostWhyImages)
    return core::invalid_input("images: give 0 to " + std::to_string(belief::kMostWhyImages) + ", not " +
                               std::to_string(query.images));
  if ((query.against == WhyAgainst::kPose) != query.X_WO.has_value())
    return core::invalid_input("against: a pose is needed to compare with a pose, and with nothing else");
  for (const WindowFrame& frame : frames)
    if (!frame.belief || !frame.belief->scene || frame.belief->step == 0)
      return core::invalid_input("a frame has no belief: give each that after it");
  const ExplainContext& explain = context.explain;
  PRESCENE_CHECK(explain.likelihood != nullptr && explain.simulation.pool != nullptr &&
                 explain.simulation.meshes != nullptr && context.pixels);
  if (!explain.simulation.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  PRESCENE_TRY(const auto renderer, explain.simulation.make_renderer());
  filter::PoseSearch search(*explain.likelihood, *explain.simulation.pool);
  const filter::FilterTools tools{&search, renderer.get(), explain.simulation.meshes};
  return Reasons(frames, query, context, tools).run();
}

}  // namespace prescene::queries
