// SPDX-License-Identifier: Apache-2.0
// Which of the proposed poses are accepted: the best first, given those that were accepted before.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "prescene/filter/proposals/detection.h"
#include "proposal_judge.h"

namespace prescene::filter {

/// m that a pose may reach into a support: planes and meshes are off by 15 mm.
inline constexpr double kMostSinking = 0.03;

/// Whether two poses of a target show the same shape at the same place: corners of the one are near corners of the
/// other, and the boxes along C's axes about them (box_about) are the same.
bool is_same_place(const SearchTarget& target, const Pose& a_CO, const Pose& b_CO, const geometry::Box& a_box,
                   const geometry::Box& b_box);
/// The box along C's axes about an object at X_CO.
geometry::Box box_about(const SearchTarget& target, const Pose& X_CO);
/// What need not be judged.
bool hopeless(const rendering::PoseEvidence& e);

/// Evidence of poses in the image in which they are judged. Its log ratio is given as it would be in the coarse image,
/// where the thresholds were chosen: neighbouring pixels of the fine one share their errors.
class Weighing {
 public:
  Weighing(const rendering::FrameTerms& coarse, const rendering::FrameTerms& fine, const FilterTools& tools)
      : share_(std::pow(coarse.camera.fx / fine.camera.fx, 2.0)), batch_(&tools.search->batch()) {}

  rendering::PoseEvidence of(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CO,
                             rendering::LikelihoodWorkspace& workspace) const {
    const rendering::PoseHypothesis h = hypothesis(target, X_CO);
    rendering::PoseEvidence evidence;
    batch_->evaluate(terms, std::span(&h, 1), workspace, std::span(&evidence, 1));
    evidence.log_ratio *= share_;
    return evidence;
  }

 private:
  double share_;
  const rendering::LikelihoodBatch* batch_;
};

std::vector<geometry::DepthImage> depths_of(std::span<const Detection> found, std::span<const WantedModel> wanted,
                                            const geometry::PinholeCamera& camera, const FilterTools& tools);
/// Gives the proposals of models that are left the evidence that they have in `terms`, and drops the others.
void reweigh(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
             std::span<const int> left, const FilterTools& tools, std::vector<Proposal>& proposals);
/// Accepts the strongest proposal, puts it into the frame, judges the others again, until none is acceptable.
void accept_greedily(std::vector<Proposal> proposals, const std::vector<Cluster>& clusters,
                     const Surroundings& surroundings, std::span<const WantedModel> wanted, const ProposalJudge& judge,
                     const Weighing& weighing, const DetectionOptions& options, const FilterTools& tools,
                     rendering::FrameTerms& terms, geometry::DepthImage& known, std::vector<int>& left,
                     std::vector<Detection>& found);
/// Each accepted object once more, given the others where they are now.
void settle(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
            const DetectionOptions& options, const FilterTools& tools, const core::RandomStream& stream,
            std::vector<Detection>& found);
/// Gives each find the probability that it is right; returns the judge's log odds of each with all others known.
std::vector<double> believe(const rendering::FrameTerms& terms, const std::vector<Cluster>& clusters,
                            std::span<const WantedModel> wanted, const ProposalJudge& judge, const FilterTools& tools,
                            std::vector<Detection>& found);
/// Where no learned judge decides.
struct LeastOfFind {
  double outline = 0.0;      ///< outline_support
  double probability = 0.0;  ///< Of being right.
};
/// Takes back what is no longer acceptable now that the others are where they are, and returns it.
std::vector<Detection> take_back(const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                 const ProposalJudge& judge, const DetectionOptions& options, const LeastOfFind& least,
                                 std::span<const double> log_odds, std::vector<int>& left,
                                 std::vector<Detection>& found);

}  // namespace prescene::filter
