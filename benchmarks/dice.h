// SPDX-License-Identifier: Apache-2.0
// Steel cuboids with two square faces that are thrown on a floor: which face they come to lie on is known to depend on
// the ratio of their edges and on the throw.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"

namespace prescene::benchmarks {

/// Of height to width.
inline constexpr std::array kDiceRatios = {0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 1.7, 2.0};
inline constexpr std::array kDiceWidths = {0.005, 0.013, 0.04};  ///< m

struct DiceThrow {
  const char* name;
  double height, speed, fall, spin;  ///< m above the floor, m/s along it and down, rad/s in each axis
  double restitution, friction;
};
inline constexpr std::array kDiceThrows = {
    DiceThrow{"dropped", 0.1, 0.0, 0.0, 8.0, 0.5, 0.3},   DiceThrow{"thrown", 0.05, 1.0, 0.0, 40.0, 0.5, 0.3},
    DiceThrow{"hard", 0.05, 2.0, 1.0, 100.0, 0.5, 0.3},   DiceThrow{"dull", 0.03, 0.5, 0.0, 20.0, 0.2, 0.3},
    DiceThrow{"lively", 0.05, 1.0, 0.0, 40.0, 0.7, 0.15},
};
inline constexpr double kDiceDuration = 8.0;  ///< s, after which all lie.

/// A die of `width` (m) and `ratio` times that height on a floor.
belief::Scene dice_scene(double width, double ratio, const DiceThrow& how);
/// Turned any way.
std::vector<belief::WorldState> dice_starts(const belief::Scene& scene, const DiceThrow& how, int count,
                                            std::uint64_t seed);
/// Whether the die lies on a square face.
bool lies_on_square_face(const belief::WorldState& end);

/// Root of the mean square of true differences between shares: of those that were found, less the variances that chance
/// gives them; with the same a standard error lower and higher.
struct RootMeanSquare {
  double value = 0.0, low = 0.0, high = 0.0;
};

/// One of the kinds of dice that are thrown: each throw with each width (m) and each ratio.
struct DiceKind {
  std::uint64_t number = 0;  ///< From 0: for seeds, so that each kind has chance errors of its own.
  DiceThrow how;
  double width = 0.0, ratio = 0.0;
  belief::Scene scene;  ///< As dice_scene().
};
inline constexpr int kDiceKinds = static_cast<int>(kDiceThrows.size() * kDiceWidths.size() * kDiceRatios.size());

/// Shares of throws that end on a square face, in two ways of working them out, of so many throws each (at least 2).
struct SquareShares {
  double first = 0.0, second = 0.0;
  int first_throws = 0, second_throws = 0;
};
/// Of the differences between the two ways over all kinds, chance taken out. Each throw's name is printed to standard
/// error when its kinds begin.
RootMeanSquare compare_dice(const std::function<SquareShares(const DiceKind&)>& throw_both_ways);

}  // namespace prescene::benchmarks
