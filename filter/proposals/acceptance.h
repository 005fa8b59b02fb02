// SPDX-License-Identifier: Apache-2.0
// Which of the poses that are judged in the fine image are accepted: the best first, given those that were accepted
// before.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/fine_frame.h"

namespace prescene::filter {

/// A pose that was proposed for a model in a cluster, as the fine image shows it.
struct FineProposal {
  int model = 0;
  PoseCandidate candidate{};
  int cluster = 0;    ///< Of those that were looked at.
  double cost = 0.0;  ///< nats; what stands on nothing known costs.
  bool stands = false;
  double outline = -1.0;     ///< outline_support; negative: this and `probability` are not known as things are now.
  double probability = 0.0;  ///< probability_of_fit, with as many rivals as usual.

  /// nats. A wrong model that explains much of a large thing badly must not go before a right one that explains little
  /// well. While the probability is not known, what it is at most.
  double score() const;
  void weigh(bool on_something);
};

/// By the thresholds. They are lower than those of the coarse image (proposal_judge.h), as the outline tells much.
bool acceptable_in_fine(const rendering::PoseEvidence& evidence, double cost, const DetectionOptions& options);

/// Whether two poses of a target show the same shape at the same place: corners of the one are near corners of the
/// other, and the boxes along C's axes about them (box_about) are the same.
bool is_same_place(const SearchTarget& target, const Pose& a_CO, const Pose& b_CO, const geometry::Box& a_box,
                   const geometry::Box& b_box);
/// The box along C's axes about an object at X_CO.
geometry::Box box_about(const SearchTarget& target, const Pose& X_CO);

/// Evidence of poses in the fine image. Its log ratio is given as it would be in the coarse image, where the thresholds
/// were chosen: neighbouring pixels of the fine one share their errors.
class Weighing {
 public:
  Weighing(const rendering::FrameTerms& coarse, const FineFrame& fine, const FilterTools& tools)
      : share_(std::pow(coarse.camera.fx / fine.terms.camera.fx, 2.0)),
        batch_(&tools.search->batch()),
        color_(&fine.color) {}

  /// Colours of the fine image, which outlive this; empty = none.
  const geometry::ColorImage& color() const { return *color_; }

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
  const geometry::ColorImage* color_;
};

/// Gives the proposals of models that are left the evidence that they have in `terms`, and drops the others.
void reweigh(const rendering::FrameTerms& terms, std::span<const WantedModel> wanted, const Weighing& weighing,
             std::span<const int> left, const FilterTools& tools, std::vector<FineProposal>& proposals);
/// Accepts the strongest proposal, puts it into the frame, judges the others again, until none is acceptable.
void accept_in_fine(std::vector<FineProposal> proposals, const Surroundings& surroundings,
                    std::span<const WantedModel> wanted, const Weighing& weighing, const DetectionOptions& options,
                    const FilterTools& tools, rendering::FrameTerms& terms, geometry::DepthImage& known,
                    std::vector<int>& left, std::vector<Detection>& found);
/// Each accepted object once more, given the others where they are now; gives each the probability that it is right,
/// `proposals` being all that was proposed. Thoroughly: other places, beside it and where else its model was proposed,
/// are tried, too, and Detection::margin is found out.
void settle_in_fine(const rendering::FrameTerms& terms, const Vector3d& up_C, std::span<const WantedModel> wanted,
                    const Weighing& weighing, const DetectionOptions& options, const FilterTools& tools,
                    const core::RandomStream& stream, std::span<const FineProposal> proposals, bool is_thorough,
                    std::vector<Detection>& found);
struct LeastOfFind {
  double outline = 0.0;      ///< outline_support
  double probability = 0.0;  ///< Of being right.
};
/// Takes back what is no longer acceptable now that the others are where they are, and returns it.
std::vector<Detection> take_back_in_fine(const Surroundings& surroundings, std::span<const WantedModel> wanted,
                                         const DetectionOptions& options, const LeastOfFind& least,
                                         std::vector<int>& left, std::vector<Detection>& found);

}  // namespace prescene::filter
