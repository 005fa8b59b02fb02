// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/view take for granted.
#pragma once

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/session_report.h"
#include "prescene/service/view/live_view.h"
#include "prescene/service/view/recording_view.h"

namespace prescene::service::given_service_view {

extern const core::LogSink log;
extern Backends backends;

namespace live_view_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern LiveService* const service;
extern const std::shared_ptr<const belief::Belief> belief;
extern const belief::Observation observation;
extern const double seconds;
extern const std::vector<std::string> degraded;
extern const std::string answer_json;
}  // namespace live_view_h

namespace recorded_page_h {
extern const ShownStep step;
extern SessionReport report;
}  // namespace recorded_page_h

namespace recording_view_h {
extern const ReplayInput input;
extern Tracker* const tracker;
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
extern const std::vector<std::string> remarks;
}  // namespace recording_view_h

}  // namespace prescene::service::given_service_view
