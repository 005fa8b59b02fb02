// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/detection.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

constexpr int kKept = 3;    // best poses of a cluster and model that compete
constexpr int kRounds = 2;  // the second looks at what the first left unexplained
// m below the support's plane that a pose may reach: planes and meshes are off by 15 mm.
constexpr double kMostSinking = 0.03;
// m; a measurement so little in front of a known surface, or up to twice as much behind it, is explained.
constexpr double kExplainedDepth = 0.015;
// Joint refinement of what is accepted.
constexpr RefineOptions kSettling = {.steps = 8, .first_gate = 0.02, .last_gate = 0.008};

struct Proposal {
  int model = 0;
  PoseCandidate candidate;
};

bool acceptable(const rendering::PoseEvidence& evidence, const DetectionOptions& options) {
  return evidence.log_ratio > options.min_log_ratio && evidence.hit_share() >= options.min_hit_share;
}

/// Whether an object at this pose can stand on the support: over it, and not sunk into it.
bool possible(const SearchTarget& target, const Pose& X_CO, const rendering::SupportRegion& support) {
  if (!stands_on(support, X_CO * target.centre())) return false;
  return std::all_of(target.mesh->vertices.begin(), target.mesh->vertices.end(), [&](const auto& vertex) {
    return support.plane_C.signed_distance(X_CO * vertex.template cast<double>()) > -kMostSinking;
  });
}

/// The best poses of each wanted model in each cluster, ordered by cluster, model, rank.
std::vector<Proposal> propose(const rendering::FrameTerms& terms, std::span<const Cluster> clusters,
                              const rendering::SupportRegion& support, std::span<const WantedModel> wanted,
                              std::span<const int> left, const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, std::uint64_t round) {
  struct Task {
    const Cluster* cluster;
    int model;
    std::vector<PoseCandidate> found;
  };
  std::vector<Task> tasks;
  for (const Cluster& cluster : clusters)
    for (std::size_t model = 0; model < wanted.size(); ++model)
      if (left[model] > 0) tasks.push_back({&cluster, static_cast<int>(model), {}});
  tools.search->threads().for_each_index(tasks.size(), [&](std::size_t i) {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    Task& task = tasks[i];
    const SearchTarget& target = wanted[static_cast<std::size_t>(task.model)].target;
    core::RandomStream draws = stream;
    const core::RandomStream mine(draws.next_u64(), core::Purpose::kDetection, round, static_cast<std::uint32_t>(i));
    const std::vector<Pose> starts = cluster_starts(*task.cluster, target, options.starts, mine);
    task.found = tools.search->run_serial(terms, target, starts, options.search, mine, *workspace);
    std::erase_if(task.found, [&](const PoseCandidate& c) { return !possible(target, c.X_CO, support); });
    task.found.resize(std::min(task.found.size(), static_cast<std::size_t>(kKept)));
  });
  std::vector<Proposal> proposals;
  for (const Task& task : tasks)
    for (const PoseCandidate& candidate : task.found)
      if (acceptable(candidate.evidence, options)) proposals.push_back({task.model, candidate});
  return proposals;
}

std::vector<geometry::DepthImage> depths_of(std::span<const Detection> found, std::span<const WantedModel> wanted,
                                            const geometry::PinholeCamera& camera, const FilterTools& tools) {
  std::vector<geometry::DepthImage> depths;
  for (const Detection& detection : found)
    depths.push_back(
        depth_of(wanted[static_cast<std::size_t>(detection.model)].target, detection.X_CO, camera, *tools.renderer));
  return depths;
}

/// Accepts the strongest proposal, puts it into the frame, judges the others again, until none is acceptable.
void accept_greedily(std::vector<Proposal> proposals, std::span<const WantedModel> wanted,
                     const DetectionOptions& options, const FilterTools& tools, rendering::FrameTerms& terms,
                     geometry::DepthImage& known, std::vector<int>& left, std::vector<Detection>& found) {
  while (!proposals.empty()) {
    const auto best = std::max_element(proposals.begin(), proposals.end(), [](const auto& a, const auto& b) {
      return a.candidate.evidence.log_ratio < b.candidate.evidence.log_ratio;
    });
    const auto model = static_cast<std::size_t>(best->model);
    found.push_back({best->model, best->candidate.X_CO, best->candidate.evidence});
    --left[model];
    const geometry::DepthImage depth = depth_of(wanted[model].target, found.back().X_CO, terms.camera, *tools.renderer);
    merge_nearest(depth, &known);
    with_known_surfaces(terms, depth, &terms);
    std::erase_if(proposals, [&](const Proposal& p) { return left[static_cast<std::size_t>(p.model)] == 0; });
    tools.search->threads().for_each_index(proposals.size(), [&](std::size_t i) {
      const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
      Proposal& p = proposals[i];
      const auto h = hypothesis(wanted[static_cast<std::size_t>(p.model)].target, p.candidate.X_CO);
      tools.search->batch().evaluate(terms, std::span(&h, 1), *workspace, std::span(&p.candidate.evidence, 1));
    });
    std::erase_if(proposals, [&](const Proposal& p) { return !acceptable(p.candidate.evidence, options); });
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
  }
}

}  // namespace

