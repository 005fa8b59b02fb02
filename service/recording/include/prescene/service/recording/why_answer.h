// SPDX-License-Identifier: Apache-2.0
// Answers the question why a pose is believed (prescene/queries/why.h) from the kept frames of the last seconds.
//
//   PRESCENE_TRY(const PastWindow past, history.window(asked_window(question)));
//   PRESCENE_TRY(const Reasons reasons, why_past(past, question, context));
//   ... why_answer_json(question, reasons)
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/belief/why_question.h"
#include "prescene/queries/why.h"
#include "prescene/service/recording/frame_history.h"

namespace prescene::service {

struct Reasons {
  queries::WhyAnswer answer;
  core::TimeNs first_ns = 0;         ///< Stamp of the session's first frame.
  double from = 0.0, to = 0.0;       ///< s since it: the window begins after the one, and ends with the other.
  std::vector<std::string> cameras;  ///< Of each view; "" = the scene has one.
  double seconds = 0.0;              ///< Wall time; ...
  double cpu_seconds = 0.0;          ///< ... CPU time of the process in it.
};

AskedWindow asked_window(const belief::WhyQuestion& question);

/// Errors of queries::why.
core::Result<Reasons> why_past(const PastWindow& past, const belief::WhyQuestion& question,
                               const queries::ExplainContext& context);

/// {"id", "step", "why": {...}} with what was asked, its window by frames, under "asked": the same question of the same
/// frames has the same answer, wall times aside, unless "cut_short". Times are s since the session's first frame.
nlohmann::ordered_json why_answer_json(const belief::WhyQuestion& question, const Reasons& reasons);

}  // namespace prescene::service
