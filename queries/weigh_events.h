// SPDX-License-Identifier: Apache-2.0
// From the evidences of all hypotheses to probabilities with intervals.
#pragma once

#include <cstdint>
#include <vector>

#include "explain_answer.h"

namespace prescene::queries {

/// Sets probability, low and high of all of `judged` and of the first of `nothings` (one for each candidate; `judged`
/// hold Bayes factors against that of their object). The standard error of a log evidence comes from the scatter of its
/// runs, moderated by that of all hypotheses, as few runs say little of their own scatter [Smyth 2004]; intervals are
/// those of drawn evidences, Student's t about the estimates.
void weigh_events(std::vector<Judged>& nothings, std::vector<Judged>& judged, double confidence, std::uint64_t seed);

}  // namespace prescene::queries
