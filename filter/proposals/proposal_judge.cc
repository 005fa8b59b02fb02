// SPDX-License-Identifier: Apache-2.0
#include "proposal_judge.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace prescene::filter {
namespace {

constexpr double kMinEvidence = 4.0;    // nats per visible pixel
constexpr double kMinVisible = 0.35;    // of the pixels that a pose shows, known things in front or not
constexpr double kFloatingCost = 60.0;  // nats that a pose costs which stands on nothing known, ...
constexpr double kFloatingShare = 0.7;  // ... and a share of its log ratio
constexpr double kHitPower = 8.0;       // how much a pose's score suffers from pixels that do not match
constexpr double kMostLogOdds = 8.0;    // of a find that the judge is sure of

}  // namespace

double Proposal::score() const {
  return candidate.evidence.log_ratio * std::pow(candidate.evidence.hit_share(), kHitPower) - cost;
}

void Proposal::weigh(bool on_something) {
  stands = on_something;
  cost = stands ? 0.0 : kFloatingCost + kFloatingShare * std::max(0.0, candidate.evidence.log_ratio);
}

bool acceptable(const rendering::PoseEvidence& evidence, double cost, const DetectionOptions& options) {
  return evidence.log_ratio - cost > options.min_log_ratio && evidence.hit_share() >= options.min_hit_share &&
         evidence.log_ratio_per_visible_pixel() >= kMinEvidence && evidence.visible >= kMinVisible * evidence.in_view;
}

ProposalJudge::ProposalJudge(std::span<const WantedModel> wanted, const Vector3d& up_C, const DetectionOptions& options,
                             const FilterTools& tools, DetectionTrace* trace)
    : wanted_(wanted), up_C_(up_C), options_(options), tools_(tools), trace_(trace) {
  all_learned_ = tools.learned != nullptr && !wanted.empty() &&
                 std::all_of(wanted.begin(), wanted.end(), [](const auto& w) { return w.target.learned != nullptr; });
}

double ProposalJudge::log_odds(const Proposal& p) const {
  if (!tools_.learned->fit.empty()) return tools_.learned->fit.log_odds(p.numbers);
  const bool good = acceptable(p.candidate.evidence, p.cost, options_) &&
                    static_cast<double>(p.numbers[kFitOutline]) >= kLeastOutline && p.score() > 1.0;
  return good ? std::log(p.score()) : -kMostLogOdds;
}

double ProposalJudge::probability(double accepted, double at_end) const {
  const auto& c = tools_.learned->confidence;
  const double odds = std::clamp(c[0] + c[1] * at_end + c[2] * accepted, -kMostLogOdds, kMostLogOdds);
  return 1.0 / (1.0 + std::exp(-odds));
}

void ProposalJudge::judge(const rendering::FrameTerms& terms, const std::vector<Cluster>& clusters,
                          std::vector<Proposal>& proposals) const {
  std::vector<std::uint8_t> fresh(proposals.size(), 0);
  tools_.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
    Proposal& p = proposals[i];
    const rendering::PoseEvidence& e = p.candidate.evidence;
    const bool same = p.is_judged && p.judged_standing == p.stands && p.judged.log_ratio == e.log_ratio &&
                      p.judged.covered == e.covered && p.judged.visible == e.visible && p.judged.hits == e.hits;
    Fit fit = fit_of(p.model, p.candidate.X_CO, e, clusters[static_cast<std::size_t>(p.cluster)], p.stands);
    set_rivals_among(std::span<const Proposal>(proposals), p.model, p.cluster, fit);
    const FitNumbers before = p.numbers;
    if (same)
      set_rivals(fit, p.numbers);
    else
      p.numbers = fit_numbers(fit, terms, *tools_.renderer);
    if (same && p.numbers == before) return;
    fresh[i] = 1;
    p.is_judged = true;
    p.judged = e;
    p.judged_standing = p.stands;
    p.log_odds = log_odds(p);
  });
  if (trace_ == nullptr) return;
  for (std::size_t i = 0; i < proposals.size(); ++i)
    if (fresh[i] != 0)
      trace_->candidates.push_back({proposals[i].model, proposals[i].candidate.X_CO, proposals[i].numbers});
}

FitNumbers ProposalJudge::numbers_of(const rendering::FrameTerms& terms, const Cluster& cluster,
                                     const Detection& found) const {
  Fit fit = fit_of(found.model, found.X_CO, found.evidence, cluster, found.stands);
  FitNumbers numbers = fit_numbers(fit, terms, *tools_.renderer);
  // Who its rivals were is known from when it was accepted.
  numbers[kFitRivalModels] = found.numbers[kFitRivalModels];
  numbers[kFitRivalPoses] = found.numbers[kFitRivalPoses];
  return numbers;
}

Fit ProposalJudge::fit_of(int model, const Pose& X_CO, const rendering::PoseEvidence& evidence, const Cluster& cluster,
                          bool stands) const {
  Fit fit;
  fit.target = &wanted_[static_cast<std::size_t>(model)].target;
  fit.learned = fit.target->learned;
  fit.X_CO = X_CO;
  fit.evidence = evidence;
  fit.cluster_C = cluster.points_C;
  fit.up_C = up_C_;
  fit.stands = stands;
  return fit;
}

}  // namespace prescene::filter
