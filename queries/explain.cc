// SPDX-License-Identifier: Apache-2.0
// Observation explanation: X*_t+1 ~ P(X_t+1 | U_t, X_t, Z_t+1, C_t+1), over events that nobody told of.
#include "prescene/queries/explain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "event_paths.h"
#include "explain_answer.h"
#include "other_motion.h"
#include "prescene/core/spelling.h"
#include "prescene/queries/tempered_smc.h"
#include "window_likelihood.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using belief::Pose;

constexpr std::size_t kMostCandidates = 4;
constexpr double kElsewhere = 0.01,
                 kTurned = 0.15;   // m and rad: tracked further from its start, an object is looked at
constexpr double kRefuted = -1.0;  // nats: what speaks so much against where it was is looked at
constexpr int kPosteriorDraws = 2000;

class Explainer {
 public:
  Explainer(const ExplainWindow& window, const ExplainQuery& query, const ExplainContext& context,
            const filter::FilterTools& tools)
      : window_(window), query_(query), context_(context), tools_(tools) {}

  core::Result<ExplainAnswer> run() {
    PRESCENE_TRY(events_, EventPaths::create(window_, context_, query_.priors, query_.seed));
    PRESCENE_TRY(const std::optional<std::size_t> asked, asked_object());
    for (const std::size_t i : telling_frames(window_.frames, query_.frames)) frames_.push_back(window_.frames[i]);
    likelihood_ = std::make_unique<WindowLikelihood>(*window_.start, events_->objects(), frames_, context_, tools_);
    PRESCENE_RETURN_IF_ERROR(likelihood_->prepare());
    for (std::size_t k = 0; k < likelihood_->frames(); ++k)
      times_.push_back(core::seconds_of(likelihood_->stamp(k) - window_.start->stamp_ns));
    events_->set_times(times_);
    likelihood_->set_base(events_->base());
    const std::vector<std::size_t> candidates = asked ? std::vector{*asked} : candidates_to_look_at();
    const std::vector<Hypothesis> hypotheses = make_hypotheses(candidates);
    std::uint64_t number = 0;
    for (const std::size_t object : candidates) {
      Judged nothing = judge({EventKind::kNothing, object, {}, 0.0}, number++);
      const double evidence = nothing.posterior.mean_log_evidence;
      nothings_.push_back(nothing);
      for (const Hypothesis& hypothesis : hypotheses) {
        if (hypothesis.object != object || hypothesis.kind == EventKind::kNothing) continue;
        if (cancelled()) return core::cancelled("stopped on request before all events were weighed");
        Judged judged = judge(hypothesis, number++);
        judged.log_bayes -= evidence;
        judged_.push_back(std::move(judged));
      }
    }
    if (cancelled()) return core::cancelled("stopped on request before all events were weighed");
    weigh(hypotheses);
    Telling telling{window_, *events_, *likelihood_, times_, nothings_, judged_};
    ExplainAnswer answer = tell(telling);
    answer.evaluated += evaluated_;
    answer.remarks.insert(answer.remarks.end(), remarks_.begin(), remarks_.end());
    return answer;
  }

 private:
  bool cancelled() const {
    return context_.simulation.cancellation != nullptr && context_.simulation.cancellation->requested();
  }

  core::Result<std::optional<std::size_t>> asked_object() const {
    if (query_.object.empty()) return std::optional<std::size_t>();
    for (std::size_t i = 0; i < events_->objects().size(); ++i)
      if (events_->objects()[i].name == query_.object) return std::optional(i);
    std::vector<std::string> names;
    for (const belief::ObjectBelief& object : window_.start->objects) names.push_back(object.name);
    if (std::find(names.begin(), names.end(), query_.object) != names.end())
      return core::not_found("'" + query_.object +
                             "' is lost in the whole window: there is nothing to explain; choose a window in which it "
                             "is tracked at the begin or found later");
    std::string known;
    for (const std::string& name : core::nearest_words(query_.object, names))
      known += (known.empty() ? "" : " or ") + ("'" + name + "'");
    if (!known.empty()) known = "did you mean " + known + "?";
    for (std::size_t i = 0; known.empty() && i < names.size(); ++i) known += (i == 0 ? "there are " : "") + names[i];
    return core::not_found("there is no object '" + query_.object + "': " + known);
  }

