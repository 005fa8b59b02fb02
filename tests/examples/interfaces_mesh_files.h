// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/mesh_files take for granted.
#pragma once

#include <cstdint>
#include <span>

#include "prescene/core/log.h"
#include "prescene/interfaces/mesh_files/limited_child.h"

namespace prescene::interfaces::given_interfaces_mesh_files {

extern const core::LogSink sink;

namespace limited_child_h {
struct File;
extern const File& file;
std::span<const std::uint8_t> convert(const File& file);
extern const ChildLimits limits;
}  // namespace limited_child_h

}  // namespace prescene::interfaces::given_interfaces_mesh_files
