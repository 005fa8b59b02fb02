// SPDX-License-Identifier: Apache-2.0
// For tests of what is checked behind a tree file's checksum.
#pragma once

#include <cstdint>
#include <span>

namespace prescene::collision {

/// Gives the bytes of a file the checksum that belongs to them. Nothing when they are too few.
void seal_tree_file(std::span<std::uint8_t> bytes);

}  // namespace prescene::collision
