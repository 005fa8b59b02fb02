// SPDX-License-Identifier: Apache-2.0
#include "acceptance.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <utility>

#include "detection_parts.h"
#include "prescene/filter/proposals/fit_judgement.h"
#include "proposal_judge.h"

namespace prescene::filter {
namespace {

constexpr double kContactInFine = 0.018;  // m (kMostOverlap): what is below may be off by as much
constexpr std::size_t kComparedCorners = 16;
constexpr double kSameCorner = 0.012;  // m
// Thresholds. Chosen on rooms 1 to 40 (docs/studies/tracking.md).
constexpr double kLeastOutlineForNow = 0.35;  // of a pose for want of better ones, until it is known what else ends it
constexpr double kLogRatioLess = 30.0;        // nats less than DetectionOptions::min_log_ratio are enough
constexpr double kLeastEvidence = 2.5;        // nats per visible pixel; thin things on a known surface say little
constexpr double kLeastVisible = 0.2;         // of the pixels that a pose shows, known things in front or not
constexpr double kFloatingNats = 30.0;        // that a pose costs which stands on nothing known, ...
constexpr double kFloatingPart = 0.4;         // ... and a share of its log ratio
constexpr double kPowerOfHits = 8.0;          // how much a pose's score suffers from pixels that do not match ...
constexpr double kPowerOfOutline = 4.0;       // ... and from a surface that goes on past its outline
// A find is moved so far on what it stands on, m, and refined there; it is at another place if it stays that far away.
constexpr std::array<double, 2> kShakes = {0.025, 0.05};
constexpr RefineOptions kShaken = {.steps = 3, .first_gate = 0.02, .last_gate = 0.008};
constexpr double kOtherPlace = 0.015;  // m
// So many other proposals of its model are compared with a find, and must fit better by these log odds.
constexpr std::size_t kLikelier = 4;
constexpr double kClearlyLikelier = 1.0;
// What an object stands on is looked for under the middle of its lowest points, too: its corners may all lie beyond the
// edges of what it stands on.
constexpr std::array<double, 3> kUnderIt = {1.0, 0.5, 0.0};

Fit fit_of(int model, const Pose& X_CO, const rendering::PoseEvidence& evidence, std::span<const WantedModel> wanted,
           const Weighing& weighing) {
  Fit fit;
  fit.color = &weighing.color();
  fit.target = &wanted[static_cast<std::size_t>(model)].target;
  fit.X_CO = X_CO;
  fit.evidence = evidence;
  return fit;
}

/// Moves a find about on what it stands on, along its own axes, and lets each place follow the frame: takes a better
/// one, and returns the least number of nats by which another place explains less.
double shake(const rendering::FrameTerms& terms, const SearchTarget& target, const Weighing& weighing,
             const Vector3d& up_C, const FilterTools& tools, rendering::LikelihoodWorkspace& workspace,
             Detection& found) {
  const Vector3d centre = target.centre();
  const geometry::Matrix3d R = found.X_CO.rotation.toRotationMatrix();
  Eigen::Index upright = 0;
  (R.transpose() * up_C).cwiseAbs().maxCoeff(&upright);
  std::vector<PoseCandidate> moved;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == upright) continue;
    const Vector3d way = (R.col(axis) - up_C * up_C.dot(R.col(axis))).normalized();
    for (const double distance : kShakes)
      for (const double side : {-1.0, 1.0}) {
        PoseCandidate candidate;
        candidate.X_CO = found.X_CO;
        candidate.X_CO.translation += side * distance * way;
        moved.push_back(candidate);
      }
  }
  for (PoseCandidate& candidate : moved) {
    tools.search->refine(terms, target, kShaken, workspace, std::span(&candidate.X_CO, 1));
    candidate.evidence = weighing.of(terms, target, candidate.X_CO, workspace);
    if (candidate.evidence.log_ratio <= found.evidence.log_ratio) continue;
    std::swap(candidate.X_CO, found.X_CO);
    std::swap(candidate.evidence, found.evidence);
  }
  double margin = std::numeric_limits<double>::infinity();
  for (const PoseCandidate& candidate : moved)
    if ((candidate.X_CO * centre - found.X_CO * centre).norm() > kOtherPlace)
      margin = std::min(margin, found.evidence.log_ratio - candidate.evidence.log_ratio);
  return margin;
}

