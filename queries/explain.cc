// SPDX-License-Identifier: Apache-2.0
// Observation explanation: X*_t+1 ~ P(X_t+1 | U_t, X_t, Z_t+1, C_t+1), over events that nobody reported.
#include "prescene/queries/explain.h"

#include <algorithm>
#include <cmath>

#include "candidate_objects.h"
#include "event_hypotheses.h"
#include "event_paths.h"
#include "explain_answer.h"
#include "explain_text.h"
#include "other_motion.h"
#include "prescene/core/spelling.h"
#include "prescene/queries/smallest_change.h"
#include "prescene/queries/tempered_smc.h"
#include "simulated_changes.h"
#include "weigh_events.h"
#include "window_likelihood.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using Clock = core::Cancellation::Clock;

constexpr int kFirstRuns = 1;
constexpr int kLaterFirstPoints = 2;        // times the points of a run, that are drawn where the runs before found it
constexpr int kMostRounds = 2;              // times the query's runs: of what stays uncertain
constexpr double kHopeless = 25.0;          // nats: what is so far behind the best is not searched further
constexpr double kMayMatter = 0.01;         // probability from which on an event that was not searched is named
constexpr std::size_t kPointsInHaste = 24;  // of a posterior, that are worked out when the time is out
constexpr int kFreshRuns = 1000;            // numbers of runs from here on are for what must not have been seen
constexpr double kLikelierThanSeen =
    3.0;  // nats: by which frames may be likelier than the best of some dozens of poses

class Explainer {
 public:
  Explainer(const ExplainWindow& window, const ExplainQuery& query, const ExplainContext& context,
            const filter::FilterTools& tools)
      : window_(window), query_(query), context_(context), tools_(tools) {}

  core::Result<ExplainAnswer> run() {
    PRESCENE_TRY(events_, EventPaths::create(window_, context_, query_.priors, query_.seed));
    PRESCENE_TRY(const std::optional<std::size_t> asked, asked_object());
    PRESCENE_RETURN_IF_ERROR(look_up_wanted());
    chosen_ = telling_frames(window_.frames, query_.frames);
    for (const std::size_t i : chosen_) frames_.push_back(window_.frames[i]);
    likelihood_ = std::make_unique<WindowLikelihood>(*window_.start, events_->objects(), frames_, context_, tools_);
    PRESCENE_RETURN_IF_ERROR(likelihood_->prepare());
    for (std::size_t k = 0; k < likelihood_->frames(); ++k)
      times_.push_back(core::seconds_of(likelihood_->stamp(k) - window_.start->stamp_ns));
    events_->set_times(times_);
    likelihood_->set_base(events_->base());
    CandidateObjects looked(*events_, *likelihood_, times_, query_);
    for (const std::size_t last : last_of_cameras(frames_))
      PRESCENE_RETURN_IF_ERROR(looked.look_for_missing(frames_[last], context_, tools_));
    if (asked && !looked.may_be_explained(*asked)) return lost_for_good();
    const std::vector<std::size_t> candidates = asked ? std::vector{*asked} : looked.to_look_at();
    for (const std::size_t object : candidates) looked.note_when_seen(object);
    looked.look_for_peaks(candidates);
    evaluated_ += looked.evaluated();
    remarks_.insert(remarks_.end(), looked.remarks().begin(), looked.remarks().end());
    const std::vector<Hypothesis> hypotheses = hypotheses_about(candidates, *events_, query_.weights, *tools_.meshes);
    PRESCENE_RETURN_IF_ERROR(search_all(candidates, hypotheses));
    PRESCENE_RETURN_IF_ERROR(search_rivals());
    PRESCENE_RETURN_IF_ERROR(narrow_intervals());
    PRESCENE_RETURN_IF_ERROR(events_->failure());
    remark_what_was_cut_short();
    JudgedEvents judged{window_, *events_, *likelihood_, times_, nothings_, judged_, chosen_};
    if (out_of_time_) judged.points = kPointsInHaste;
    ExplainAnswer answer = explain_answer(judged);
    if (query_.change) {
      add_change(answer);
      PRESCENE_RETURN_IF_ERROR(events_->failure());
    }
    if (cancelled()) return stopped();
    answer.evaluated += evaluated_;
    answer.cut_short = out_of_time_;
    answer.remarks.insert(answer.remarks.end(), remarks_.begin(), remarks_.end());
    answer.remarks.emplace_back(
        "Intervals say how precisely the evidence was computed, not how well events are modelled.");
    return answer;
  }

