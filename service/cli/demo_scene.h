// SPDX-License-Identifier: Apache-2.0
// The scene of `prescene demo`, scenarios/milk_on_bin.yaml, which is part of the program.
#pragma once

#include <string_view>

namespace prescene::service {

std::string_view demo_scene();

}  // namespace prescene::service
