// SPDX-License-Identifier: Apache-2.0
// The outcome that is wanted: which of the scene's it is, and whether it can come about and be judged at all.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/achieve.h"
#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"

namespace prescene::queries {

struct WantedOutcome {
  std::string name;  ///< "in_bin", "where.in_bin".
  /// Its conditions, complete; none for the "other" of a group.
  belief::Outcome outcome;
  /// The exclusive group that it is the class `class_index` of; nothing: it is judged by itself.
  std::optional<belief::ExclusiveOutcomes> group;
  int class_index = 0;

  bool holds(const belief::Scene& scene, const belief::Trajectory& run) const;
  /// In a few words, why it does not: the class that a group has instead, or the first condition that is not met.
  std::string instead(const belief::Scene& scene, const belief::Trajectory& run) const;
};

/// Fails where there is no such outcome (naming the nearest), where several have the name, where its conditions can't
/// hold together, and where an object that it needs is not there now; `left_out` are the names of those.
core::Result<WantedOutcome> find_wanted(const belief::Scene& scene, const belief::AchieveQuery& query,
                                        const std::vector<std::string>& left_out);

/// Why the two conditions never hold together, in words; nothing where they may. Both are of one object.
std::optional<std::string> contradiction(const belief::Condition& a, const belief::Condition& b);
/// "resting on table", "not upright within 10 degrees".
std::string condition_text(const belief::Condition& condition);
/// The first of `absent` that a condition speaks of.
std::optional<std::string> named_absent(const WantedOutcome& wanted, const std::vector<std::string>& absent);

}  // namespace prescene::queries
