// SPDX-License-Identifier: Apache-2.0
// Poses that differ from one another by how the object is turned, and what a frame says of them.
#pragma once

#include <span>
#include <vector>

#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {

inline constexpr double kFewestRivalPixels = 12;  // the tempering's pixel count is at least this, as in weight()
inline constexpr RefineOptions kRivalRefine = {.steps = 5, .first_gate = 0.03, .last_gate = 0.012};

/// Whether the poses are turned against each other by kRivalTurn or more, up to symmetry.
bool is_apart(const Pose& a_WO, const Pose& b_WO, const geometry::SymmetryGroup& symmetry);

/// X_WO turned about the target's middle and moved along the view until it reaches as far to the camera as before, X_WO
/// itself first. find_rivals() says which turns.
std::vector<Pose> turned_poses(const Pose& X_WO, const SearchTarget& target, const geometry::SymmetryGroup& symmetry,
                               const FilterFrame& frame);

/// Adds poses up to `most`, best evidence first, each apart from all before it.
void add_apart(std::span<const Pose> X_WO, std::span<const rendering::PoseEvidence> evidence,
               const geometry::SymmetryGroup& symmetry, std::size_t most, std::vector<Pose>& chosen);

/// What one image says of poses of a target, on all threads of the tools. All that is given outlives it.
class RivalSearch {
 public:
  RivalSearch(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
              const WeightOptions& weighting, const FilterTools& tools);

  std::vector<rendering::PoseEvidence> evaluate(std::span<const Pose> X_WO);
  void refine(const RefineOptions& options, std::span<Pose> X_WO);
  /// As weight() counts it, before tempering: evidence in favour is worth less where nothing ends at the outline.
  double worth(const rendering::PoseEvidence& evidence, const Pose& X_WO);
  /// Of what the image says about a pose, `pixels` of which tell it, and what `spread` says of any; as
  /// geometry::box_plus.
  geometry::Matrix6d covariance_at(const Pose& X_WO, double pixels, const InitialiseOptions& spread);

 private:
  const FilterFrame& frame_;
  const rendering::FrameTerms& terms_;
  const SearchTarget& target_;
  const WeightOptions& weighting_;
  const FilterTools& tools_;
  std::size_t in_block_;
};

}  // namespace prescene::filter
