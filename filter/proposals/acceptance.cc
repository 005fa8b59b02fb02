// SPDX-License-Identifier: Apache-2.0
#include "acceptance.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>

namespace prescene::filter {
namespace {

constexpr double kOutlineStep = 0.02;   // m; the measured surface ends by at least so much (kLeastOutline)
constexpr double kMostFloating = 0.03;  // m between the lowest points and what they stand on
constexpr double kMostOverlap = 0.1;    // share of an object that others may cut off (SupportSurfaces::overlap), ...
constexpr double kContact = 0.018;      // m; ... each side of it so much smaller: what is below may be off by as much
// Joint refinement of what is accepted.
constexpr RefineOptions kSettling = {.steps = 8, .first_gate = 0.02, .last_gate = 0.008};
constexpr double kLowestPoints = 0.01;      // m above an object's lowest point: what it may stand on
constexpr double kHopelessLogRatio = 20.0;  // nats
constexpr double kHopelessHits = 0.5;
constexpr double kHopelessVisible = 0.15;

constexpr std::size_t kComparedCorners = 16;
constexpr double kSamePlace = 0.012;  // m

/// Whether an object at X_WO has a surface right under it, or reaches a little below one: somewhere between the middle
/// of its lowest points and these, as its corners may all lie beyond the edges of what it stands on.
bool stands(const SearchTarget& target, const Pose& X_WO, const Vector3d& up_W,
            std::span<const SupportSurfaces* const> surfaces) {
  std::vector<Vector3d> points;
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& vertex : target.mesh->vertices) {
    points.push_back(X_WO * vertex.cast<double>());
    lowest = std::min(lowest, up_W.dot(points.back()));
  }
  std::erase_if(points, [&](const Vector3d& p) { return up_W.dot(p) > lowest + kLowestPoints; });
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : points) middle += p / static_cast<double>(points.size());
  return std::any_of(points.begin(), points.end(), [&](const Vector3d& corner) {
    for (const double share : {1.0, 0.5, 0.0}) {
      const Vector3d p = middle + share * (corner - middle);
      for (const SupportSurfaces* surface : surfaces)
        if (surface->crosses(p + kMostSinking * up_W, p - kMostFloating * up_W)) return true;
    }
    return false;
  });
}

/// The things that were found, as surfaces.
SupportSurfaces surfaces_of(std::span<const Detection> found, std::span<const WantedModel> wanted, const Pose& X_WC) {
  SupportSurfaces surfaces;
  for (const Detection& detection : found)
    surfaces.add(*wanted[static_cast<std::size_t>(detection.model)].target.mesh, X_WC * detection.X_CO);
  return surfaces;
}

}  // namespace

geometry::Box box_about(const SearchTarget& target, const Pose& X_CO) {
  geometry::Box box;
  for (const auto& vertex : target.mesh->vertices) box.extend(X_CO * vertex.cast<double>());
  return box;
}

bool is_same_place(const SearchTarget& target, const Pose& a_CO, const Pose& b_CO, const geometry::Box& a_box,
                   const geometry::Box& b_box) {
  if ((a_box.min() - b_box.min()).cwiseAbs().maxCoeff() > kSamePlace ||
      (a_box.max() - b_box.max()).cwiseAbs().maxCoeff() > kSamePlace)
    return false;
  const auto& vertices = target.mesh->vertices;
  const std::size_t stride = 1 + vertices.size() / kComparedCorners;
  const Pose X_BA = b_CO.inverse() * a_CO;
  for (std::size_t i = 0; i < vertices.size(); i += stride) {
    const Vector3d corner = X_BA * vertices[i].cast<double>();
    if (std::none_of(vertices.begin(), vertices.end(),
                     [&](const auto& v) { return (v.template cast<double>() - corner).norm() < kSamePlace; }))
      return false;
  }
  return true;
}

bool hopeless(const rendering::PoseEvidence& e) {
  return e.log_ratio < kHopelessLogRatio || e.hit_share() < kHopelessHits || e.visible < kHopelessVisible * e.in_view;
}

std::vector<geometry::DepthImage> depths_of(std::span<const Detection> found, std::span<const WantedModel> wanted,
                                            const geometry::PinholeCamera& camera, const FilterTools& tools) {
  std::vector<geometry::DepthImage> depths;
  for (const Detection& detection : found)
    depths.push_back(
        depth_of(wanted[static_cast<std::size_t>(detection.model)].target, detection.X_CO, camera, *tools.renderer));
  return depths;
}

void reweigh(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
             std::span<const int> left, const FilterTools& tools, std::vector<Proposal>& proposals) {
  std::erase_if(proposals, [&](const Proposal& p) { return left[static_cast<std::size_t>(p.model)] == 0; });
  tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    Proposal& p = proposals[i];
    p.candidate.evidence =
        weighing.of(terms, wanted[static_cast<std::size_t>(p.model)].target, p.candidate.X_CO, *workspace);
    p.outline = -1.0;
  });
}

