// SPDX-License-Identifier: Apache-2.0
// The shortest shift of all draws of a distribution for which a wanted share of them has an outcome.
//
// The outcome is a yes or no of one draw, which takes a simulation. Lengths at which it comes about are found along
// each coordinate alone; where the boundary is flat, the shortest shift of several coordinates has parts that are
// inversely proportional to these lengths, and a random search on shorter and shorter spheres goes on from there.
// Draws that refused most shifts until now are met first, so that a shift that won't do is refused by few of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::queries {

using Shift = std::vector<double>;  ///< One for each coordinate that may be changed, standard deviations.
double length_of(const Shift& shift);
/// `shift` with each part times `factor`.
Shift scaled(Shift shift, double factor);

struct ShiftProblem {
  std::size_t coordinates = 0;
  double longest = 4.0;  ///< Longer shifts are not looked at.
  /// How many draws there are; the first are met first, until others have refused more.
  std::size_t draws = 0;
  /// So many of them may be without the outcome.
  std::size_t allowed = 0;
  /// outcomes[i]: whether draw `tries[i].second`, shifted by `shifts[tries[i].first]`, has the outcome.
  std::function<void(std::span<const Shift> shifts, std::span<const std::pair<std::size_t, std::size_t>> tries,
                     std::span<std::uint8_t> outcomes)>
      try_out;
  /// True once the search is to end.
  std::function<bool()> stopped;
};

/// Nothing where none was found, or it was stopped before one was. A shift of a single coordinate is preferred to one
/// of several that is not a tenth shorter.
std::optional<Shift> shortest_shift(const ShiftProblem& problem, const core::RandomStream& stream);

}  // namespace prescene::queries
