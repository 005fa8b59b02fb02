// SPDX-License-Identifier: Apache-2.0
// Which parameters the live service has: what it was started with, and what may change while it runs.
#pragma once

#include <functional>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/live/node_parameters.h"

namespace prescene::service {

/// What takes effect when a parameter is set: each is called with the new value.
struct ParameterHooks {
  std::function<void(double)> question_seconds, most_question_seconds, history, marker_rate, diagnostics_rate,
      learned_interval;
  std::function<void(double)> max_wait, max_stamp_difference;  ///< Of the tracker, as new_objects.
  std::function<void(bool)> new_objects;
  std::function<void(core::LogLevel)> log_level;
};

std::vector<NodeParameter> service_parameters(const belief::Scene& scene, const LiveSettings& settings,
                                              const ParameterHooks& hooks);

}  // namespace prescene::service
