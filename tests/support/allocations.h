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

/// The next `count` calls of operator new on this thread succeed, the one after them throws std::bad_alloc, once.
void fail_allocation_after(std::uint64_t count);
/// Takes that back; true if it had not thrown yet.
bool stop_failing_allocations();

/// Bytes of the heap that are in use now.
std::uint64_t heap_bytes();

}  // namespace prescene::tests
