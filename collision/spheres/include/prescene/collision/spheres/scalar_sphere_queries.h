// SPDX-License-Identifier: Apache-2.0
// The queries of sphere_queries.h in plain C++, one child at a time: what the vector code is tested and measured
// against, and what trees of different branching are met with.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "prescene/collision/spheres/sphere_queries.h"

namespace prescene::collision::scalar {

bool overlap(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch);
std::optional<SphereDistance> distance(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                                       SphereScratch& scratch, double below = std::numeric_limits<double>::infinity(),
                                       std::optional<SpherePair> seed = std::nullopt);
SphereOverlap overlap_volume(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch);
bool contacts(const SphereTree& a, const SphereTree& b, const Transform& X_AB, std::size_t limit,
              std::vector<SphereContact>* contacts, SphereScratch& scratch);
void near_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB, double range,
                std::vector<SpherePair>* pairs, SphereScratch& scratch);
PenaltyWrench penalty_wrench(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch);

}  // namespace prescene::collision::scalar