 private:
  bool cancelled() const {
    return context_.simulation.cancellation != nullptr && context_.simulation.cancellation->requested();
  }

  /// Notes it.
  bool out_of_time() {
    const auto& until = context_.simulation.simulate_until;
    out_of_time_ = out_of_time_ || (until && Clock::now() >= *until);
    return out_of_time_;
  }

  /// Whether a search's share of the time that is left is over: it, and so many after it that take long, share it.
  std::function<bool()> share_of_time(std::size_t searches) const {
    const auto& until = context_.simulation.simulate_until;
    if (!until) return {};
    const auto now = Clock::now();
    const auto share =
        std::max(Clock::duration::zero(), *until - now) / static_cast<std::int64_t>(std::max<std::size_t>(1, searches));
    return [end = now + share] { return Clock::now() >= end; };
  }

  core::Status look_up_wanted() {
    if (!query_.change || (query_.wanted_name.empty() && !query_.wanted)) return core::ok_status();
    belief::AchieveQuery asked;
    asked.outcome = query_.wanted_name;
    asked.wanted = query_.wanted;
    auto wanted = find_wanted(events_->known_scene(), asked, events_->left_out());
    if (!wanted) return wanted.status().at("wanted");
    wanted_ = *std::move(wanted);
    return core::ok_status();
  }

  /// Of the first explanation.
  void add_change(ExplainAnswer& answer) {
    const Explanation& first = answer.explanations.front();
    const bool can_be = first.kind == EventKind::kPushed || first.kind == EventKind::kBumped ||
                        first.kind == EventKind::kSlipped ||
                        (first.kind == EventKind::kNothing && !first.present_at_start);
    Judged* judged = first.kind == EventKind::kNothing ? &nothings_.front() : nullptr;
    for (Judged& one : judged_)
      if (one.hypothesis.kind == first.kind && events_->objects()[one.object].name == first.object) judged = &one;
    if (!can_be || judged == nullptr) {
      answer.remarks.push_back(std::string("No smallest change is worked out of '") + belief::name_of(first.kind) +
                               "': what somebody does with the object is not simulated.");
      return;
    }
    const auto events = changed_events(*events_, judged->hypothesis, wanted_, kChangeGoesOn);
    ChangeSearch search;
    search.events = events.get();
    search.wanted = wanted_ ? wanted_->name : "stays as it was";
    search.probability = query_.wanted_probability;
    search.confidence = query_.confidence;
    search.seed = query_.seed;
    search.stopped = [&] { return cancelled() || out_of_time(); };
    search.draws = [&](int number) {
      return number == 0 ? equal_draws(judged->posterior) : fresh_draws(*judged, number);
    };
    answer.change = smallest_change(search);
    answer.change->sentence = sentence_of(*answer.change);
    answer.text += " " + answer.change->sentence;
  }

  /// As many as there are points, each as probable.
  static std::vector<LatentPoint> equal_draws(const TemperedResult& posterior) {
    std::vector<LatentPoint> draws;
    const auto n = static_cast<double>(posterior.points.size());
    double reached = 0.0;
    for (const TemperedPoint& point : posterior.points) {
      reached += point.weight * n;
      while (draws.size() < posterior.points.size() && static_cast<double>(draws.size()) + 0.5 < reached)
        draws.push_back(point.z);
    }
    return draws;
  }

  /// Of runs that nothing was looked up in.
  std::vector<LatentPoint> fresh_draws(const Judged& judged, int number) {
    TemperedTarget target;
    events_->guess(judged.hypothesis, target);
    target.evaluate = [&](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
      evaluate(judged.hypothesis, points, log_likelihoods);
    };
    TemperedOptions options;
    options.runs = query_.runs;
    options.points = query_.points;
    options.first_run = kFreshRuns + number * query_.runs;
    return equal_draws(tempered_posterior(target, options, stream_of(judged), context_.simulation.cancellation));
  }

  core::RandomStream stream_of(const Judged& judged) const {
    return core::RandomStream(query_.seed + (judged.number + 1) * 0x9e3779b97f4a7c15ULL, core::Purpose::kParameters);
  }

  core::Status lost_for_good() const {
    return core::not_found("'" + query_.object +
                           "' is lost in the whole window: there is nothing to "
                           "explain; choose a window in which it is "
                           "tracked at the start or found later");
  }

