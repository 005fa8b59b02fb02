// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service take for granted.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/backends.h"
#include "prescene/service/replay_input.h"
#include "prescene/service/tracker.h"
#include "prescene/service/tracker_settings.h"

namespace prescene::service::given_service {

extern core::ThreadPool pool;
extern const core::LogSink log;
extern Backends backends;
extern const TrackerSettings settings;

namespace backends_h {
extern const belief::Scene scene;
extern const belief::Belief snapshot;
extern const belief::Query query;
}  // namespace backends_h

namespace depth_noise_h {
extern const std::vector<geometry::DepthImage> images;
extern const geometry::PinholeCamera camera;
}  // namespace depth_noise_h

namespace ground_density_h {
extern const belief::FinalPoses poses;
extern const Eigen::Vector2d low, high;
extern const double x, y;
}  // namespace ground_density_h

namespace object_calibration_h {
extern const std::filesystem::path folder, path;
}

namespace replay_input_h {
extern const core::Cancellation cancellation;
extern const core::ProgressSink progress;
extern const StepSink on_step;
extern const JsonSink on_json;
}  // namespace replay_input_h

namespace tracker_h {
extern const std::shared_ptr<const belief::Scene> scene;
extern const std::uint64_t seed;
extern const interfaces::ReceivedMessage message;
extern const MessageIndex index;
extern const core::TimeNs now_ns;
}  // namespace tracker_h

}  // namespace prescene::service::given_service
