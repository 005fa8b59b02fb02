// SPDX-License-Identifier: Apache-2.0
// Where else an object may be: the places and turns that the belief holds possible beside its estimate.
#pragma once

#include <cstddef>
#include <vector>

#include "prescene/belief/belief.h"

namespace prescene::belief {

inline constexpr std::size_t kMostAlternatives = 4;

/// Particles that are alike: within 5 cm and, up to symmetry, 30 degrees of the heaviest of them. Those about
/// ObjectEstimate::mean are none.
struct AlternativePose {
  Pose X_WO;                 ///< Their weighted mean.
  double probability = 0.0;  ///< That the object exists and is about there, [0, 1].
  friend bool operator==(const AlternativePose&, const AlternativePose&) = default;
};

/// The likeliest first, kMostAlternatives at most, none of less than 1 %; of a lost object none. At least one particle
/// (checked). `symmetry`: of the object's model.
std::vector<AlternativePose> alternative_poses(const ObjectBelief& object, const geometry::SymmetryGroup& symmetry);
/// The same with the symmetry of the model that the belief's scene gives it.
std::vector<AlternativePose> alternative_poses(const Belief& belief, const ObjectBelief& object);

}  // namespace prescene::belief
