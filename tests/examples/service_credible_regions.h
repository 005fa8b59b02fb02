// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/evaluate/credible_regions.h take for granted.
#pragma once

#include <cstdint>

#include "prescene/core/parallel.h"

namespace prescene::service::given_service_credible_regions {

extern const std::uint64_t seed;
extern core::ThreadPool threads;

}  // namespace prescene::service::given_service_credible_regions
