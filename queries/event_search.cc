// SPDX-License-Identifier: Apache-2.0
#include "event_search.h"

#include <algorithm>
#include <cmath>

#include "weigh_events.h"

namespace prescene::queries {
namespace {

using belief::EventKind;
using Clock = core::Cancellation::Clock;

constexpr int kFirstRuns = 1;
constexpr int kLaterFirstPoints = 2;    // times the points of a run, that are drawn where the runs before found it
constexpr int kMostRounds = 2;          // times the query's runs: of what stays uncertain
constexpr double kHopeless = 25.0;      // nats: what is so far behind the best is not searched further
constexpr double kMayMatter = 0.01;     // probability from which on an event that was not searched is named
constexpr double kMoreToTell = 1.5;     // times the instances: a look draws from all evidences, which takes its time
constexpr double kLeastPrior = 1e-300;  // of what can't be, whose evidence does not matter
constexpr int kFreshRuns = 1000;        // numbers of runs from here on are for what must not have been seen
constexpr double kLikelierThanSeen =
    3.0;  // nats: by which frames may be likelier than the best of some dozens of poses

/// When an event is searched, after `nothing`. `other` first: it says how likely the frames can get at all. Then what
/// takes no simulation: the better the best of these, the sooner searches of the others end.
constexpr int kRounds = 3;
int round_of(const Hypothesis& hypothesis) {
  const EventKind kind = hypothesis.kind;
  if (kind == EventKind::kNothing) return hypothesis.begins_otherwise ? 1 : -1;
  if (kind == EventKind::kOther) return 0;
  return kind == EventKind::kPushed || kind == EventKind::kBumped || kind == EventKind::kSlipped ? 2 : 1;
}

/// Nothing, from where the belief begins: what others are compared with.
bool others_refer_to(const Judged& judged) {
  return judged.hypothesis.kind == EventKind::kNothing && !judged.hypothesis.begins_otherwise;
}

int runs_of(const Judged& judged) { return static_cast<int>(judged.posterior.log_evidence.size()); }

/// Of the `hypothesis`-th of `hypotheses`, about the `candidate`-th object; nothing was found of it yet.
Judged judged_of(const Hypothesis& what, std::size_t candidate, std::size_t hypothesis, std::size_t hypotheses) {
  Judged judged;
  judged.hypothesis = what;
  judged.object = what.object;
  judged.number = candidate * (hypotheses + 1) + 1 + hypothesis;
  return judged;
}

core::Status stopped_searching() { return core::cancelled("stopped on request before all events were weighed"); }

}  // namespace

std::vector<LatentPoint> equal_draws(const TemperedResult& posterior) {
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

core::Status EventSearch::run(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses,
                              const Look& look) {
  PRESCENE_RETURN_IF_ERROR(search_all(candidates, hypotheses, look));
  PRESCENE_RETURN_IF_ERROR(search_rivals());
  return narrow_intervals(look);
}

std::vector<LatentPoint> EventSearch::fresh_draws(const Judged& judged, int number) {
  TemperedOptions options;
  options.runs = query_.runs;
  options.points = query_.points;
  options.first_run = kFreshRuns + number * query_.runs;
  return equal_draws(
      tempered_posterior(target_of(judged.hypothesis), options, stream_of(judged), context_.cancellation));
}

bool EventSearch::cancelled() const { return context_.cancellation != nullptr && context_.cancellation->requested(); }

bool EventSearch::out_of_time() {
  const auto& until = context_.simulate_until;
  out_of_time_ = out_of_time_ || (until && Clock::now() >= *until);
  return out_of_time_;
}

std::vector<std::string> EventSearch::remarks() const {
  std::vector<std::string> remarks;
  if (out_of_time_)
    remarks.emplace_back(
        "The time ran out before the intervals were as narrow as asked for: give more of it (max_seconds).");
  for (const std::vector<Judged>* some : {&nothings_, &judged_})
    for (const Judged& judged : *some) {
      const std::string event =
          std::string("'") + belief::name_of(judged.hypothesis.kind) + "' of " + events_.objects()[judged.object].name;
      if (judged.may_be_more && judged.high >= kMayMatter)
        remarks.push_back("There was no time to search " + event +
                          " to the end: it may be anything in its interval. Give more time (max_seconds), an object, "
                          "or a shorter window.");
      if (judged.posterior.cut_short)
        remarks.push_back("The search for " + event +
                          " was cut short: its probability is less certain than its interval says.");
    }
  return remarks;
}

/// Tells what is known before all hypotheses were searched once, if that is much more than when it was told last.
void EventSearch::tell(const std::vector<std::size_t>& candidates, const std::vector<Hypothesis>& hypotheses,
                       const Look& look) {
  if (!look || out_of_time_ || best_ == kNoneYet || evaluated_ < kMoreToTell * told_at_) return;
  std::vector<Judged> nothings = nothings_, judged = judged_;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    // What others are compared with, or 0 where its evidence is known and counted already.
    double open_reference = 0.0;
    if (c >= nothings_.size()) {
      leave_open(nothings.emplace_back(nothing_about(candidates, c, hypotheses)));
      open_reference = nothings.back().log_bayes;
    }
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      if (hypotheses[i].object != candidates[c] || round_of(hypotheses[i]) < 0) continue;
      const Judged open = judged_of(hypotheses[i], c, i, hypotheses.size());
      if (std::any_of(judged_.begin(), judged_.end(), [&](const Judged& known) { return known.number == open.number; }))
        continue;
      Judged& added = judged.emplace_back(open);
      if (added.hypothesis.kind == EventKind::kOther)
        search(added, kFirstRuns, {});
      else
        leave_open(added);
      added.log_bayes -= open_reference;
    }
  }
  if (judged.empty()) return;
  told_at_ = evaluated_;
  weigh_events(nothings, judged, query_.confidence, query_.seed);
  look(std::move(nothings), std::move(judged));
}

