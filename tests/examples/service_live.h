// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/live take for granted.
#pragma once

#include <memory>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/progress.h"
#include "prescene/service/backends.h"
#include "prescene/service/live/doctor.h"
#include "prescene/service/live/node_parameters.h"

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

}  // namespace prescene::service::given_service_live
