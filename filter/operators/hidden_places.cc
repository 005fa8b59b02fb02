// SPDX-License-Identifier: Apache-2.0
#include "hidden_places.h"

#include <algorithm>

namespace prescene::filter {
namespace {

constexpr double kHiddenShift = 0.06;    // m; when it was just lost from sight ...
constexpr double kHiddenSpeed = 0.3;     // m/s; ... and how fast it grows, ...
constexpr double kHiddenFurthest = 0.3;  // m; ... up to this. Chosen

}  // namespace

double hidden_shift(double seconds) { return std::min(kHiddenFurthest, kHiddenShift + kHiddenSpeed * seconds); }

std::vector<Pose> hidden_places(const FilterFrame& frame, const rendering::FrameTerms& terms,
                                const SearchTarget& target, const Pose& X_WO, const HiddenReach& reach, int draws,
                                const WeightOptions& weighting, const FilterTools& tools, core::RandomStream stream) {
  const Vector3d p_WQ = X_WO * target.centre();
  std::vector<Pose> free;
  std::vector<rendering::PoseHypothesis> hypotheses;
  for (int i = 0; i < draws; ++i) {
    Vector6d d;
    for (int k = 0; k < 6; ++k) d[k] = stream.normal() * (k < 3 ? reach.turn : reach.shift);
    if (!reach.fall.isZero(0.0)) d.tail<3>() += stream.uniform() * reach.fall;
    const Pose moved = moved_about(X_WO, target.centre(), d);
    if (frame.solids.crosses(p_WQ, moved * target.centre())) continue;
    if (frame.solids.overlap(*target.mesh, moved, weighting.support_tolerance) > 0.0) continue;
    free.push_back(moved);
    hypotheses.push_back(hypothesis(target, frame.X_CW * moved));
  }
  std::vector<rendering::PoseEvidence> evidence(hypotheses.size());
  {
    const rendering::WorkspacePool::Loan workspace(tools.search->workspaces());
    tools.search->batch().evaluate(terms, hypotheses, *workspace, evidence);
  }
  std::vector<Pose> hidden;
  for (std::size_t i = 0; i < free.size(); ++i)
    if (evidence[i].measured > 0 && evidence[i].visible_share() < weighting.hidden_share) hidden.push_back(free[i]);
  return hidden;
}

}  // namespace prescene::filter
