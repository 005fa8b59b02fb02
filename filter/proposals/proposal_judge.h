// SPDX-License-Identifier: Apache-2.0
// Poses that were proposed for a model in a cluster, and who decides which of them are right.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/fit_judgement.h"

namespace prescene::filter {

/// Share of a pose's outline at which the measured surface ends (outline_support).
inline constexpr double kLeastOutline = 0.7;

/// Nats; a candidate with lower log odds is not accepted where a learned judge decides. Chosen.
inline constexpr double kLeastLogOdds = -0.8;

struct Proposal {
  int model = 0;
  PoseCandidate candidate{};
  int cluster = 0;    ///< Of those that were looked at.
  double cost = 0.0;  ///< nats
  bool stands = false;
  FitNumbers numbers{};  ///< Of `judged` ...
  bool is_judged = false;
  rendering::PoseEvidence judged{};
  bool judged_standing = false;
  double log_odds = 0.0;  ///< ... and what the judge says of them.

  /// A wrong model that explains much of a large thing badly must not go before a right one that explains little well.
  double score() const;
  /// What stands on nothing known costs.
  void weigh(bool on_something);
};

/// Tells a fit who its rivals are among what was proposed, of either kind of proposal: other models in its cluster, and
/// its own model elsewhere.
template <class Proposed>
void set_rivals_among(std::span<const Proposed> proposals, int model, int cluster, Fit& fit) {
  const Vector3d centre = fit.X_CO * fit.target->centre();
  const double apart = 0.5 * static_cast<double>(fit.target->mesh->radius);
  for (const Proposed& other : proposals) {
    const double log_ratio = other.candidate.evidence.log_ratio;
    if (other.model != model) {
      if (other.cluster == cluster) fit.rival_models = std::max(fit.rival_models, log_ratio);
    } else if ((other.candidate.X_CO * fit.target->centre() - centre).norm() > apart) {
      fit.rival_poses = std::max(fit.rival_poses, log_ratio);
    }
  }
}

/// By the thresholds.
bool acceptable(const rendering::PoseEvidence& evidence, double cost, const DetectionOptions& options);

/// Who decides about candidates where something was learned of all that is looked for. What is given must outlive it.
class ProposalJudge {
 public:
  ProposalJudge(std::span<const WantedModel> wanted, const Vector3d& up_C, const DetectionOptions& options,
                const FilterTools& tools, DetectionTrace* trace);

  /// Whether it decides; else the thresholds of DetectionOptions do.
  bool decides() const { return all_learned_ && (!tools_.learned->fit.empty() || trace_ != nullptr); }
  /// While nothing was learned of fits, the thresholds decide whose numbers are recorded as a find's.
  double log_odds(const Proposal& proposal) const;
  /// Whether a find is still worth what a candidate must be.
  bool believes(double log_odds_at_end) const {
    return tools_.learned->fit.empty() || log_odds_at_end >= kLeastLogOdds;
  }
  /// That a find is right which had these log odds when it was accepted and has those at the end.
  double probability(double accepted, double at_end) const;

  /// Judges those of which something has changed.
  void judge(const rendering::FrameTerms& terms, const std::vector<Cluster>& clusters,
             std::vector<Proposal>& proposals) const;
  /// Of a find as it is at the end.
  FitNumbers numbers_of(const rendering::FrameTerms& terms, const Cluster& cluster, const Detection& found) const;

 private:
  Fit fit_of(int model, const Pose& X_CO, const rendering::PoseEvidence& evidence, const Cluster& cluster,
             bool stands) const;

  std::span<const WantedModel> wanted_;
  Vector3d up_C_;
  const DetectionOptions& options_;
  const FilterTools& tools_;
  DetectionTrace* trace_;
  bool all_learned_ = false;
};

}  // namespace prescene::filter
