// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/detection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "detection_parts.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "proposal_judge.h"

namespace prescene::filter {
namespace {

constexpr int kKept = 4;            // best poses of a cluster and model that compete
constexpr int kRounds = 2;          // the second looks at what the first left unexplained
constexpr double kContact = 0.012;  // m; each side of an object is taken for so much smaller (kMostOverlap)
// Log odds of a find, see probability_right: logistic regression on simulated rooms (docs/studies/tracking.md).
constexpr double kOddsAtFull = 1.9;         // of an object with the usual log ratio that matches as well as expected
constexpr double kUsualLogRatio = 200.0;    // nats
constexpr double kOddsOfSize = 1.3;         // per factor e of the log ratio
constexpr double kOddsOfLack = 13.8;        // per share of the expected evidence that is missing
constexpr double kLeastSupportArea = 0.05;  // m^2; a smaller flat patch may be a face of an object
// What an object stands on is looked for under its lowest corners alone.
constexpr std::array<double, 1> kAtCorners = {1.0};
constexpr double kFacesOfASupport = 1.4;  // a support or a wall is so much larger than the largest face of an object
// Where a learned judge decides, only what is hopeless is not shown to it.
constexpr int kKeptForJudge = 6;
// Candidates of one cluster and model that are so near and explain so much the same are one.
constexpr double kSamePlace = 0.01;  // m
constexpr double kSameShare = 0.03;  // of the log ratio

/// The best of each group of candidates that are one, best first.
void keep_distinct(const Vector3d& centre, std::size_t most, std::vector<PoseCandidate>& candidates) {
  std::vector<PoseCandidate> kept;
  for (const PoseCandidate& candidate : candidates) {
    if (kept.size() >= most) break;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const PoseCandidate& k) {
      return (k.X_CO * centre - candidate.X_CO * centre).norm() < kSamePlace &&
             std::abs(k.evidence.log_ratio - candidate.evidence.log_ratio) <
                 kSameShare * std::abs(k.evidence.log_ratio);
    });
    if (!known) kept.push_back(candidate);
  }
  candidates = std::move(kept);
}

/// The best poses of each wanted model in each cluster from `first` on, ordered by cluster, model, rank.
std::vector<Proposal> propose(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                              const std::vector<Cluster>& clusters, std::size_t first, const Surroundings& surroundings,
                              std::span<const WantedModel> wanted, std::span<const int> left,
                              const ProposalJudge& judge, const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, std::uint64_t round) {
  const auto keep = [&](const SearchTarget& target, rendering::LikelihoodWorkspace&,
                        std::vector<PoseCandidate>& found) {
    if (judge.decides())
      keep_distinct(target.centre(), kKeptForJudge, found);
    else
      found.resize(std::min(found.size(), static_cast<std::size_t>(kKept)));
  };
  const Vector3d up_C = surroundings.X_WC.rotation.conjugate() * surroundings.up_W;
  const auto starts = [&](const SearchedModel& task, const core::RandomStream& mine) {
    return starts_in(clusters[static_cast<std::size_t>(task.cluster)], sampled,
                     wanted[static_cast<std::size_t>(task.model)].target, up_C, options.starts, mine);
  };
  std::vector<Proposal> proposals;
  for (const SearchedModel& task : search_clusters(terms, clusters.size(), first, surroundings, wanted, left, options,
                                                   tools, stream, round, starts, keep))
    for (const PoseCandidate& candidate : task.found)
      if (judge.decides() ? !hopeless(candidate.evidence) : acceptable(candidate.evidence, 0.0, options)) {
        Proposal proposal;
        proposal.model = task.model;
        proposal.candidate = candidate;
        proposal.cluster = task.cluster;
        proposals.push_back(proposal);
      }
  return proposals;
}