/// Where its own model fits better elsewhere, though it explains less there, a find goes there: what it explained may
/// be something larger.
void take_likelier(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
                   const DetectionOptions& options, const FilterTools& tools, std::span<const FineProposal> proposals,
                   rendering::LikelihoodWorkspace& workspace, Detection& found) {
  const SearchTarget& target = wanted[static_cast<std::size_t>(found.model)].target;
  const geometry::Box box = box_about(target, found.X_CO);
  std::vector<FineProposal> others;
  for (const FineProposal& p : proposals) {
    if (p.model != found.model ||
        is_same_place(target, found.X_CO, p.candidate.X_CO, box, box_about(target, p.candidate.X_CO)))
      continue;
    others.push_back(p);
    others.back().candidate.evidence = weighing.of(terms, target, p.candidate.X_CO, workspace);
    if (!acceptable_in_fine(others.back().candidate.evidence, 0.0, options)) others.pop_back();
  }
  if (others.empty()) return;
  const auto log_odds_of = [&](const Pose& X_CO, const rendering::PoseEvidence& evidence) {
    FitNumbers numbers = fit_numbers(fit_of(found.model, X_CO, evidence, wanted, weighing), terms, *tools.renderer);
    numbers[kFitRivalModels] = numbers[kFitRivalPoses] = 0.0F;
    const double p = probability_of_fit(numbers);
    return std::log(p / (1.0 - p));
  };
  std::stable_sort(others.begin(), others.end(), [](const FineProposal& a, const FineProposal& b) {
    return a.candidate.evidence.log_ratio > b.candidate.evidence.log_ratio;
  });
  others.resize(std::min(others.size(), kLikelier));
  double best = kClearlyLikelier + log_odds_of(found.X_CO, weighing.of(terms, target, found.X_CO, workspace));
  for (const FineProposal& p : others) {
    const double mine = log_odds_of(p.candidate.X_CO, p.candidate.evidence);
    if (mine <= best) continue;
    best = mine;
    found.X_CO = p.candidate.X_CO;
    found.cluster = p.cluster;
  }
}

}  // namespace

double FineProposal::score() const {
  const double fits = outline < 0.0 ? 1.0 : probability * std::pow(outline, kPowerOfOutline);
  return candidate.evidence.log_ratio * std::pow(candidate.evidence.hit_share(), kPowerOfHits) * fits - cost;
}

void FineProposal::weigh(bool on_something) {
  stands = on_something;
  cost = stands ? 0.0 : kFloatingNats + kFloatingPart * std::max(0.0, candidate.evidence.log_ratio);
}

bool acceptable_in_fine(const rendering::PoseEvidence& evidence, double cost, const DetectionOptions& options) {
  return evidence.log_ratio - cost > options.min_log_ratio - kLogRatioLess &&
         evidence.hit_share() >= options.min_hit_share && evidence.log_ratio_per_visible_pixel() >= kLeastEvidence &&
         evidence.visible >= kLeastVisible * evidence.in_view;
}

geometry::Box box_about(const SearchTarget& target, const Pose& X_CO) {
  geometry::Box box;
  for (const auto& vertex : target.mesh->vertices) box.extend(X_CO * vertex.cast<double>());
  return box;
}

bool is_same_place(const SearchTarget& target, const Pose& a_CO, const Pose& b_CO, const geometry::Box& a_box,
                   const geometry::Box& b_box) {
  if ((a_box.min() - b_box.min()).cwiseAbs().maxCoeff() > kSameCorner ||
      (a_box.max() - b_box.max()).cwiseAbs().maxCoeff() > kSameCorner)
    return false;
  const auto& vertices = target.mesh->vertices;
  const std::size_t stride = 1 + vertices.size() / kComparedCorners;
  const Pose X_BA = b_CO.inverse() * a_CO;
  for (std::size_t i = 0; i < vertices.size(); i += stride) {
    const Vector3d corner = X_BA * vertices[i].cast<double>();
    if (std::none_of(vertices.begin(), vertices.end(),
                     [&](const auto& v) { return (v.template cast<double>() - corner).norm() < kSameCorner; }))
      return false;
  }
  return true;
}

void reweigh(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
             std::span<const int> left, const FilterTools& tools, std::vector<FineProposal>& proposals) {
  std::erase_if(proposals, [&](const FineProposal& p) { return left[static_cast<std::size_t>(p.model)] == 0; });
  tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    FineProposal& p = proposals[i];
    p.candidate.evidence =
        weighing.of(terms, wanted[static_cast<std::size_t>(p.model)].target, p.candidate.X_CO, *workspace);
    p.outline = -1.0;
  });
}

