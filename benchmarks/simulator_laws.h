// SPDX-License-Identifier: Apache-2.0
// What a simulator's answers must hold to: similar scenes give the same probabilities, an answer that a step has
// changed says so, and scanned meshes give what their full hulls give.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Six scenes, and those in which all lengths are s and all times sqrt(s) times as large, for s of 1/64, 1/8, 8 and 64:
/// probabilities from the same `instances` starts.
Table measure_scale_law(int instances, Report* report);

/// `scenes` scenes with given steps in which half or twice the step shifts a probability by 3 points or more: how many
/// of them `model_error` of a prediction names.
Table measure_model_error(int scenes, Report* report);

/// A scanned bottle let go above a table beside a scanned mug: processor time of an instance in lockstep, and shares of
/// outcomes against Bullet's stepper with the full hulls, from the same `in_bullet` starts. Without the meshes
/// (tests::data_dir("meshes")) the targets say so.
Table measure_scanned_pair(int instances, int in_bullet, Report* report);

}  // namespace prescene::benchmarks