/// Accepts the strongest proposal, puts it into the frame, judges the others again, until none is acceptable.
void accept_greedily(std::vector<Proposal> proposals, const std::vector<Cluster>& clusters,
                     const Surroundings& surroundings, std::span<const WantedModel> wanted, const ProposalJudge& judge,
                     const DetectionOptions& options, const FilterTools& tools, rendering::FrameTerms& terms,
                     geometry::DepthImage& known, std::vector<int>& left, std::vector<Detection>& found) {
  SupportSurfaces things = surfaces_of(found, wanted, surroundings.X_WC);
  const std::array<const SupportSurfaces*, 3> ground = {&surroundings.solid, &surroundings.steps, &things};
  const auto weigh_standing = [&] {
    tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
      Proposal& p = proposals[i];
      const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
      const Pose X_WO = surroundings.X_WC * p.candidate.X_CO;
      p.weigh(stands(target, X_WO, surroundings.up_W, ground, kAtCorners));
    });
    // What stands on nothing now may stand on what is found next.
    std::erase_if(proposals, [&](const Proposal& p) {
      return judge.decides() ? hopeless(p.candidate.evidence) : !acceptable(p.candidate.evidence, 0.0, options);
    });
    if (judge.decides()) judge.judge(terms, clusters, proposals);
  };
  const auto worse = [&](const Proposal& a, const Proposal& b) {
    return judge.decides() ? a.log_odds < b.log_odds : a.score() < b.score();
  };
  std::vector<Proposal> waiting;
  weigh_standing();
  while (!proposals.empty()) {
    const auto best = std::max_element(proposals.begin(), proposals.end(), worse);
    if (judge.decides() ? best->log_odds < kLeastLogOdds : !acceptable(best->candidate.evidence, best->cost, options)) {
      proposals.erase(best);
      continue;
    }
    const auto model = static_cast<std::size_t>(best->model);
    const SearchTarget& target = wanted[model].target;
    const Pose X_WO = surroundings.X_WC * best->candidate.X_CO;
    const geometry::DepthImage depth = depth_of(target, best->candidate.X_CO, terms.camera, *tools.renderer);
    if (things.overlap(*target.mesh, X_WO, kContact) > kMostOverlap) {
      proposals.erase(best);
      continue;
    }
    if (!judge.decides() && outline_support(terms, depth, kOutlineStep) < kLeastOutline) {
      // Its surface may end where a neighbour is that is not found yet.
      waiting.push_back(*best);
      proposals.erase(best);
      continue;
    }
    Detection detection;
    detection.model = best->model;
    detection.X_CO = best->candidate.X_CO;
    detection.evidence = best->candidate.evidence;
    detection.cluster = best->cluster;
    detection.numbers = best->numbers;
    detection.log_odds = best->log_odds;
    found.push_back(detection);
    --left[model];
    merge_nearest(depth, &known);
    with_known_surfaces(terms, depth, &terms);
    things.add(*target.mesh, X_WO);
    std::move(waiting.begin(), waiting.end(), std::back_inserter(proposals));
    waiting.clear();
    std::erase_if(proposals, [&](const Proposal& p) { return left[static_cast<std::size_t>(p.model)] == 0; });
    tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
      const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
      Proposal& p = proposals[i];
      const auto h = hypothesis(wanted[static_cast<std::size_t>(p.model)].target, p.candidate.X_CO);
      tools.search->batch().evaluate(terms, std::span(&h, 1), *workspace, std::span(&p.candidate.evidence, 1));
    });
    weigh_standing();
  }
}

/// Each accepted object once more, given the others where they are now.
void settle(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const DetectionOptions& options,
            const FilterTools& tools, const core::RandomStream& stream, std::vector<Detection>& found) {
  std::vector<geometry::DepthImage> depths = depths_of(found, wanted, terms.camera, tools);
  const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
  for (std::size_t i = 0; i < found.size(); ++i) {
    rendering::FrameTerms mine = terms;
    for (std::size_t j = 0; j < found.size(); ++j)
      if (j != i) with_known_surfaces(mine, depths[j], &mine);
    const SearchTarget& target = wanted[static_cast<std::size_t>(found[i].model)].target;
    SearchOptions search = options.search;
    search.refine = kSettling;
    search.polish_candidates = 1;
    const Pose starts[] = {found[i].X_CO};
    const auto refined = tools.search->run_serial(mine, target, starts, search, stream.at(i), *workspace);
    rendering::PoseEvidence before;
    const auto h = hypothesis(target, found[i].X_CO);
    tools.search->batch().evaluate(mine, std::span(&h, 1), *workspace, std::span(&before, 1));
    const bool better = refined.front().evidence.log_ratio > before.log_ratio;
    if (better) found[i].X_CO = refined.front().X_CO;
    found[i].evidence = better ? refined.front().evidence : before;
    depths[i] = depth_of(target, found[i].X_CO, terms.camera, *tools.renderer);
    found[i].outline = outline_support(mine, depths[i], kOutlineStep);
  }
}

/// Gives each find the probability that it is right; returns the judge's log odds of each with all others known.
std::vector<double> believe(const rendering::FrameTerms& terms, const std::vector<Cluster>& clusters,
                            std::span<const WantedModel> wanted, const ProposalJudge& judge, const FilterTools& tools,
                            std::vector<Detection>& found) {
  const std::vector<geometry::DepthImage> depths = depths_of(found, wanted, terms.camera, tools);
  std::vector<double> log_odds(found.size(), 0.0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    rendering::FrameTerms mine = terms;
    for (std::size_t j = 0; j < found.size(); ++j)
      if (j != i) with_known_surfaces(mine, depths[j], &mine);
    const SearchTarget& target = wanted[static_cast<std::size_t>(found[i].model)].target;
    if (judge.decides()) {
      const FitNumbers numbers = judge.numbers_of(mine, clusters[static_cast<std::size_t>(found[i].cluster)], found[i]);
      log_odds[i] = tools.learned->fit.log_odds(numbers);
      found[i].probability = judge.probability(found[i].log_odds, log_odds[i]);
      continue;
    }
    found[i].probability =
        probability_right(found[i].evidence, expected_evidence_of(mine, target, found[i].X_CO, *tools.renderer).of_all);
  }
  return log_odds;
}

