// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/evaluate/cleargrasp.h take for granted.
#pragma once

#include <cstdint>
#include <filesystem>

namespace prescene::service::given_service_cleargrasp {

extern const std::filesystem::path dir;
extern const std::uint64_t seed;

}  // namespace prescene::service::given_service_cleargrasp
