// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of the library service_finding take for granted.
#pragma once

#include <memory>

#include "prescene/core/parallel.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/rendering/renderer.h"

namespace prescene::service::given_service_finding {

extern core::ThreadPool threads;
extern const std::unique_ptr<rendering::Renderer> renderer;
extern filter::ParticleFilter filter;

}  // namespace prescene::service::given_service_finding
