// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), sets its wall clock wrong by the number of seconds that stands in the file
// named by PRESCENE_TEST_CLOCK_FILE (an int64), which the test changes as it likes. The steady clock is left alone.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

const volatile std::int64_t* shift_seconds() {
  static const volatile std::int64_t* const shared = []() -> const volatile std::int64_t* {
    const char* path = std::getenv("PRESCENE_TEST_CLOCK_FILE");
    const int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0) return nullptr;
    void* memory = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
    close(file);
    return memory == MAP_FAILED ? nullptr : static_cast<const volatile std::int64_t*>(memory);
  }
  ();
  return shared;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, struct timespec* time) noexcept {
  using Function = int (*)(clockid_t, struct timespec*);
  static const auto original = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = original(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    if (const volatile std::int64_t* shift = shift_seconds()) time->tv_sec += *shift;
  }
  return result;
}
