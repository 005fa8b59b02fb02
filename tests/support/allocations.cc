// SPDX-License-Identifier: Apache-2.0
#include "tests/support/allocations.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <utility>

#include "tests/support/sanitizers.h"

#define PRESCENE_COUNTS_ALLOCATIONS (!PRESCENE_SANITIZES_MEMORY)

namespace {

std::atomic<std::uint64_t> allocations{0};
thread_local std::uint64_t until_failure = 0;  // 0 = none is to fail

[[maybe_unused]] void count_allocation() {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (until_failure > 0 && --until_failure == 0) throw std::bad_alloc();
}

}  // namespace

#if PRESCENE_COUNTS_ALLOCATIONS
void* operator new(std::size_t size) {
  count_allocation();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  count_allocation();
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size + step - 1) / step * step)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
#endif

namespace prescene::tests {

bool can_count_allocations() { return PRESCENE_COUNTS_ALLOCATIONS != 0; }
std::uint64_t allocation_count() { return allocations.load(std::memory_order_relaxed); }
void fail_allocation_after(std::uint64_t count) { until_failure = count + 1; }
bool stop_failing_allocations() { return std::exchange(until_failure, 0) > 0; }
std::uint64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace prescene::tests
