// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service take for granted.
#pragma once

#include <filesystem>
#include <string>

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/parallel.h"

namespace prescene::service::given_service {

extern core::ThreadPool pool;

namespace backends_h {
extern const belief::Scene scene;
extern const belief::Belief snapshot;
extern const belief::Query query;
}  // namespace backends_h

namespace scene_report_h {
extern const std::string text;
extern const std::filesystem::path path;
extern const core::LogSink log;
}  // namespace scene_report_h

}  // namespace prescene::service::given_service
