// SPDX-License-Identifier: Apache-2.0
// The search whose finds are judged in the fine image.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include "acceptance.h"
#include "detection_parts.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/filter/proposals/resting_starts.h"
#include "proposal_judge.h"

namespace prescene::filter {
namespace {

constexpr std::size_t kKeptShapes = 8;  // best poses of a cluster and model that compete ...
constexpr std::size_t kKeptShown = 5;   // ... and so many more of which the fine image shows most points
// Finds whose surface goes on may stay until the next round has looked for what ends it, twice.
constexpr int kFineRounds = 4;
constexpr double kSameCluster = 0.9;      // share of the pixels of clusters that are the same
constexpr int kLooks = 2;                 // each from other random starts, while a cluster stays unexplained
constexpr double kSameShapeShare = 0.15;  // of the log ratio
// Starts for each cluster and model: where it may rest, and this share of DetectionOptions::starts at random.
constexpr int kRestingStarts = 40;
constexpr double kRandomStarts = 0.5;
/// What is asked of finds between rounds. Chosen on rooms 1 to 40.
constexpr LeastOfFind kForNow = {.outline = 0.35, .probability = 0.0};
// What competes is refined once more at the resolution at which it is judged.
constexpr RefineOptions kFineRefine = {.steps = 6, .first_gate = 0.02, .last_gate = 0.008};

/// The best of each group of candidates that are one, best first: turns that look alike have one box about them.
void keep_distinct_shapes(const SearchTarget& target, std::size_t most, std::vector<PoseCandidate>& candidates) {
  std::vector<PoseCandidate> kept;
  std::vector<geometry::Box> boxes;
  for (const PoseCandidate& candidate : candidates) {
    if (kept.size() >= most) break;
    const geometry::Box box = box_about(target, candidate.X_CO);
    bool known = false;
    for (std::size_t i = 0; i < kept.size() && !known; ++i)
      known = is_same_place(target, kept[i].X_CO, candidate.X_CO, boxes[i], box) &&
              std::abs(kept[i].evidence.log_ratio - candidate.evidence.log_ratio) <
                  kSameShapeShare * std::abs(kept[i].evidence.log_ratio);
    if (known) continue;
    kept.push_back(candidate);
    boxes.push_back(box);
  }
  candidates = std::move(kept);
}

/// Poses that were found from several clusters count once.
void drop_repeated(std::span<const WantedModel> wanted, std::vector<FineProposal>& proposals) {
  std::stable_sort(proposals.begin(), proposals.end(), [](const FineProposal& a, const FineProposal& b) {
    return a.candidate.evidence.log_ratio > b.candidate.evidence.log_ratio;
  });
  std::vector<FineProposal> kept;
  std::vector<geometry::Box> boxes;
  for (const FineProposal& p : proposals) {
    const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
    const geometry::Box box = box_about(target, p.candidate.X_CO);
    bool known = false;
    for (std::size_t i = 0; i < kept.size() && !known; ++i)
      known = kept[i].model == p.model &&
              is_same_place(target, kept[i].candidate.X_CO, p.candidate.X_CO, boxes[i], box) &&
              p.candidate.evidence.log_ratio > (1.0 - kSameShapeShare) * kept[i].candidate.evidence.log_ratio;
    if (known) continue;
    kept.push_back(p);
    boxes.push_back(box);
  }
  proposals = std::move(kept);
}

/// The best poses of each wanted model in each cluster from `first` on, ordered by cluster, model, rank: looked for in
/// `terms`, then refined and weighed in `fine`.
std::vector<FineProposal> propose_in_fine(const rendering::FrameTerms& terms, const rendering::FrameTerms& fine,
                                          const Weighing& weighing, const SampledDepth& sampled,
                                          const std::vector<Cluster>& clusters, std::size_t first,
                                          const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                          std::span<const int> left, const DetectionOptions& options,
                                          const FilterTools& tools, const core::RandomStream& stream,
                                          std::uint64_t round) {
  std::vector<std::shared_ptr<const RestingShape>> resting;
  for (const WantedModel& model : wanted) resting.push_back(tools.meshes->resting_shape(*model.target.mesh));
  const Vector3d up_C = surroundings.X_WC.rotation.conjugate() * surroundings.up_W;
  const auto keep = [&](const SearchTarget& target, rendering::LikelihoodWorkspace& workspace,
                        std::vector<PoseCandidate>& found) {
    const auto model = std::find_if(wanted.begin(), wanted.end(), [&](const auto& w) { return &w.target == &target; });
    const RestingShape& shape = *resting[static_cast<std::size_t>(model - wanted.begin())];
    std::erase_if(found, [](const PoseCandidate& c) { return hopeless(c.evidence); });
    // The coarse image may have a right pose behind many wrong ones: some of those of which the fine one shows most.
    std::vector<std::pair<int, std::size_t>> order;
    for (std::size_t i = 0; i < found.size(); ++i) order.emplace_back(-points_shown(shape, fine, found[i].X_CO), i);
    std::sort(order.begin(), order.end());
    std::vector<PoseCandidate> shown;
    for (const auto& [points, i] : order) shown.push_back(found[i]);
    keep_distinct_shapes(target, kKeptShapes, found);
    keep_distinct_shapes(target, kKeptShown, shown);
    for (const PoseCandidate& candidate : shown) {
      const geometry::Box box = box_about(target, candidate.X_CO);
      if (std::none_of(found.begin(), found.end(), [&](const PoseCandidate& other) {
            return is_same_place(target, other.X_CO, candidate.X_CO, box_about(target, other.X_CO), box);
          }))
        found.push_back(candidate);
    }
    for (PoseCandidate& candidate : found) {
      candidate.X_CO = slid_about(shape, fine, up_C, candidate.X_CO);
      tools.search->refine(fine, target, kFineRefine, workspace, std::span(&candidate.X_CO, 1));
      candidate.evidence = weighing.of(fine, target, candidate.X_CO, workspace);
    }
  };
  const int random = static_cast<int>(std::lround(kRandomStarts * options.starts));
  const std::vector<ClusterShape> shapes =
      cluster_shapes(std::span(clusters).subspan(first), sampled, fine, surroundings, stream.at(round));
  const auto starts = [&](const SearchedModel& task, const core::RandomStream& mine) {
    const auto cluster = static_cast<std::size_t>(task.cluster), model = static_cast<std::size_t>(task.model);
    std::vector<Pose> all = resting_starts(shapes[cluster - first], *resting[model], fine, surroundings, kRestingStarts,
                                           mine.for_purpose(core::Purpose::kProposal));
    const std::vector<Pose> others = starts_in(clusters[cluster], sampled, wanted[model].target, up_C, random, mine);
    all.insert(all.end(), others.begin(), others.end());
    return all;
  };
  std::vector<FineProposal> proposals;
  for (const SearchedModel& task : search_clusters(terms, clusters.size(), first, surroundings, wanted, left, options,
                                                   tools, stream, round, starts, keep))
    for (const PoseCandidate& candidate : task.found) {
      if (!acceptable_in_fine(candidate.evidence, 0.0, options)) continue;
      FineProposal proposal;
      proposal.model = task.model;
      proposal.candidate = candidate;
      proposal.cluster = task.cluster;
      proposals.push_back(proposal);
    }
  drop_repeated(wanted, proposals);
  return proposals;
}

/// Whether clusters that have most of their pixels in common with this one were looked at often enough.
bool is_looked_at(const Cluster& cluster, std::span<const Cluster> looked_at) {
  return kLooks <= std::count_if(looked_at.begin(), looked_at.end(), [&](const Cluster& other) {
           std::vector<int> common;
           std::set_intersection(cluster.pixels.begin(), cluster.pixels.end(), other.pixels.begin(), other.pixels.end(),
                                 std::back_inserter(common));
           return static_cast<double>(common.size()) >
                  kSameCluster * static_cast<double>(std::max(cluster.pixels.size(), other.pixels.size()));
         });
}

}  // namespace

std::vector<Detection> detect(const rendering::FrameTerms& frame_terms, const FineFrame& fine_frame,
                              const geometry::DepthImage& known, const SampledDepth& sampled,
                              const Surroundings& surroundings, std::span<const WantedModel> wanted,
                              const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, DetectionTrace* trace) {
  const ProposalJudge judge(wanted, surroundings.X_WC.rotation.conjugate() * surroundings.up_W, options, tools, trace);
  if (judge.decides() || !fine_frame.smear.is_sharp())
    return detect(frame_terms, known, sampled, surroundings, wanted, options, tools, stream, trace);
  const rendering::FrameTerms terms = with_background(frame_terms, sampled, surroundings);
  const rendering::FrameTerms fine = with_background(fine_frame.terms, sampled, surroundings);
  const Weighing weighing(terms, fine_frame, tools);
  std::vector<int> left;
  for (const WantedModel& model : wanted) left.push_back(model.count);
  rendering::FrameTerms explained_terms = terms, explained_fine = fine;
  const geometry::DepthImage nothing(fine.camera.width, fine.camera.height);
  geometry::DepthImage explained_depth = nothing;
  const auto known_mask = explained_pixels(sampled, known, terms.camera, kExplainedDepth);
  const LeastOfFind at_the_end = {.outline = kLeastOutline, .probability = options.least_probability};
  std::vector<Detection> found;
  std::vector<Cluster> looked_at;
  std::vector<FineProposal> pool;
  for (int round = 0; round < kFineRounds; ++round) {
    auto mask = explained_pixels(sampled, explained_depth, fine.camera, kExplainedDepth);
    for (std::size_t i = 0; i < mask.size(); ++i)
      mask.data()[i] |= surroundings.background.data()[i] | known_mask.data()[i];
    std::vector<Cluster> clusters = clusters_over_supports(sampled, mask, surroundings, options);
    const std::size_t first = looked_at.size();
    std::erase_if(clusters, [&](const Cluster& c) { return is_looked_at(c, looked_at); });
    std::move(clusters.begin(), clusters.end(), std::back_inserter(looked_at));
    std::vector<FineProposal> proposals =
        propose_in_fine(explained_terms, explained_fine, weighing, sampled, looked_at, first, surroundings, wanted,
                        left, options, tools, stream, static_cast<std::uint64_t>(round));
    std::move(proposals.begin(), proposals.end(), std::back_inserter(pool));
    if (pool.empty()) continue;
    proposals = pool;
    reweigh(explained_fine, wanted, weighing, left, tools, proposals);
    accept_in_fine(std::move(proposals), surroundings, wanted, weighing, options, tools, explained_fine,
                   explained_depth, left, found);
    const bool is_strict = round % 2 == 1;
    settle_in_fine(fine, surroundings.X_WC.rotation.conjugate() * surroundings.up_W, wanted, weighing, options, tools,
                   stream, pool, is_strict, found);
    const std::vector<Detection> taken =
        take_back_in_fine(surroundings, wanted, options, is_strict ? at_the_end : kForNow, left, found);
    // It would be accepted again, in place of what is right.
    if (is_strict)
      std::erase_if(pool, [&](const FineProposal& p) {
        return std::any_of(taken.begin(), taken.end(), [&](const Detection& d) {
          const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
          return d.model == p.model && is_same_place(target, d.X_CO, p.candidate.X_CO, box_about(target, d.X_CO),
                                                     box_about(target, p.candidate.X_CO));
        });
      });
    explained_terms = terms;
    explained_fine = fine;
    explained_depth = nothing;
    for (const geometry::DepthImage& depth : depths_of(found, wanted, terms.camera, tools))
      with_known_surfaces(explained_terms, depth, &explained_terms);
    for (const geometry::DepthImage& depth : depths_of(found, wanted, fine.camera, tools)) {
      merge_nearest(depth, &explained_depth);
      with_known_surfaces(explained_fine, depth, &explained_fine);
    }
  }
  for (Detection& detection : found)
    detection.probability =
        probability_of_find(detection.probability, detection.margin / std::max(1.0, detection.evidence.log_ratio));
  std::erase_if(found, [&](const Detection& d) { return d.probability < options.least_probability; });
  return found;
}

}  // namespace prescene::filter
