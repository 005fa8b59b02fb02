// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service_evaluate take for granted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/rendering/renderer.h"

namespace prescene::service::given_service_evaluate {

extern const std::filesystem::path dir;
extern const std::uint64_t seed;
extern core::ThreadPool threads;
extern const core::ProgressSink progress, sink;
extern const std::unique_ptr<rendering::Renderer> renderer;
extern filter::ParticleFilter filter;

}  // namespace prescene::service::given_service_evaluate
