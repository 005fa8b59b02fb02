// SPDX-License-Identifier: Apache-2.0
// How far the step that the program chooses is from a fine one, in the shares of faces that thrown dice end on.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Steel cuboids with two square faces: 12 ratios of their height to their width, three sizes, five throws; `count`
/// throws each with the step that the program takes by itself, and as many at 1/7680 s. Adds a target: the root mean
/// square of the differences of the share that lands on a square face. What chance adds to the square is taken off.
Table measure_dice_steps(int count, Report* report);

}  // namespace prescene::benchmarks
