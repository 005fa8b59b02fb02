// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/recording take for granted.
#pragma once

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/rendering/renderer.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/frame_history.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/simulated_recording.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/recording/why_answer.h"
#include "prescene/service/tracking/tracker.h"
#include "prescene/service/tracking/tracker_settings.h"

namespace prescene::service::given_service_recording {

extern const core::LogSink log;
extern Backends backends;
extern const TrackerSettings settings;

namespace bop_dataset_h {
extern const belief::Scene scene;
extern const std::unique_ptr<rendering::Renderer> renderer;
extern const std::unique_ptr<RecordingWriter> recording;
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
extern SimulatedRecordingOptions options;
}  // namespace bop_dataset_h

namespace replay_input_h {
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
extern const StepSink on_step;
extern const JsonSink on_json;
}  // namespace replay_input_h

namespace explained_h {
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
extern const std::uint64_t seed;
}  // namespace explained_h

namespace frame_history_h {
extern const TrackerStep step;
extern const Tracker tracker;
extern const belief::ExplainQuestion question;
extern const belief::EventWeights weights;
extern const queries::ExplainContext context;
}  // namespace frame_history_h

namespace why_answer_h {
extern const FrameHistory history;
extern const belief::WhyQuestion question;
extern const queries::ExplainContext context;
}  // namespace why_answer_h
namespace happened_h {
extern const std::string text;
}  // namespace happened_h

namespace explained_again_h {
extern const ReplayInput input;
extern const core::Cancellation cancellation;
extern const TrackerStep step;
extern const Tracker tracker;
extern const std::string json;
extern const core::TimeNs time_ns;
}  // namespace explained_again_h

namespace read_ahead_h {
extern const std::unique_ptr<RecordingReader> reader;
extern const Tracker tracker;
}  // namespace read_ahead_h

namespace residuals_h {
extern const belief::Scene scene;
extern const BeliefSummary summary;
extern const belief::Observation observation;
}  // namespace residuals_h

namespace rolling_recording_h {
extern const RecordingInfo info;
extern const interfaces::ReceivedMessage message;
extern const TrackerSnapshot snapshot;
extern const std::shared_ptr<const belief::Scene> scene;
}  // namespace rolling_recording_h

namespace session_report_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const BeliefSummary summary;
extern const belief::Observation observation;
extern const TrackingScore score;
}  // namespace session_report_h

}  // namespace prescene::service::given_service_recording
