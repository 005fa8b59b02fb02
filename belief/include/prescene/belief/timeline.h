// SPDX-License-Identifier: Apache-2.0
// Timelines: time-stamped intervals of named relations between things.
#pragma once

#include <string>
#include <vector>

namespace prescene::belief {

/// m/s; what moves downwards faster than this and touches nothing is falling: the speed after 5 mm of free fall.
inline constexpr double kFallingSpeed = 0.3;

enum class Relation { kContact, kSupports, kInside, kHolds, kMoving, kUpright, kFalling };
std::string to_string(Relation relation);

/// `subject` stood in `relation` (to `other`, empty for kMoving, kUpright, kFalling) from `begin` to `end` (s).
struct Interval {
  Relation relation = Relation::kContact;
  std::string subject;
  std::string other;
  double begin = 0.0;
  double end = 0.0;
  friend bool operator==(const Interval&, const Interval&) = default;
};

/// Ordered by (begin, relation, subject, other).
using Timeline = std::vector<Interval>;

}  // namespace prescene::belief
