// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/detection.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "acceptance.h"
#include "prescene/filter/proposals/fine_frame.h"

namespace prescene::filter {
namespace {

constexpr std::size_t kKept = 12;  // best poses of a cluster and model that compete
constexpr int kLearnedRounds = 2;  // of a learned judge; the second looks at what the first left unexplained
// Else finds whose surface goes on may stay until the next round has looked for what ends it, twice.
constexpr int kRounds = 4;
constexpr double kSameCluster = 0.9;     // share of the pixels of clusters that are not looked at again
constexpr double kStandingStarts = 0.3;  // share of the starts with a side of the model's box down
constexpr int kFloatingClusters = 3;     // clusters that are over no support and yet looked at
// m; a measurement so little in front of a known surface, or up to twice as much behind it, is explained.
constexpr double kExplainedDepth = 0.015;
/// What is asked of finds between rounds, and at the end.
constexpr LeastOfFind kForNow = {.outline = kLeastOutlineForNow, .probability = 0.0};
constexpr LeastOfFind kAtTheEnd = {.outline = kLeastOutline, .probability = 0.15};  // chosen on rooms 1 to 40
// Starts for each cluster and model where something was learned of it (FilterTools::learned), in place of
// DetectionOptions::starts. Chosen.
constexpr int kLearnedStarts = 36;  // poses that the learned places propose, ...
constexpr int kOtherStarts = 24;    // ... and random ones beside them
// What competes is refined once more at the resolution at which it is judged.
constexpr RefineOptions kFineRefine = {.steps = 6, .first_gate = 0.02, .last_gate = 0.008};
// Where a learned judge decides, only what is hopeless is not shown to it.
constexpr int kKeptForJudge = 6;
constexpr double kSameShare = 0.15;  // of the log ratio

/// The best of each group of candidates that are one, best first: turns that look alike have one box about them.
void keep_distinct(const SearchTarget& target, std::size_t most, std::vector<PoseCandidate>& candidates) {
  std::vector<PoseCandidate> kept;
  std::vector<geometry::Box> boxes;
  for (const PoseCandidate& candidate : candidates) {
    if (kept.size() >= most) break;
    const geometry::Box box = box_about(target, candidate.X_CO);
    bool known = false;
    for (std::size_t i = 0; i < kept.size() && !known; ++i)
      known = is_same_place(target, kept[i].X_CO, candidate.X_CO, boxes[i], box) &&
              std::abs(kept[i].evidence.log_ratio - candidate.evidence.log_ratio) <
                  kSameShare * std::abs(kept[i].evidence.log_ratio);
    if (known) continue;
    kept.push_back(candidate);
    boxes.push_back(box);
  }
  candidates = std::move(kept);
}

/// What a cluster and model are tried from: places that look like learned ones of the model, if there are any, and
/// random poses.
std::vector<Pose> starts_in(const Cluster& cluster, const SampledDepth& sampled, const SearchTarget& target,
                            const Vector3d& up_C, const DetectionOptions& options, const core::RandomStream& stream) {
  if (target.learned == nullptr) return cluster_starts(cluster, target, up_C, kStandingStarts, options.starts, stream);
  std::vector<Pose> starts = learned_starts(*target.learned, sampled.depth, sampled.camera, cluster.points_C, up_C,
                                            kLearnedStarts, stream.for_purpose(core::Purpose::kSurface));
  const std::vector<Pose> others = cluster_starts(cluster, target, up_C, kStandingStarts, kOtherStarts, stream);
  starts.insert(starts.end(), others.begin(), others.end());
  return starts;
}

/// Poses that were found from several clusters count once.
void drop_repeated(std::span<const WantedModel> wanted, std::vector<Proposal>& proposals) {
  std::stable_sort(proposals.begin(), proposals.end(), [](const Proposal& a, const Proposal& b) {
    return a.candidate.evidence.log_ratio > b.candidate.evidence.log_ratio;
  });
  std::vector<Proposal> kept;
  std::vector<geometry::Box> boxes;
  for (const Proposal& p : proposals) {
    const SearchTarget& target = wanted[static_cast<std::size_t>(p.model)].target;
    const geometry::Box box = box_about(target, p.candidate.X_CO);
    bool known = false;
    for (std::size_t i = 0; i < kept.size() && !known; ++i)
      known = kept[i].model == p.model &&
              is_same_place(target, kept[i].candidate.X_CO, p.candidate.X_CO, boxes[i], box) &&
              p.candidate.evidence.log_ratio > (1.0 - kSameShare) * kept[i].candidate.evidence.log_ratio;
    if (known) continue;
    kept.push_back(p);
    boxes.push_back(box);
  }
  proposals = std::move(kept);
}

/// The best poses of each wanted model in each cluster from `first` on, ordered by cluster, model, rank: looked for in
/// `terms`, then refined and weighed in `fine`.
std::vector<Proposal> propose(const rendering::FrameTerms& terms, const rendering::FrameTerms& fine,
                              const Weighing& weighing, const SampledDepth& sampled,
                              const std::vector<Cluster>& clusters, std::size_t first, const Surroundings& surroundings,
                              std::span<const WantedModel> wanted, std::span<const int> left,
                              const ProposalJudge& judge, const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, std::uint64_t round) {
  struct Task {
    int cluster;
    int model;
    std::vector<PoseCandidate> found;
  };
  const Vector3d up_C = surroundings.X_WC.rotation.conjugate() * surroundings.up_W;
  std::vector<Task> tasks;
  for (std::size_t cluster = first; cluster < clusters.size(); ++cluster)
    for (std::size_t model = 0; model < wanted.size(); ++model)
      if (left[model] > 0) tasks.push_back({static_cast<int>(cluster), static_cast<int>(model), {}});
  tools.search->threads().for_each_index(tasks.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    Task& task = tasks[i];
    const SearchTarget& target = wanted[static_cast<std::size_t>(task.model)].target;
    core::RandomStream draws = stream;
    const core::RandomStream mine(draws.next_u64(), core::Purpose::kDetection, round, static_cast<std::uint32_t>(i));
    const std::vector<Pose> starts =
        starts_in(clusters[static_cast<std::size_t>(task.cluster)], sampled, target, up_C, options, mine);
    task.found = tools.search->run_serial(terms, target, starts, options.search, mine, *workspace);
    std::erase_if(task.found, [&](const PoseCandidate& c) {
      return surroundings.solid.overlap(*target.mesh, surroundings.X_WC * c.X_CO, kMostSinking) > 0.0;
    });
    if (!judge.decides()) std::erase_if(task.found, [](const PoseCandidate& c) { return hopeless(c.evidence); });
    keep_distinct(target, judge.decides() ? kKeptForJudge : kKept, task.found);
    if (judge.decides()) return;
    for (PoseCandidate& candidate : task.found) {
      tools.search->refine(fine, target, kFineRefine, *workspace, std::span(&candidate.X_CO, 1));
      candidate.evidence = weighing.of(fine, target, candidate.X_CO, *workspace);
    }
  });
  std::vector<Proposal> proposals;
  for (const Task& task : tasks)
    for (const PoseCandidate& candidate : task.found) {
      if (judge.decides() ? hopeless(candidate.evidence) : !acceptable(candidate.evidence, 0.0, options)) continue;
      Proposal proposal;
      proposal.model = task.model;
      proposal.candidate = candidate;
      proposal.cluster = task.cluster;
      proposals.push_back(proposal);
    }
  if (!judge.decides()) drop_repeated(wanted, proposals);
  return proposals;
}

/// Whether most of a cluster's pixels are those of one that was looked at before, and the other way round.
bool is_looked_at(const Cluster& cluster, std::span<const Cluster> looked_at) {
  return std::any_of(looked_at.begin(), looked_at.end(), [&](const Cluster& other) {
    std::vector<int> common;
    std::set_intersection(cluster.pixels.begin(), cluster.pixels.end(), other.pixels.begin(), other.pixels.end(),
                          std::back_inserter(common));
    return static_cast<double>(common.size()) >
           kSameCluster * static_cast<double>(std::max(cluster.pixels.size(), other.pixels.size()));
  });
}

}  // namespace

