// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/live take for granted.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/doctor.h"
#include "prescene/service/live/node_parameters.h"
#include "prescene/service/live/planning_scene.h"
#include "prescene/service/tracking/tracker.h"

namespace prescene::service::given_service_live {

extern const core::LogSink log;

namespace doctor_h {
extern const DoctorOptions options;
extern const std::shared_ptr<const belief::Scene> scene;
extern Backends backends;
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
}  // namespace doctor_h

namespace node_parameters_h {
extern std::vector<NodeParameter> parameters;
extern const interfaces::RosSetParametersRequest request;
}  // namespace node_parameters_h

namespace belief_events_h {
extern const BeliefSummary summary;
extern const std::shared_ptr<const belief::Belief> belief;
extern const StepNews news;
}  // namespace belief_events_h

namespace planning_scene_h {
extern const BeliefSummary summary;
extern const std::shared_ptr<const belief::Belief> belief;
extern const int readers;
extern const std::uint64_t readers_so_far;
extern const PlanningScene::Send send;
}  // namespace planning_scene_h

}  // namespace prescene::service::given_service_live