void accept_in_fine(std::vector<FineProposal> proposals, const Surroundings& surroundings,
                    std::span<const WantedModel> wanted, const Weighing& weighing, const DetectionOptions& options,
                    const FilterTools& tools, rendering::FrameTerms& terms, geometry::DepthImage& known,
                    std::vector<int>& left, std::vector<Detection>& found) {
  SupportSurfaces things = surfaces_of(found, wanted, surroundings.X_WC);
  const std::array<const SupportSurfaces*, 3> ground = {&surroundings.solid, &surroundings.steps, &things};
  const auto weigh_standing = [&] {
    tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
      FineProposal& p = proposals[i];
      const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
      const Pose X_WO = surroundings.X_WC * p.candidate.X_CO;
      p.weigh(stands(target, X_WO, surroundings.up_W, ground, kUnderIt));
    });
    std::erase_if(proposals,
                  [&](const FineProposal& p) { return !acceptable_in_fine(p.candidate.evidence, 0.0, options); });
  };
  const auto worse = [](const FineProposal& a, const FineProposal& b) { return a.score() < b.score(); };
  const auto look_at = [&](FineProposal& p) {
    const Fit fit = fit_of(p.model, p.candidate.X_CO, p.candidate.evidence, wanted, weighing);
    FitNumbers numbers = fit_numbers(fit, terms, *tools.renderer);
    numbers[kFitRivalModels] = numbers[kFitRivalPoses] = 0.0F;  // rivals compete by their scores
    p.outline = static_cast<double>(numbers[kFitOutline]);
    p.probability = probability_of_fit(numbers);
  };
  // For what they stand on, or where a neighbour is that is not found yet and ends their surface.
  std::vector<FineProposal> waiting;
  weigh_standing();
  while (!proposals.empty() || !waiting.empty()) {
    bool for_now = false;
    if (proposals.empty()) {
      // Things that stand on each other wait for each other: the best of them that stands goes first. Whether its
      // surface ends, with the others in their places, is seen in the end.
      for (FineProposal& p : waiting)
        if (p.outline < 0.0) look_at(p);
      std::vector<FineProposal>::iterator next = waiting.end();
      for (auto p = waiting.begin(); p != waiting.end(); ++p)
        if (p->outline >= kLeastOutlineForNow && acceptable_in_fine(p->candidate.evidence, p->cost, options) &&
            (next == waiting.end() || worse(*next, *p)))
          next = p;
      if (next == waiting.end()) break;
      proposals.push_back(*next);
      waiting.erase(next);
      for_now = true;
    }
    const auto best = std::max_element(proposals.begin(), proposals.end(), worse);
    if (!acceptable_in_fine(best->candidate.evidence, best->cost, options)) {
      // What stands on nothing now may stand on what is found next.
      waiting.push_back(*best);
      proposals.erase(best);
      continue;
    }
    const auto model = static_cast<std::size_t>(best->model);
    const SearchTarget& target = wanted[model].target;
    const Pose X_WO = surroundings.X_WC * best->candidate.X_CO;
    if (things.overlap(*target.mesh, X_WO, kContactInFine) > kMostOverlap) {
      proposals.erase(best);
      continue;
    }
    if (best->outline < 0.0) {
      look_at(*best);
      continue;  // it may not be the best any more
    }
    if (!for_now && best->probability < options.least_probability) {
      waiting.push_back(*best);
      proposals.erase(best);
      continue;
    }
    Detection detection;
    detection.model = best->model;
    detection.X_CO = best->candidate.X_CO;
    detection.evidence = best->candidate.evidence;
    detection.cluster = best->cluster;
    found.push_back(detection);
    --left[model];
    const geometry::DepthImage depth = depth_of(target, detection.X_CO, terms.camera, *tools.renderer);
    merge_nearest(depth, &known);
    with_known_surfaces(terms, depth, &terms);
    things.add(*target.mesh, X_WO);
    std::move(waiting.begin(), waiting.end(), std::back_inserter(proposals));
    waiting.clear();
    reweigh(terms, wanted, weighing, left, tools, proposals);
    weigh_standing();
  }
}

void settle_in_fine(const rendering::FrameTerms& terms, const Vector3d& up_C, std::span<const WantedModel> wanted,
                    const Weighing& weighing, const DetectionOptions& options, const FilterTools& tools,
                    const core::RandomStream& stream, std::span<const FineProposal> proposals, bool is_thorough,
                    std::vector<Detection>& found) {
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
    if (is_thorough) take_likelier(mine, wanted, weighing, options, tools, proposals, *workspace, found[i]);
    const Pose starts[] = {found[i].X_CO};
    const auto refined = tools.search->run_serial(mine, target, starts, search, stream.at(i), *workspace);
    found[i].evidence = weighing.of(mine, target, found[i].X_CO, *workspace);
    const rendering::PoseEvidence after = weighing.of(mine, target, refined.front().X_CO, *workspace);
    if (after.log_ratio > found[i].evidence.log_ratio) found[i].X_CO = refined.front().X_CO, found[i].evidence = after;
    if (is_thorough) found[i].margin = shake(mine, target, weighing, up_C, tools, *workspace, found[i]);
    depths[i] = depth_of(target, found[i].X_CO, terms.camera, *tools.renderer);
    found[i].outline = outline_support(mine, depths[i], kOutlineStep, OutlineHoles::kSayNothing, &weighing.color());
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    rendering::FrameTerms mine = terms;
    for (std::size_t j = 0; j < found.size(); ++j)
      if (j != i) with_known_surfaces(mine, depths[j], &mine);
    Fit fit = fit_of(found[i].model, found[i].X_CO, found[i].evidence, wanted, weighing);
    set_rivals_among(proposals, found[i].model, found[i].cluster, fit);
    found[i].probability = probability_of_fit(fit_numbers(fit, mine, *tools.renderer));
  }
}

std::vector<Detection> take_back_in_fine(const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                         const DetectionOptions& options, const LeastOfFind& least,
                                         std::vector<int>& left, std::vector<Detection>& found) {
  const auto stays = [&](std::size_t i, double cost) {
    return acceptable_in_fine(found[i].evidence, cost, options) && found[i].outline >= least.outline &&
           found[i].probability >= least.probability;
  };
  return take_back_unless<FineProposal>(stays, kUnderIt, surroundings, wanted, left, found);
}

}  // namespace prescene::filter
