// SPDX-License-Identifier: Apache-2.0
// Observation explanation: X*_t+1 ~ P(X_t+1 | U_t, X_t, Z_t+1, C_t+1), over events that nobody reported.
#include "prescene/queries/explain.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "candidate_objects.h"
#include "event_hypotheses.h"
#include "event_paths.h"
#include "event_search.h"
#include "explain_answer.h"
#include "explain_text.h"
#include "prescene/core/spelling.h"
#include "prescene/queries/smallest_change.h"
#include "prescene/queries/tempered_smc.h"
#include "simulated_changes.h"
#include "window_likelihood.h"

namespace prescene::queries {
namespace {

using belief::EventKind;

constexpr double kSearchShare = 0.85;       // of the time, if it is limited
constexpr std::size_t kPointsInHaste = 24;  // of a posterior, that are worked out when the time is out

/// Such a frame tells of the camera, and its likelihood speaks against what should have been seen.
void remark_on_blind_frames(const std::vector<WindowFrame>& frames, std::vector<std::string>& remarks) {
  const auto is_blind = [](const WindowFrame& frame) {
    const auto& depth = frame.observation.frame.depth;
    return !depth || std::none_of(depth->data(), depth->data() + depth->size(), [](float z) { return z > 0.0F; });
  };
  const auto blind = std::count_if(frames.begin(), frames.end(), is_blind);
  if (blind == 0) return;
  remarks.push_back("In " + std::to_string(blind) + " of " + std::to_string(frames.size()) +
                    " frames that were weighed, no pixel is measured: look whether the camera was covered, dazzled or "
                    "too near. That a thing is not seen there is no sign that it was gone, whatever is said here.");
}

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
    const std::vector<Hypothesis> hypotheses = hypotheses_about(candidates, *events_, query_.weights, *tools_.meshes);
    const QueryContext searching = context_of_search();
    EventSearch search(*events_, *likelihood_, times_, query_, searching);
    const auto tell = [&](std::vector<Judged> nothings, std::vector<Judged> judged_so_far) {
      JudgedEvents known{window_, *events_, *likelihood_, times_, nothings, judged_so_far, chosen_};
      ExplainAnswer so_far = explained_so_far(known);
      so_far.evaluated = looked.evaluated() + search.evaluated();
      context_.so_far(so_far);
    };
    PRESCENE_RETURN_IF_ERROR(
        search.run(candidates, hypotheses, context_.so_far ? EventSearch::Look(tell) : EventSearch::Look()));
    PRESCENE_RETURN_IF_ERROR(events_->failure());
    JudgedEvents judged{window_, *events_, *likelihood_, times_, search.nothings(), search.judged(), chosen_};
    if (search.was_out_of_time()) judged.points = kPointsInHaste;
    ExplainAnswer answer = explain_answer(judged);
    // Before the change is looked for, which may run out of time, too.
    const std::vector<std::string> remarks = search.remarks();
    if (query_.change) {
      add_change(search, answer);
      PRESCENE_RETURN_IF_ERROR(events_->failure());
    }
    if (search.cancelled()) return core::cancelled("stopped on request before all was worked out");
    answer.evaluated += looked.evaluated() + search.evaluated();
    answer.cut_short = search.was_out_of_time();
    for (const auto* some : {&looked.remarks(), &remarks})
      answer.remarks.insert(answer.remarks.end(), some->begin(), some->end());
    remark_on_blind_frames(frames_, answer.remarks);
    answer.remarks.emplace_back(
        "Intervals say how precisely the evidence was computed, not how well events are modelled.");
    return answer;
  }

 private:
  /// What is found has to be simulated once more for the answer, in the same time.
  QueryContext context_of_search() const {
    QueryContext context = context_.simulation;
    const auto now = core::Cancellation::Clock::now();
    if (auto& until = context.simulate_until; until && *until > now)
      until = now + std::chrono::duration_cast<core::Cancellation::Clock::duration>(kSearchShare * (*until - now));
    return context;
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
  void add_change(EventSearch& searched, ExplainAnswer& answer) {
    const Explanation& first = answer.explanations.front();
    const bool can_be = first.kind == EventKind::kPushed || first.kind == EventKind::kBumped ||
                        first.kind == EventKind::kSlipped ||
                        (first.kind == EventKind::kNothing && !first.present_at_start);
    Judged* judged = first.kind == EventKind::kNothing ? &searched.nothings().front() : nullptr;
    for (Judged& one : searched.judged())
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
    search.stopped = [&] { return searched.cancelled() || searched.out_of_time(); };
    search.draws = [&](int number) {
      return number == 0 ? equal_draws(judged->posterior) : searched.fresh_draws(*judged, number);
    };
    answer.change = smallest_change(search);
    answer.change->sentence = sentence_of(*answer.change);
    answer.text += " " + answer.change->sentence;
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