  core::Result<std::optional<std::size_t>> asked_object() const {
    if (query_.object.empty()) return std::optional<std::size_t>();
    for (std::size_t i = 0; i < events_->objects().size(); ++i)
      if (events_->objects()[i].name == query_.object) return std::optional(i);
    std::vector<std::string> names;
    for (const belief::ObjectBelief& object : window_.start->objects) names.push_back(object.name);
    const std::string near = core::did_you_mean(query_.object, names);
    return core::not_found("there is no object '" + query_.object +
                           "': " + (near.empty() ? "the objects are " + core::comma_list(names) : near));
  }

  void evaluate(const Hypothesis& hypothesis, std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
    std::vector<ScenePath> paths(points.size());
    events_->simulate(hypothesis, points, paths);
    std::vector<double> ratios(points.size() * times_.size());
    likelihood_->evaluate(paths, ratios);
    for (std::size_t i = 0; i < points.size(); ++i) {
      log_likelihoods[i] = 0.0;
      for (std::size_t k = 0; k < times_.size(); ++k) log_likelihoods[i] += ratios[i * times_.size() + k];
    }
    evaluated_ += static_cast<int>(points.size());
  }

  double evidence_of_nothing(std::size_t object) const {
    for (const Judged& nothing : nothings_)
      if (nothing.object == object) return nothing.log_bayes;
    return 0.0;
  }

  /// No path of the object has a greater log likelihood.
  double most_likely(std::size_t object) const { return others_[object].most_likely + kLikelierThanSeen; }

  double log_posterior(const Judged& judged) const {
    return std::log(judged.hypothesis.prior) + judged.log_bayes + evidence_of_nothing(judged.object);
  }

  static int runs_of(const Judged& judged) { return static_cast<int>(judged.posterior.log_evidence.size()); }

  /// Against `nothing` about its object; of that itself, as it is.
  void note_evidence(Judged& judged, double log_evidence) {
    const bool is_reference = judged.hypothesis.kind == EventKind::kNothing && !judged.hypothesis.begins_otherwise;
    judged.log_bayes = log_evidence - (is_reference ? 0.0 : evidence_of_nothing(judged.object));
    judged.may_be_more.reset();
    if (judged.posterior.unfinished)
      judged.may_be_more = std::max(0.0, most_likely(judged.object) - log_evidence);
    else if (!judged.posterior.gave_up)
      best_ = std::max(best_, std::log(judged.hypothesis.prior) + log_evidence);
  }

  /// `runs` more searches of it; of `other`, which needs none, the evidence.
  void search(Judged& judged, int runs, const std::function<bool()>& out_of_time) {
    const Hypothesis& hypothesis = judged.hypothesis;
    if (hypothesis.kind == EventKind::kOther) {
      const OtherMotion& other = others_[judged.object];
      judged.error = other.error;
      judged.other_path = other.path;
      judged.frame_means = other.frames;
      note_evidence(judged, other.log_evidence);
      return;
    }
    TemperedTarget target;
    events_->guess(hypothesis, target);
    target.evaluate = [&](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
      evaluate(hypothesis, points, log_likelihoods);
    };
    TemperedOptions options;
    options.runs = runs;
    options.points = query_.points;
    options.first_run = runs_of(judged);
    options.out_of_time = out_of_time;
    if (options.first_run > 0) {
      propose_from(judged.posterior, target);
      options.first_points = kLaterFirstPoints;
    } else {
      propose_from_other_touch(hypothesis, target);
      if (hypothesis.kind != EventKind::kNothing || hypothesis.begins_otherwise) {
        options.most_likely = most_likely(judged.object);
        options.give_up_below = best_ - kHopeless - std::log(hypothesis.prior);
      }
    }
    TemperedResult found = tempered_posterior(target, options, stream_of(judged), context_.simulation.cancellation);
    if (options.first_run == 0) {
      judged.posterior = std::move(found);
    } else {
      if (found.unfinished) return;  // what was found before stands
      judged.posterior = merge(judged.posterior, found);
      judged.posterior.unfinished = false;
    }
    note_evidence(judged, judged.posterior.mean_log_evidence);
  }

  /// A blow touches about when and where a push does that explains the same frames, and the other way round.
  void propose_from_other_touch(const Hypothesis& hypothesis, TemperedTarget& target) const {
    if (hypothesis.kind != EventKind::kPushed && hypothesis.kind != EventKind::kBumped) return;
    const EventKind other = hypothesis.kind == EventKind::kPushed ? EventKind::kBumped : EventKind::kPushed;
    for (const Judged& judged : judged_)
      if (judged.hypothesis.kind == other && judged.object == hypothesis.object && !judged.posterior.gave_up)
        propose_from(judged.posterior, kTouchDimensions, target);
  }

