// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/bytes take for granted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/bytes/file.h"

namespace prescene::interfaces::given_interfaces_bytes {

extern const std::filesystem::path path;
extern const std::vector<std::uint8_t> bytes;
extern OutputFile file;

}  // namespace prescene::interfaces::given_interfaces_bytes