std::vector<Detection> detect(const rendering::FrameTerms& terms, const geometry::DepthImage& known,
                              const SampledDepth& sampled, const Surroundings& surroundings,
                              std::span<const WantedModel> wanted, const DetectionOptions& options,
                              const FilterTools& tools, const core::RandomStream& stream, DetectionTrace* trace) {
  return detect(terms, terms, known, sampled, surroundings, wanted, options, tools, stream, trace);
}

std::vector<Detection> detect(const rendering::FrameTerms& frame_terms, const rendering::FrameTerms& fine_terms,
                              const geometry::DepthImage& known, const SampledDepth& sampled,
                              const Surroundings& surroundings, std::span<const WantedModel> wanted,
                              const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, DetectionTrace* trace) {
  const rendering::FrameTerms terms = with_background(frame_terms, sampled, surroundings);
  const ProposalJudge judge(wanted, surroundings.X_WC.rotation.conjugate() * surroundings.up_W, options, tools, trace);
  // What a learned judge knows of fits is of the coarse image.
  const rendering::FrameTerms fine = judge.decides() ? terms : with_background(fine_terms, sampled, surroundings);
  const Weighing weighing(terms, fine, tools);
  std::vector<int> left;
  for (const WantedModel& model : wanted) left.push_back(model.count);
  rendering::FrameTerms explained_terms = terms, explained_fine = fine;
  const geometry::DepthImage nothing(fine.camera.width, fine.camera.height);
  geometry::DepthImage explained_depth = nothing;
  std::vector<Detection> found;
  std::vector<Cluster> looked_at;
  std::vector<Proposal> pool;
  const int rounds = judge.decides() ? kLearnedRounds : kRounds;
  for (int round = 0; round < rounds; ++round) {
    auto mask = explained_pixels(sampled, explained_depth, fine.camera, kExplainedDepth);
    const auto known_mask = explained_pixels(sampled, known, terms.camera, kExplainedDepth);
    for (std::size_t i = 0; i < mask.size(); ++i)
      mask.data()[i] |= surroundings.background.data()[i] | known_mask.data()[i];
    // What is over the main support first, then over others; of the rest only some.
    std::vector<Cluster> clusters;
    for (const int where : {kMainSupport, kOtherSupport, kNoSupport}) {
      auto rest = mask;
      for (std::size_t i = 0; i < mask.size(); ++i)
        if (surroundings.over_support.data()[i] != where) rest.data()[i] = 1;
      std::vector<Cluster> more = find_clusters(sampled, rest, options.segmentation);
      if (where == kNoSupport && static_cast<int>(more.size()) > kFloatingClusters) more.resize(kFloatingClusters);
      std::move(more.begin(), more.end(), std::back_inserter(clusters));
    }
    if (static_cast<int>(clusters.size()) > options.max_clusters)
      clusters.resize(static_cast<std::size_t>(options.max_clusters));
    const std::size_t first = looked_at.size();
    if (!judge.decides()) std::erase_if(clusters, [&](const Cluster& c) { return is_looked_at(c, looked_at); });
    std::move(clusters.begin(), clusters.end(), std::back_inserter(looked_at));
    std::vector<Proposal> proposals =
        propose(explained_terms, explained_fine, weighing, sampled, looked_at, first, surroundings, wanted, left, judge,
                options, tools, stream, static_cast<std::uint64_t>(round));
    if (judge.decides()) pool.clear();
    std::move(proposals.begin(), proposals.end(), std::back_inserter(pool));
    if (pool.empty()) continue;
    proposals = pool;
    reweigh(explained_fine, wanted, weighing, left, tools, proposals);
    accept_greedily(std::move(proposals), looked_at, surroundings, wanted, judge, weighing, options, tools,
                    explained_fine, explained_depth, left, found);
    settle(fine, wanted, weighing, options, tools, stream, found);
    const std::vector<double> log_odds = believe(fine, looked_at, wanted, judge, tools, found);
    const bool is_strict = judge.decides() || round % 2 == 1;
    const std::vector<Detection> taken =
        take_back(surroundings, wanted, judge, options, is_strict ? kAtTheEnd : kForNow, log_odds, left, found);
    // It would be accepted again, in place of what is right.
    if (is_strict)
      std::erase_if(pool, [&](const Proposal& p) {
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
  const std::vector<double> log_odds = believe(fine, looked_at, wanted, judge, tools, found);
  if (trace != nullptr)
    for (std::size_t i = 0; i < found.size(); ++i)
      trace->finds.push_back({found[i].model, found[i].X_CO, found[i].numbers, found[i].log_odds, log_odds[i]});
  if (judge.decides() && trace == nullptr)
    std::erase_if(found, [&](const Detection& d) { return d.probability < options.least_probability; });
  return found;
}

}  // namespace prescene::filter