/// Takes back what is no longer acceptable now that the others are where they are.
void take_back(const Surroundings& surroundings, std::span<const WantedModel> wanted, const ProposalJudge& judge,
               const DetectionOptions& options, std::span<const double> log_odds, std::vector<int>& left,
               std::vector<Detection>& found) {
  const auto stays = [&](std::size_t i, double cost) {
    const Detection& detection = found[i];
    return judge.decides() ? !hopeless(detection.evidence) && judge.believes(log_odds[i])
                           : acceptable(detection.evidence, cost, options) && detection.outline >= kLeastOutline;
  };
  take_back_unless<Proposal>(stays, kAtCorners, surroundings, wanted, left, found);
}

}  // namespace

double probability_right(const rendering::PoseEvidence& evidence, double expected_evidence) {
  if (!(evidence.log_ratio > 0.0) || !(expected_evidence > 0.0)) return 0.0;
  // Infinite: what to expect is not known.
  const double share =
      std::isfinite(expected_evidence) ? evidence.log_ratio_per_visible_pixel() / expected_evidence : 1.0;
  const double log_odds = kOddsAtFull + kOddsOfSize * std::log(evidence.log_ratio / kUsualLogRatio) -
                          kOddsOfLack * std::max(0.0, 1.0 - share);
  return 1.0 / (1.0 + std::exp(-log_odds));
}

double least_support_area(std::span<const WantedModel> wanted) {
  double largest = 0.0;
  for (const WantedModel& model : wanted) {
    geometry::Box box;
    for (const auto& vertex : model.target.mesh->vertices) box.extend(vertex.cast<double>());
    if (box.isEmpty()) continue;
    const Vector3d size = box.sizes();
    largest = std::max(largest, size.prod() / std::max(size.minCoeff(), 1e-6));
  }
  return std::max(kLeastSupportArea, kFacesOfASupport * largest);
}

std::vector<Detection> detect(const rendering::FrameTerms& frame_terms, const geometry::DepthImage& known,
                              const SampledDepth& sampled, const Surroundings& surroundings,
                              std::span<const WantedModel> wanted, const DetectionOptions& options,
                              const FilterTools& tools, const core::RandomStream& stream, DetectionTrace* trace) {
  const rendering::FrameTerms terms = with_walls(frame_terms, sampled, surroundings);
  const ProposalJudge judge(wanted, surroundings.X_WC.rotation.conjugate() * surroundings.up_W, options, tools, trace);
  std::vector<int> left;
  for (const WantedModel& model : wanted) left.push_back(model.count);
  rendering::FrameTerms explained_terms = terms;
  geometry::DepthImage explained_depth =
      known.empty() ? geometry::DepthImage(terms.camera.width, terms.camera.height) : known;
  std::vector<Detection> found;
  std::vector<Cluster> looked_at;
  for (int round = 0; round < kRounds; ++round) {
    auto mask = explained_pixels(sampled, explained_depth, terms.camera, kExplainedDepth);
    for (std::size_t i = 0; i < mask.size(); ++i) mask.data()[i] |= surroundings.background.data()[i];
    std::vector<Cluster> clusters = clusters_over_supports(sampled, mask, surroundings, options);
    const std::size_t first = looked_at.size();
    std::move(clusters.begin(), clusters.end(), std::back_inserter(looked_at));
    std::vector<Proposal> proposals = propose(explained_terms, sampled, looked_at, first, surroundings, wanted, left,
                                              judge, options, tools, stream, static_cast<std::uint64_t>(round));
    if (proposals.empty()) continue;
    accept_greedily(std::move(proposals), looked_at, surroundings, wanted, judge, options, tools, explained_terms,
                    explained_depth, left, found);
    settle(terms, wanted, options, tools, stream, found);
    std::vector<double> log_odds(found.size(), 0.0);
    if (judge.decides()) log_odds = believe(terms, looked_at, wanted, judge, tools, found);
    take_back(surroundings, wanted, judge, options, log_odds, left, found);
    explained_terms = terms;
    explained_depth = known.empty() ? geometry::DepthImage(terms.camera.width, terms.camera.height) : known;
    for (const geometry::DepthImage& depth : depths_of(found, wanted, terms.camera, tools)) {
      merge_nearest(depth, &explained_depth);
      with_known_surfaces(explained_terms, depth, &explained_terms);
    }
  }
  const std::vector<double> log_odds = believe(terms, looked_at, wanted, judge, tools, found);
  if (trace != nullptr)
    for (std::size_t i = 0; i < found.size(); ++i)
      trace->finds.push_back({found[i].model, found[i].X_CO, found[i].numbers, found[i].log_odds, log_odds[i]});
  if (judge.decides() && trace == nullptr)
    std::erase_if(found, [&](const Detection& d) { return d.probability < options.least_probability; });
  return found;
}

}  // namespace prescene::filter