void accept_greedily(std::vector<Proposal> proposals, const std::vector<Cluster>& clusters,
                     const Surroundings& surroundings, std::span<const WantedModel> wanted, const ProposalJudge& judge,
                     const Weighing& weighing, const DetectionOptions& options, const FilterTools& tools,
                     rendering::FrameTerms& terms, geometry::DepthImage& known, std::vector<int>& left,
                     std::vector<Detection>& found) {
  SupportSurfaces things = surfaces_of(found, wanted, surroundings.X_WC);
  const std::array<const SupportSurfaces*, 3> ground = {&surroundings.solid, &surroundings.steps, &things};
  const auto weigh_standing = [&] {
    tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
      Proposal& p = proposals[i];
      const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
      const Pose X_WO = surroundings.X_WC * p.candidate.X_CO;
      p.weigh(stands(target, X_WO, surroundings.up_W, ground));
    });
    std::erase_if(proposals, [&](const Proposal& p) {
      return judge.decides() ? hopeless(p.candidate.evidence) : !acceptable(p.candidate.evidence, 0.0, options);
    });
    if (judge.decides()) judge.judge(terms, clusters, proposals);
  };
  const auto worse = [&](const Proposal& a, const Proposal& b) {
    return judge.decides() ? a.log_odds < b.log_odds : a.score() < b.score();
  };
  const auto outline_of = [&](const Proposal& p) {
    const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
    return outline_support(terms, depth_of(target, p.candidate.X_CO, terms.camera, *tools.renderer), kOutlineStep);
  };
  // For what they stand on, or where a neighbour is that is not found yet and ends their surface.
  std::vector<Proposal> waiting;
  weigh_standing();
  while (!proposals.empty() || !waiting.empty()) {
    bool for_now = false;
    if (proposals.empty()) {
      // Things that stand on each other wait for each other: the best of them that stands goes first. Whether its
      // surface ends, with the others in their places, is seen in the end.
      for (Proposal& p : waiting)
        if (p.outline < 0.0) p.outline = outline_of(p);
      std::vector<Proposal>::iterator next = waiting.end();
      for (auto p = waiting.begin(); p != waiting.end(); ++p)
        if (p->outline >= kLeastOutlineForNow && acceptable(p->candidate.evidence, p->cost, options) &&
            (next == waiting.end() || worse(*next, *p)))
          next = p;
      if (next == waiting.end()) break;
      proposals.push_back(*next);
      waiting.erase(next);
      for_now = true;
    }
    const auto best = std::max_element(proposals.begin(), proposals.end(), worse);
    if (judge.decides() ? best->log_odds < kLeastLogOdds : !acceptable(best->candidate.evidence, best->cost, options)) {
      // What stands on nothing now may stand on what is found next.
      if (!judge.decides() && acceptable(best->candidate.evidence, 0.0, options)) waiting.push_back(*best);
      proposals.erase(best);
      continue;
    }
    const auto model = static_cast<std::size_t>(best->model);
    const SearchTarget& target = wanted[model].target;
    const Pose X_WO = surroundings.X_WC * best->candidate.X_CO;
    if (things.overlap(*target.mesh, X_WO, kContact) > kMostOverlap) {
      proposals.erase(best);
      continue;
    }
    if (!judge.decides() && best->outline < 0.0) {
      best->outline = outline_of(*best);
      continue;  // it may not be the best any more
    }
    if (!judge.decides() && !for_now && best->outline < kLeastOutline) {
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

void settle(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
            const DetectionOptions& options, const FilterTools& tools, const core::RandomStream& stream,
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
    const Pose starts[] = {found[i].X_CO};
    const auto refined = tools.search->run_serial(mine, target, starts, search, stream.at(i), *workspace);
    found[i].evidence = weighing.of(mine, target, found[i].X_CO, *workspace);
    const rendering::PoseEvidence after = weighing.of(mine, target, refined.front().X_CO, *workspace);
    if (after.log_ratio > found[i].evidence.log_ratio) found[i].X_CO = refined.front().X_CO, found[i].evidence = after;
    depths[i] = depth_of(target, found[i].X_CO, terms.camera, *tools.renderer);
    found[i].outline = outline_support(mine, depths[i], kOutlineStep);
  }
}

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
        probability_right(found[i].evidence, expected_evidence_of(mine, target, found[i].X_CO, *tools.renderer));
  }
  return log_odds;
}

std::vector<Detection> take_back(const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                 const ProposalJudge& judge, const DetectionOptions& options, const LeastOfFind& least,
                                 std::span<const double> log_odds, std::vector<int>& left,
                                 std::vector<Detection>& found) {
  std::vector<Detection> taken;
  for (std::size_t i = found.size(); i-- > 0;) {
    std::vector<Detection> others = found;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const SupportSurfaces things = surfaces_of(others, wanted, surroundings.X_WC);
    const std::array<const SupportSurfaces*, 3> ground = {&surroundings.solid, &surroundings.steps, &things};
    Detection& detection = found[i];
    const auto model = static_cast<std::size_t>(detection.model);
    const Pose X_WO = surroundings.X_WC * detection.X_CO;
    detection.stands = stands(wanted[model].target, X_WO, surroundings.up_W, ground);
    Proposal proposal;
    proposal.model = detection.model;
    proposal.candidate = {detection.X_CO, detection.evidence};
    proposal.weigh(detection.stands);
    if (judge.decides() ? !hopeless(detection.evidence) && judge.believes(log_odds[i])
                        : acceptable(detection.evidence, proposal.cost, options) &&
                              detection.outline >= least.outline && detection.probability >= least.probability)
      continue;
    ++left[model];
    taken.push_back(detection);
    found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return taken;
}

}  // namespace prescene::filter
