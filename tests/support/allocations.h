// SPDX-License-Identifier: Apache-2.0
// Counts heap allocations, for tests of kernels that must not allocate once warm or may take only so much. A program
// that calls allocation_count gets operator new replaced by a counting one.
#pragma once

#include <cstdint>

namespace prescene::tests {

/// Whether counting works in this build: not under sanitizers, which bring an allocator of their own. Tests then skip.
bool can_count_allocations();

/// Calls of operator new so far, on all threads.
std::uint64_t allocation_count();

/// Bytes of the heap that are in use now.
std::uint64_t heap_bytes();

}  // namespace prescene::tests
