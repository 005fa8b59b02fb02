// SPDX-License-Identifier: Apache-2.0
// Thrown dice beside the same dice in MuJoCo.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// 12 ratios of edges, three sizes and five throws: shares of `ours` throws that land on a square face in lockstep at
/// the step that it takes by itself, and of `theirs` in MuJoCo 2.2.2 at 1/20,000 s, with stiff contacts.
Table measure_dice_in_mujoco(int ours, int theirs, Report* report);

}  // namespace prescene::benchmarks
