// SPDX-License-Identifier: Apache-2.0
// Parts that the search in the coarse image (detection.cc) and the one whose finds are judged in the fine image
// (fine_detection.cc) have in common.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "prescene/filter/proposals/detection.h"

namespace prescene::filter {

inline constexpr double kOutlineStep = 0.02;  // m; the measured surface ends by at least so much (kLeastOutline)
inline constexpr double kMostSinking = 0.03;  // m that a pose may reach into a support: planes and meshes are 15 mm off
inline constexpr double kMostOverlap = 0.1;   // share of an object that others may cut off (SupportSurfaces::overlap)
// m; a measurement so little in front of a known surface, or up to twice as much behind it, is explained.
inline constexpr double kExplainedDepth = 0.015;
// Joint refinement of what is accepted.
inline constexpr RefineOptions kSettling = {.steps = 8, .first_gate = 0.02, .last_gate = 0.008};

/// What need not be judged.
bool hopeless(const rendering::PoseEvidence& e);
/// Whether an object at X_WO has a surface right under its lowest points, or reaches a little below one. It is looked
/// for at these `shares` of the way from the middle of its lowest points to each of them.
bool stands(const SearchTarget& target, const Pose& X_WO, const Vector3d& up_W,
            std::span<const SupportSurfaces* const> surfaces, std::span<const double> shares);
/// What a cluster and model are tried from: places that look like learned ones of the model, if there are any, and
/// random poses, of a model that was not learned `random` of them.
std::vector<Pose> starts_in(const Cluster& cluster, const SampledDepth& sampled, const SearchTarget& target,
                            const Vector3d& up_C, int random, const core::RandomStream& stream);
/// The poses that a wanted model was found at in a cluster.
struct SearchedModel {
  int cluster = 0;
  int model = 0;
  std::vector<PoseCandidate> found;
};
/// Keeps of a model's poses, best first, what is worth judging; called in the thread that found them.
using KeepCandidates =
    std::function<void(const SearchTarget&, rendering::LikelihoodWorkspace&, std::vector<PoseCandidate>&)>;
/// What a cluster and a model (their numbers) are tried from; called in the thread that tries them.
using StartsIn = std::function<std::vector<Pose>(const SearchedModel&, const core::RandomStream&)>;
/// Looks in each of so many clusters from `first` on for each model of which some are `left`, ordered by cluster and
/// model. Poses that reach into a support are left out before `keep` is asked.
std::vector<SearchedModel> search_clusters(const rendering::FrameTerms& terms, std::size_t clusters, std::size_t first,
                                           const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                           std::span<const int> left, const DetectionOptions& options,
                                           const FilterTools& tools, const core::RandomStream& stream,
                                           std::uint64_t round, const StartsIn& starts, const KeepCandidates& keep);
/// The things that were found, as surfaces.
SupportSurfaces surfaces_of(std::span<const Detection> found, std::span<const WantedModel> wanted, const Pose& X_WC);
std::vector<geometry::DepthImage> depths_of(std::span<const Detection> found, std::span<const WantedModel> wanted,
                                            const geometry::PinholeCamera& camera, const FilterTools& tools);
/// Looks, the newest find first, whether each stands on something now that the others are where they are, and takes it
/// back unless `stays(index, cost)` holds; `cost` is that of a proposal of the kind Proposed which stands so. Returns
/// what was taken back.
template <class Proposed, class Stays>
std::vector<Detection> take_back_unless(const Stays& stays, std::span<const double> shares,
                                        const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                        std::vector<int>& left, std::vector<Detection>& found) {
  std::vector<Detection> taken;
  for (std::size_t i = found.size(); i-- > 0;) {
    std::vector<Detection> others = found;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const SupportSurfaces things = surfaces_of(others, wanted, surroundings.X_WC);
    const std::array<const SupportSurfaces*, 3> ground = {&surroundings.solid, &surroundings.steps, &things};
    Detection& detection = found[i];
    const auto model = static_cast<std::size_t>(detection.model);
    const Pose X_WO = surroundings.X_WC * detection.X_CO;
    detection.stands = filter::stands(wanted[model].target, X_WO, surroundings.up_W, ground, shares);
    Proposed proposal;
    proposal.model = detection.model;
    proposal.candidate = {detection.X_CO, detection.evidence};
    proposal.weigh(detection.stands);
    if (stays(i, proposal.cost)) continue;
    ++left[model];
    taken.push_back(detection);
    found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return taken;
}
/// What is over the main support first, then over others; of the rest only some.
std::vector<Cluster> clusters_over_supports(const SampledDepth& sampled, const geometry::Image<std::uint8_t>& explained,
                                            const Surroundings& surroundings, const DetectionOptions& options);

}  // namespace prescene::filter
