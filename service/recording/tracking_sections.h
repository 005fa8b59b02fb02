// SPDX-License-Identifier: Apache-2.0
// What a session's report shows of each object over time.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/tracking_score.h"

namespace prescene::service {

/// By stamp.
using SessionSummaries = std::map<core::TimeNs, BeliefSummary>;
/// By stamp, then object: ResidualMeter's, m.
using SessionResiduals = std::map<core::TimeNs, std::map<std::string, double>>;

/// A band of states, and curves of confidence, residual, evidence, height and, where the truth is known, errors.
std::vector<interfaces::ReportBlock> tracking_blocks(const SessionSummaries& summaries,
                                                     const SessionResiduals& residuals, const TrackingScore& score);
/// What is believed of physical parameters in the end, and what was at the start; nothing where all are known exactly.
std::optional<interfaces::ReportSection> learned_section(const SessionSummaries& summaries);
/// Of each object that was out of sight, where it may have been in the last frame of its longest such time.
std::optional<interfaces::ReportSection> hidden_section(const SessionSummaries& summaries, const belief::Scene& scene,
                                                        const TrackingScore& score);

/// How an object's state differs between two summaries: "carton: tracked, then unseen; cup is new"; "" = in none.
std::string state_changes(const BeliefSummary& before, const BeliefSummary& after);

}  // namespace prescene::service