  /// Objects that the frames show to be elsewhere, those that moved furthest first; the least certain one if none did.
  std::vector<std::size_t> candidates_to_look_at() {
    std::vector<std::pair<double, std::size_t>> order;
    double least = 1e300;
    std::size_t doubtful = 0;
    for (std::size_t i = 0; i < events_->objects().size(); ++i) {
      if (!events_->is_present(i)) {
        order.emplace_back(-1.0, i);
        continue;
      }
      double moved = 0.0;
      bool elsewhere = false;
      const SeenTrack& track = events_->track(i);
      for (std::size_t j = 0; j < track.times.size(); ++j) {
        const Pose base = base_at(i, track.times[j]);
        const double distance = (track.estimates[j].mean.translation - base.translation).norm();
        const double angle = geometry::symmetric_angle(track.estimates[j].mean, base, events_->model(i).symmetry);
        elsewhere = elsewhere || distance > kElsewhere || angle > kTurned;
        moved = std::max(moved, distance + 0.05 * angle);
      }
      double worst = 1e300;
      for (std::size_t k = 0; k < times_.size(); ++k) {
        if (!likelihood_->base()[i][k]) continue;
        double ratio = 0.0;
        likelihood_->evaluate(k, i, std::span(&*likelihood_->base()[i][k], 1), std::span(&ratio, 1));
        double absent = 0.0;
        ScenePath gone{{i}, {ObjectPath(times_.size())}, false};
        std::vector<double> ratios(times_.size());
        likelihood_->evaluate(std::span(&gone, 1), ratios);
        absent = ratios[k];
        worst = std::min(worst, ratio - absent);
      }
      if (worst < least) least = worst, doubtful = i;
      if (elsewhere || worst < kRefuted) order.emplace_back(-moved, i);
    }
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> candidates;
    for (const auto& [key, i] : order)
      if (candidates.size() < kMostCandidates) candidates.push_back(i);
    if (order.size() > candidates.size())
      remarks_.push_back(std::to_string(order.size()) + " objects are elsewhere; only the " +
                         std::to_string(kMostCandidates) + " that moved furthest were looked at.");
    if (candidates.empty()) candidates.push_back(doubtful);
    return candidates;
  }

  Pose base_at(std::size_t object, double time) const {
    std::size_t k = 0;
    while (k + 1 < times_.size() && times_[k] < time - 1e-6) ++k;
    return likelihood_->base()[object][k].value_or(Pose{});
  }

  /// Of the candidates; priors are shared by all objects that a kind may happen to.
  std::vector<Hypothesis> make_hypotheses(const std::vector<std::size_t>& candidates) const {
    std::vector<Hypothesis> all;
    const std::size_t n = events_->objects().size();
    const auto looked_at = [&](std::size_t i) {
      return std::find(candidates.begin(), candidates.end(), i) != candidates.end();
    };
    const auto add = [&](EventKind kind, const auto& may) {
      std::vector<Hypothesis> of_kind;
      for (std::size_t i = 0; i < n; ++i)
        if (may(i)) of_kind.push_back({kind, i, {}, 0.0});
      for (Hypothesis& h : of_kind) {
        h.prior = query_.weights.of(kind) / static_cast<double>(of_kind.size());
        all.push_back(h);
      }
    };
    const auto free = [&](std::size_t i) { return events_->is_present(i) && !events_->is_held(i); };
    const auto held = [&](std::size_t i) { return events_->is_held(i); };
    const auto absent = [&](std::size_t i) { return !events_->is_present(i); };
    all.push_back({EventKind::kNothing, candidates.front(), {}, query_.weights.of(EventKind::kNothing)});
    for (const EventKind kind : {EventKind::kPushed, EventKind::kBumped, EventKind::kMoved, EventKind::kTakenAway})
      add(kind, free);
    add(EventKind::kSlipped, held);
    add(EventKind::kPutIn, absent);
    add(EventKind::kOther, [](std::size_t) { return true; });
    std::vector<Hypothesis> pairs;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n; ++j) {
        if (!free(i) || !free(j)) continue;
        const belief::ObjectModel &a = events_->model(i), &b = events_->model(j);
        const bool same =
            a.name == b.name || tools_.meshes->get(a.visual, a.collision, filter::MeshDetail::kLikelihood) ==
                                    tools_.meshes->get(b.visual, b.collision, filter::MeshDetail::kLikelihood);
        if (!same) continue;
        const std::size_t first = looked_at(i) ? i : j;
        pairs.push_back({EventKind::kExchanged, first, first == i ? j : i, 0.0});
      }
    for (Hypothesis& h : pairs) {
      h.prior = query_.weights.of(EventKind::kExchanged) / static_cast<double>(pairs.size());
      all.push_back(h);
    }
    double sum = 0.0;
    for (const Hypothesis& h : all) sum += h.prior;
    for (Hypothesis& h : all) h.prior /= sum > 0.0 ? sum : 1.0;
    std::erase_if(all, [&](const Hypothesis& h) { return h.prior <= 0.0 || !looked_at(h.object); });
    return all;
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

  Judged judge(const Hypothesis& hypothesis, std::uint64_t number) {
    Judged judged;
    judged.hypothesis = hypothesis;
    judged.object = hypothesis.object;
    const core::RandomStream stream(query_.seed + (number + 1) * 0x9e3779b97f4a7c15ULL, core::Purpose::kParameters);
    if (hypothesis.kind == EventKind::kOther) {
      const OtherMotion other = other_motion(*events_, *likelihood_, hypothesis.object, times_, query_.priors, stream);
      judged.log_bayes = other.log_evidence;
      judged.error = other.error;
      judged.other_path = other.path;
      judged.frame_means = other.frames;
      evaluated_ += other.evaluations;
      return judged;
    }
    TemperedTarget target;
    events_->guess(hypothesis, target);
    target.evaluate = [&](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
      evaluate(hypothesis, points, log_likelihoods);
    };
    TemperedOptions options;
    options.runs = query_.runs;
    options.points = query_.points;
    judged.posterior = tempered_posterior(target, options, stream, context_.simulation.cancellation);
    judged.log_bayes = judged.posterior.mean_log_evidence;
    judged.error = judged.posterior.error;
    if (judged.posterior.cut_short)
      remarks_.push_back(std::string("The search for '") + belief::name_of(hypothesis.kind) + "' of " +
                         events_->objects()[hypothesis.object].name +
                         " was cut short: its probability is less certain than its interval says.");
    return judged;
  }