  /// When an event is searched, after `nothing`. `other` first: it says how likely the frames can get at all. Then what
  /// takes no simulation: the better the best of these, the sooner searches of the others end.
  static constexpr int kRounds = 3;
  static int round_of(const Hypothesis& hypothesis) {
    const EventKind kind = hypothesis.kind;
    if (kind == EventKind::kNothing) return hypothesis.begins_otherwise ? 1 : -1;
    if (kind == EventKind::kOther) return 0;
    return kind == EventKind::kPushed || kind == EventKind::kBumped || kind == EventKind::kSlipped ? 2 : 1;
  }

  /// Each hypothesis once; those that can't compete end early, and those that there is no time for are left open.
  core::Status search_all(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses) {
    double prior_of_nothing = 0.0;
    std::size_t simulated = events_->is_still() ? 0 : candidates.size();
    for (const Hypothesis& h : hypotheses) {
      if (h.kind == EventKind::kNothing && !h.begins_otherwise) prior_of_nothing = h.prior;
      if (round_of(h) == kRounds - 1) ++simulated;
    }
    others_.resize(events_->objects().size());
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const std::size_t object = candidates[c];
      others_[object] = other_motion(*events_, *likelihood_, object, query_.priors);
      Judged& nothing = nothings_.emplace_back();
      nothing.hypothesis = {EventKind::kNothing, object, {}, prior_of_nothing};
      nothing.object = object;
      nothing.number = c * (hypotheses.size() + 1);
      if (cancelled()) return stopped();
      search(nothing, query_.runs, share_of_time(simulated));
      if (!events_->is_still()) --simulated;
    }
    for (int round = 0; round < kRounds; ++round)
      for (std::size_t c = 0; c < candidates.size(); ++c)
        for (std::size_t i = 0; i < hypotheses.size(); ++i) {
          if (hypotheses[i].object != candidates[c] || round_of(hypotheses[i]) != round) continue;
          if (cancelled()) return stopped();
          Judged& judged = judged_.emplace_back();
          judged.hypothesis = hypotheses[i];
          judged.object = candidates[c];
          judged.number = c * (hypotheses.size() + 1) + 1 + i;
          if (round > 0 && out_of_time()) {
            judged.posterior.unfinished = true;
            note_evidence(judged, best_ - kHopeless - std::log(hypotheses[i].prior));
          } else {
            search(judged, kFirstRuns, share_of_time(round + 1 == kRounds ? simulated-- : 1));
          }
        }
    return core::ok_status();
  }

  /// More runs of those that compete: one more of each in turn, as what one finds may show that another can't.
  core::Status search_rivals() {
    // That nothing explains what was seen may only mean that a search missed:
    // then none is taken for hopeless.
    const bool unexplained = std::any_of(judged_.begin(), judged_.end(), [&](const Judged& judged) {
      return judged.hypothesis.kind == EventKind::kOther && log_posterior(judged) >= best_ - 1e-9;
    });
    for (int runs = kFirstRuns; runs < query_.runs; ++runs)
      for (Judged& judged : judged_) {
        const bool hopeless =
            judged.posterior.gave_up || log_posterior(judged) + judged.may_be_more.value_or(0.0) <= best_ - kHopeless;
        if (judged.hypothesis.kind == EventKind::kOther || (hopeless && !unexplained)) continue;
        if (cancelled()) return stopped();
        if (out_of_time()) return core::ok_status();
        search(judged, 1, [this] { return out_of_time(); });
        if (unexplained) judged.posterior.gave_up = false;  // the run that did counts as one without evidence
      }
    return core::ok_status();
  }

  /// More runs of those whose intervals are wide, as long as there is time.
  core::Status narrow_intervals() {
    for (;;) {
      weigh_events(nothings_, judged_, query_.confidence, query_.seed);
      if (cancelled()) return stopped();
      // Whichever of the uncertain ones has the fewest runs.
      Judged* least = nullptr;
      for (Judged& judged : judged_) {
        const bool wide = judged.high - judged.low > 2.0 * query_.half_width;
        if (!wide || judged.hypothesis.kind == EventKind::kOther || judged.posterior.gave_up) continue;
        if (runs_of(judged) < kMostRounds * query_.runs && (least == nullptr || runs_of(judged) < runs_of(*least)))
          least = &judged;
      }
      if (least == nullptr || out_of_time()) return core::ok_status();
      search(*least, std::max(2, query_.runs / 2), [this] { return out_of_time(); });
    }
  }

  static core::Status stopped() { return core::cancelled("stopped on request before all events were weighed"); }

  void remark_what_was_cut_short() {
    if (out_of_time_)
      remarks_.emplace_back(
          "The time ran out before the intervals were as narrow as asked for: "
          "give more of it (max_seconds).");
    const auto note = [&](const Judged& judged) {
      if (judged.may_be_more && judged.high >= kMayMatter)
        remarks_.push_back(
            std::string("There was no time to search '") + belief::name_of(judged.hypothesis.kind) + "' of " +
            events_->objects()[judged.object].name +
            " to the end: it may be anything in its interval. Give more time (max_seconds), an object, or a "
            "shorter window.");
      if (judged.posterior.cut_short)
        remarks_.push_back(std::string("The search for '") + belief::name_of(judged.hypothesis.kind) + "' of " +
                           events_->objects()[judged.object].name +
                           " was cut short: its probability is less certain "
                           "than its interval says.");
    };
    for (const std::vector<Judged>* some : {&nothings_, &judged_})
      for (const Judged& judged : *some) note(judged);
  }

  const ExplainWindow& window_;
  const ExplainQuery& query_;
  const ExplainContext& context_;
  const filter::FilterTools& tools_;
  std::unique_ptr<EventPaths> events_;
  std::optional<WantedOutcome> wanted_;
  std::vector<std::size_t> chosen_;  // of the window's frames
  std::vector<WindowFrame> frames_;  // these
  std::unique_ptr<WindowLikelihood> likelihood_;
  std::vector<double> times_;
  std::vector<Judged> nothings_;     // by candidate
  std::vector<Judged> judged_;       // all others
  double best_ = -1e300;             // greatest log prior + log evidence until now
  std::vector<OtherMotion> others_;  // by object; of the candidates
  std::vector<std::string> remarks_;
  int evaluated_ = 0;
  bool out_of_time_ = false;
};

}  // namespace

