// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/calibration take for granted.
#pragma once

#include <filesystem>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/geometry/camera.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/backends.h"
#include "prescene/service/calibration/toss_scores.h"

namespace prescene::service::given_service_calibration {

extern const core::LogSink log;
extern Backends backends;

namespace depth_noise_h {
extern const std::vector<geometry::DepthImage> images;
extern const geometry::PinholeCamera camera;
}  // namespace depth_noise_h

namespace object_calibration_h {
extern const std::filesystem::path folder, path;
}

namespace toss_evaluation_h {
extern const std::filesystem::path folder, path;
}

namespace toss_scores_h {
extern const simulation::RecordedMotion motion;
extern const simulation::RecordedRest rest;
extern const simulation::MotionForecast forecast;
extern const double gyration;
extern const std::vector<ScoredToss> tosses;
extern const core::RandomStream stream;
}  // namespace toss_scores_h

}  // namespace prescene::service::given_service_calibration
