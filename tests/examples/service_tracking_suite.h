// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/evaluate/tracking_suite.h take for granted.
#pragma once

#include <cstdint>
#include <filesystem>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"

namespace prescene::service::given_service_tracking_suite {

extern const std::filesystem::path dir;
extern const std::uint64_t seed;
extern core::ThreadPool threads;
extern const core::ProgressSink sink;

}  // namespace prescene::service::given_service_tracking_suite