  /// Probabilities with intervals.
  void weigh(const std::vector<Hypothesis>& hypotheses) {
    const std::size_t n = judged_.size();
    std::vector<double> prior(n);
    for (std::size_t i = 0; i < n; ++i) prior[i] = std::log(judged_[i].hypothesis.prior);
    double log_nothing = -1e300;
    for (const Hypothesis& h : hypotheses)
      if (h.kind == EventKind::kNothing && h.prior > 0.0) log_nothing = std::log(h.prior);
    const auto shares = [&](const std::vector<double>& log_bayes) {
      double top = log_nothing;
      for (std::size_t i = 0; i < n; ++i) top = std::max(top, prior[i] + log_bayes[i]);
      std::vector<double> result(n + 1);
      double sum = result[n] = std::exp(log_nothing - top);
      for (std::size_t i = 0; i < n; ++i) sum += result[i] = std::exp(prior[i] + log_bayes[i] - top);
      for (double& share : result) share /= sum;
      return result;
    };
    std::vector<double> log_bayes(n);
    for (std::size_t i = 0; i < n; ++i) log_bayes[i] = judged_[i].log_bayes;
    const std::vector<double> best = shares(log_bayes);
    std::vector<std::vector<double>> drawn(n + 1);
    const core::RandomStream stream(query_.seed, core::Purpose::kResample);
    for (int d = 0; d < kPosteriorDraws; ++d) {
      core::RandomStream draws = stream.at(static_cast<std::uint64_t>(d));
      // Student's t with runs - 1 degrees of freedom.
      const auto student = [&](double error) {
        const int freedom = std::max(1, query_.runs - 1);
        double squares = 0.0;
        for (int k = 0; k < freedom; ++k) {
          const double x = draws.normal();
          squares += x * x;
        }
        return error * draws.normal() / std::sqrt(squares / freedom);
      };
      std::vector<double> of_nothing;
      for (const Judged& nothing : nothings_) of_nothing.push_back(student(nothing.error));
      std::vector<double> varied = log_bayes;
      for (std::size_t i = 0; i < n; ++i) {
        varied[i] += student(judged_[i].error);
        for (std::size_t o = 0; o < nothings_.size(); ++o)
          if (nothings_[o].object == judged_[i].object) varied[i] -= of_nothing[o];
      }
      const std::vector<double> sample = shares(varied);
      for (std::size_t i = 0; i <= n; ++i) drawn[i].push_back(sample[i]);
    }
    const auto put = [&](std::size_t i, Judged& judged) {
      std::sort(drawn[i].begin(), drawn[i].end());
      const double tail = 0.5 * (1.0 - query_.confidence);
      const auto at = [&](double share) {
        return drawn[i][static_cast<std::size_t>(std::lround(share * (kPosteriorDraws - 1)))];
      };
      judged.probability = best[i];
      judged.low = std::min(best[i], at(tail));
      judged.high = std::max(best[i], at(1.0 - tail));
    };
    for (std::size_t i = 0; i < n; ++i) put(i, judged_[i]);
    put(n, nothings_.front());
  }

  const ExplainWindow& window_;
  const ExplainQuery& query_;
  const ExplainContext& context_;
  const filter::FilterTools& tools_;
  std::unique_ptr<EventPaths> events_;
  std::vector<WindowFrame> frames_;
  std::unique_ptr<WindowLikelihood> likelihood_;
  std::vector<double> times_;
  std::vector<Judged> nothings_;  // by candidate
  std::vector<Judged> judged_;    // all others
  std::vector<std::string> remarks_;
  int evaluated_ = 0;
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
    return core::invalid_input("there is no belief at the window's begin: begin it after the first frame");
  if (window.frames.empty())
    return core::invalid_input("there is no frame in the window: give a longer one, or one within the recording");
  PRESCENE_CHECK(context.likelihood != nullptr && context.simulation.pool != nullptr &&
                 context.simulation.meshes != nullptr);
  if (!context.simulation.make_renderer) return core::unavailable("no renderer: this service was set up without one");
  PRESCENE_TRY(const auto renderer, context.simulation.make_renderer());
  filter::PoseSearch search(*context.likelihood, *context.simulation.pool);
  const filter::FilterTools tools{&search, renderer.get(), context.simulation.meshes};
  return Explainer(window, query, context, tools).run();
}

}  // namespace prescene::queries