/// That nothing happened to a candidate, of which nothing was found yet.
Judged EventSearch::nothing_about(const std::vector<std::size_t>& candidates, std::size_t candidate,
                                  const std::vector<Hypothesis>& hypotheses) {
  Judged nothing;
  nothing.hypothesis = {EventKind::kNothing, candidates[candidate], {}, 0.0};
  for (const Hypothesis& h : hypotheses)
    if (h.kind == EventKind::kNothing && !h.begins_otherwise) nothing.hypothesis.prior = h.prior;
  nothing.object = candidates[candidate];
  nothing.number = candidate * (hypotheses.size() + 1);
  return nothing;
}

/// Each hypothesis once; those that can't compete end early, and those that there is no time for are left open.
core::Status EventSearch::search_all(const std::vector<std::size_t>& candidates,
                                     const std::vector<Hypothesis>& hypotheses, const Look& look) {
  std::size_t simulated = events_.is_still() ? 0 : candidates.size();
  for (const Hypothesis& h : hypotheses)
    if (round_of(h) == kRounds - 1) ++simulated;
  others_.resize(events_.objects().size());
  for (const std::size_t object : candidates)
    others_[object] = other_motion(events_, likelihood_, object, query_.priors);
  // How likely the frames can get is known before anything is simulated.
  for (const Hypothesis& h : hypotheses)
    if (h.kind == EventKind::kOther) best_ = std::max(best_, std::log(h.prior) + others_[h.object].log_evidence);
  tell(candidates, hypotheses, look);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if (cancelled()) return stopped_searching();
    Judged& nothing = nothings_.emplace_back(nothing_about(candidates, c, hypotheses));
    search(nothing, kFirstRuns, share_of_time(simulated));
    if (!events_.is_still()) --simulated;
    tell(candidates, hypotheses, look);
  }
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t c = 0; c < candidates.size(); ++c)
      for (std::size_t i = 0; i < hypotheses.size(); ++i) {
        if (hypotheses[i].object != candidates[c] || round_of(hypotheses[i]) != round) continue;
        if (cancelled()) return stopped_searching();
        Judged& judged = judged_.emplace_back(judged_of(hypotheses[i], c, i, hypotheses.size()));
        if (round > 0 && out_of_time())
          leave_open(judged);
        else
          search(judged, kFirstRuns, share_of_time(round + 1 == kRounds ? simulated-- : 1));
        if (round > 0) tell(candidates, hypotheses, look);
      }
  return core::ok_status();
}

/// More runs of those that compete: one more of each in turn, as what one finds may show that another can't.
core::Status EventSearch::search_rivals() {
  // That nothing explains what was seen may only mean that a search missed: then none is taken for hopeless.
  const bool unexplained = std::any_of(judged_.begin(), judged_.end(), [&](const Judged& judged) {
    return judged.hypothesis.kind == EventKind::kOther && log_posterior(judged) >= best_ - 1e-9;
  });
  for (int runs = kFirstRuns; runs < query_.runs; ++runs) {
    for (std::vector<Judged>* some : {&nothings_, &judged_})
      for (Judged& judged : *some) {
        if (judged.hypothesis.kind == EventKind::kOther || runs_of(judged) > runs) continue;
        const bool hopeless =
            judged.posterior.gave_up || log_posterior(judged) + judged.may_be_more.value_or(0.0) <= best_ - kHopeless;
        if (hopeless && !unexplained) continue;
        if (cancelled()) return stopped_searching();
        if (out_of_time()) return core::ok_status();
        search(judged, 1, [this] { return out_of_time(); });
        if (unexplained) judged.posterior.gave_up = false;  // the run that did counts as one without evidence
      }
  }
  return core::ok_status();
}

