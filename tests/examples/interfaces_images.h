// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/images take for granted.
#pragma once

#include <filesystem>

#include "prescene/geometry/image.h"

namespace prescene::interfaces::given_interfaces_images {

extern const std::filesystem::path path;

}  // namespace prescene::interfaces::given_interfaces_images