core::Status validate(const ExplainQuery& query) {
  const auto check = [](const char* name, int value, int low, int high) {
    if (value >= low && value <= high) return core::ok_status();
    return core::invalid_input(std::string(name) + ": give " + std::to_string(low) + " to " + std::to_string(high) +
                               ", not " + std::to_string(value));
  };
  PRESCENE_RETURN_IF_ERROR(check("frames", query.frames, 2, 64));
  PRESCENE_RETURN_IF_ERROR(check("runs", query.runs, 2, 64));
  PRESCENE_RETURN_IF_ERROR(check("points", query.points, 8, 4096));
  if (!(query.confidence >= 0.5 && query.confidence <= 0.9999))
    return core::invalid_input("confidence: give 0.5 to 0.9999");
  if (!(query.half_width >= 0.001 && query.half_width <= 0.5))
    return core::invalid_input("half_width: give 0.001 to 0.5");
  if (!(query.wanted_probability >= 0.5 && query.wanted_probability <= 0.999))
    return core::invalid_input("wanted_probability: give 0.5 to 0.999");
  double sum = 0.0;
  for (const double weight : query.weights.weight) {
    if (!(weight >= 0.0 && weight <= 1e6)) return core::invalid_input("events: give weights between 0 and 1e6");
    sum += weight;
  }
  if (!(sum > 0.0)) return core::invalid_input("events: give at least one weight that is not 0");
  return core::ok_status();
}

core::Result<ExplainAnswer> explain(const ExplainWindow& window, const ExplainQuery& query,
                                    const ExplainContext& context) {
  PRESCENE_RETURN_IF_ERROR(validate(query));
  if (!window.start || !window.start->scene || window.start->step == 0)
    return core::invalid_input(
        "there is no belief at the window's start: "
        "begin it after the first frame");
  if (window.frames.empty())
    return core::invalid_input(
        "there is no frame in the window: give a longer "
        "one, or one within the recording");
  PRESCENE_CHECK(context.likelihood != nullptr && context.simulation.pool != nullptr &&
                 context.simulation.meshes != nullptr);
  if (!context.simulation.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  PRESCENE_TRY(const auto renderer, context.simulation.make_renderer());
  filter::PoseSearch search(*context.likelihood, *context.simulation.pool);
  const filter::FilterTools tools{&search, renderer.get(), context.simulation.meshes};
  return Explainer(window, query, context, tools).run();
}

}  // namespace prescene::queries