std::vector<Pose> cluster_starts(const Cluster& cluster, const SearchTarget& target, int count,
                                 const core::RandomStream& stream) {
  core::RandomStream draws = stream;
  std::vector<Pose> starts;
  for (int i = 0; i < count; ++i) {
    const Vector3d& seen = cluster.points_C[draws.uniform_below(cluster.points_C.size())];
    // The centre lies behind the seen surface by up to the radius.
    const Vector3d centre =
        seen + draws.uniform(0.0, 0.6) * static_cast<double>(target.mesh->radius) * seen.normalized();
    Pose X_CO;
    X_CO.rotation = geometry::uniform_rotation(draws);
    X_CO.translation = centre - X_CO.rotation * target.centre();
    starts.push_back(X_CO);
  }
  return starts;
}

geometry::Image<std::uint8_t> explained_pixels(const SampledDepth& sampled, const geometry::DepthImage& known,
                                               const geometry::PinholeCamera& camera, double tolerance) {
  geometry::Image<std::uint8_t> explained(sampled.camera.width, sampled.camera.height);
  if (known.empty()) return explained;
  for (int y = 0; y < explained.height(); ++y)
    for (int x = 0; x < explained.width(); ++x) {
      const double z = sampled.depth(x, y);
      if (z == 0.0) continue;
      const Eigen::Vector2d pixel =
          camera.project(sampled.points_C[static_cast<std::size_t>(y * explained.width() + x)]);
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      // The neighbours' surfaces count too: outlines are no sharper than a reduced pixel.
      for (int dv = -1; dv <= 1; ++dv)
        for (int du = -1; du <= 1; ++du) {
          if (u + du < 0 || v + dv < 0 || u + du >= known.width() || v + dv >= known.height()) continue;
          const float surface = known(u + du, v + dv);
          if (surface > 0.0f && z > surface - tolerance && z < surface + 2.0 * tolerance) explained(x, y) = 1;
        }
    }
  return explained;
}

std::vector<Detection> detect(const rendering::FrameTerms& terms, const geometry::DepthImage& known,
                              const SampledDepth& sampled, const rendering::SupportRegion& support,
                              std::span<const WantedModel> wanted, const DetectionOptions& options,
                              const FilterTools& tools, const core::RandomStream& stream) {
  std::vector<int> left;
  for (const WantedModel& model : wanted) left.push_back(model.count);
  rendering::FrameTerms explained_terms = terms;
  geometry::DepthImage explained_depth =
      known.empty() ? geometry::DepthImage(terms.camera.width, terms.camera.height) : known;
  std::vector<Detection> found;
  for (int round = 0; round < kRounds; ++round) {
    const auto mask = explained_pixels(sampled, explained_depth, terms.camera, kExplainedDepth);
    std::vector<Cluster> clusters = find_clusters(sampled, support, mask, options.segmentation);
    if (static_cast<int>(clusters.size()) > options.max_clusters)
      clusters.resize(static_cast<std::size_t>(options.max_clusters));
    std::vector<Proposal> proposals = propose(explained_terms, clusters, support, wanted, left, options, tools, stream,
                                              static_cast<std::uint64_t>(round));
    if (proposals.empty()) continue;
    accept_greedily(std::move(proposals), wanted, options, tools, explained_terms, explained_depth, left, found);
    settle(terms, wanted, options, tools, stream, found);
    explained_terms = terms;
    explained_depth = known.empty() ? geometry::DepthImage(terms.camera.width, terms.camera.height) : known;
    for (const geometry::DepthImage& depth : depths_of(found, wanted, terms.camera, tools)) {
      merge_nearest(depth, &explained_depth);
      with_known_surfaces(explained_terms, depth, &explained_terms);
    }
  }
  return found;
}

}  // namespace prescene::filter