/// More runs of those whose intervals are wide, as long as there is time.
core::Status EventSearch::narrow_intervals(const Look& look) {
  for (;;) {
    weigh_events(nothings_, judged_, query_.confidence, query_.seed);
    if (look) look(nothings_, judged_);
    if (cancelled()) return stopped_searching();
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

/// `runs` more searches of it; of `other`, which needs none, the evidence.
void EventSearch::search(Judged& judged, int runs, const std::function<bool()>& out_of_time) {
  const Hypothesis& hypothesis = judged.hypothesis;
  if (hypothesis.kind == EventKind::kOther) {
    const OtherMotion& other = others_[judged.object];
    judged.error = other.error;
    judged.other_path = other.path;
    judged.frame_means = other.frames;
    note_evidence(judged, other.log_evidence);
    return;
  }
  TemperedTarget target = target_of(hypothesis);
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
    options.most_likely = most_likely(judged.object);
    if (hypothesis.kind != EventKind::kNothing || hypothesis.begins_otherwise)
      options.give_up_below = best_ - kHopeless - std::log(hypothesis.prior);
  }
  TemperedResult found = tempered_posterior(target, options, stream_of(judged), context_.cancellation);
  if (options.first_run == 0) {
    judged.posterior = std::move(found);
  } else {
    if (found.unfinished) return;  // what was found before stands
    judged.posterior = merge(judged.posterior, found);
    judged.posterior.unfinished = false;
  }
  note_evidence(judged, judged.posterior.mean_log_evidence);
}

void EventSearch::evaluate(const Hypothesis& hypothesis, std::span<const LatentPoint> points,
                           std::span<double> log_likelihoods) {
  std::vector<ScenePath> paths(points.size());
  events_.simulate(hypothesis, points, paths);
  std::vector<double> ratios(points.size() * times_.size());
  likelihood_.evaluate(paths, ratios);
  for (std::size_t i = 0; i < points.size(); ++i) {
    log_likelihoods[i] = 0.0;
    for (std::size_t k = 0; k < times_.size(); ++k) log_likelihoods[i] += ratios[i * times_.size() + k];
  }
  evaluated_ += static_cast<int>(points.size());
}

/// A blow touches about when and where a push does that explains the same frames, and the other way round.
void EventSearch::propose_from_other_touch(const Hypothesis& hypothesis, TemperedTarget& target) const {
  if (hypothesis.kind != EventKind::kPushed && hypothesis.kind != EventKind::kBumped) return;
  const EventKind other = hypothesis.kind == EventKind::kPushed ? EventKind::kBumped : EventKind::kPushed;
  for (const Judged& judged : judged_)
    if (judged.hypothesis.kind == other && judged.object == hypothesis.object && !judged.posterior.gave_up)
      propose_from(judged.posterior, kTouchDimensions, target);
}

/// Against `nothing` about its object; of that itself, as it is.
void EventSearch::note_evidence(Judged& judged, double log_evidence) {
  if (others_refer_to(judged)) {
    for (Judged& other : judged_)
      if (other.object == judged.object) other.log_bayes += judged.log_bayes - log_evidence;
    judged.log_bayes = log_evidence;
  } else {
    judged.log_bayes = log_evidence - evidence_of_nothing(judged.object);
  }
  judged.may_be_more.reset();
  if (judged.posterior.unfinished)
    judged.may_be_more = std::max(0.0, std::min(judged.posterior.at_most, most_likely(judged.object)) - log_evidence);
  else if (!judged.posterior.gave_up)
    best_ = std::max(best_, std::log(judged.hypothesis.prior) + log_evidence);
}

/// Of what was not searched.
void EventSearch::leave_open(Judged& judged) {
  judged.posterior.unfinished = true;
  note_evidence(judged, best_ - kHopeless - std::log(std::max(kLeastPrior, judged.hypothesis.prior)));
}

TemperedTarget EventSearch::target_of(const Hypothesis& hypothesis) {
  TemperedTarget target;
  events_.guess(hypothesis, target);
  target.evaluate = [this, &hypothesis](std::span<const LatentPoint> points, std::span<double> log_likelihoods) {
    evaluate(hypothesis, points, log_likelihoods);
  };
  return target;
}

/// Whether a search's share of the time that is left is over: it, and so many after it that take long, share it.
std::function<bool()> EventSearch::share_of_time(std::size_t searches) const {
  const auto& until = context_.simulate_until;
  if (!until) return {};
  const auto now = Clock::now();
  const auto share =
      std::max(Clock::duration::zero(), *until - now) / static_cast<std::int64_t>(std::max<std::size_t>(1, searches));
  return [end = now + share] { return Clock::now() >= end; };
}

double EventSearch::evidence_of_nothing(std::size_t object) const {
  for (const Judged& nothing : nothings_)
    if (nothing.object == object) return nothing.log_bayes;
  return 0.0;
}

/// No path of the object has a greater log likelihood.
double EventSearch::most_likely(std::size_t object) const { return others_[object].most_likely + kLikelierThanSeen; }

double EventSearch::log_posterior(const Judged& judged) const {
  const double of_reference = others_refer_to(judged) ? 0.0 : evidence_of_nothing(judged.object);
  return std::log(judged.hypothesis.prior) + judged.log_bayes + of_reference;
}

core::RandomStream EventSearch::stream_of(const Judged& judged) const {
  return core::RandomStream(query_.seed + (judged.number + 1) * 0x9e3779b97f4a7c15ULL, core::Purpose::kParameters);
}

}  // namespace prescene::queries
