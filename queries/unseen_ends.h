// SPDX-License-Identifier: Apache-2.0
// Where something ends that went out of sight while it moved.
//
// What frames see of a path says how far the true motion is off it. Unseen, that grows: a little more speed or turn
// where a thing hits the floor, and it bounces elsewhere, by much more than a share of its way. So instances go on from
// when it was seen last, each off by a draw of the error that the frames leave.
#pragma once

#include <span>
#include <vector>

#include "explain_answer.h"

namespace prescene::queries {

/// Of the object that the hypothesis is about, whose points were simulated; `log_ratios`: of these, point by point, by
/// frame. Empty if nothing moves it by physics, or the last frames see it, or none does.
std::vector<UnseenEnd> unseen_ends(EventPaths& events, WindowLikelihood& likelihood, const std::vector<double>& times,
                                   const Judged& judged, std::span<const double> log_ratios);

}  // namespace prescene::queries
