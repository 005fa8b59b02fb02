// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of core take for granted.
#pragma once

#include <cstdint>

#include "prescene/core/status.h"

namespace prescene::core::given_core {

namespace random_h {
extern const std::uint64_t seed, step;
extern const std::uint32_t particle;
}  // namespace random_h

namespace status_h {
struct TriangleMesh {};
struct Options {};
extern const char* const path;
extern const Options options;
Result<TriangleMesh> read_mesh(const char* path, const Options& options);
}  // namespace status_h

}  // namespace prescene::core::given_core
