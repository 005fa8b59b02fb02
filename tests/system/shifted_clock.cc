// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), sets its wall clock wrong by the number of seconds that stands in the file
// named by PRESCENE_TEST_CLOCK_FILE (an int64), which the test changes as it likes. The steady clock is left alone.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <ctime>

namespace {

const volatile std::int64_t* shift_seconds() {
  static const volatile std::int64_t* const kShared = []() -> const volatile std::int64_t* {
    const char* path = std::getenv("PRESCENE_TEST_CLOCK_FILE");
    const int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    if (file < 0) return nullptr;
    void* memory = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
    close(file);
    return memory == MAP_FAILED ? nullptr : static_cast<const volatile std::int64_t*>(memory);
  }
  ();
  return kShared;
}

std::int64_t nanoseconds(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

}  // namespace

extern "C" int clock_gettime(clockid_t clock, struct timespec* time) noexcept {
  using Function = int (*)(clockid_t, struct timespec*);
  static const auto kOriginal = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = kOriginal(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
    if (const volatile std::int64_t* shift = shift_seconds()) time->tv_sec += *shift;
  }
  return result;
}

extern "C" int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const struct timespec* until) {
  using Function = int (*)(pthread_cond_t*, pthread_mutex_t*, const struct timespec*);
  static const auto kOriginal = reinterpret_cast<Function>(dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2"));
  const volatile std::int64_t* shift = shift_seconds();
  if (!shift) return kOriginal(condition, mutex, until);
  // In slices, as the clock may be set meanwhile; the end of a slice is a wake-up without a cause, which may always be.
  constexpr std::int64_t kSlice = 50'000'000;
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  const std::int64_t left = nanoseconds(*until) - nanoseconds(now);
  const std::int64_t end = nanoseconds(now) - *shift * 1'000'000'000 + std::min(left, kSlice);
  const timespec slice{static_cast<time_t>(end / 1'000'000'000), static_cast<long>(end % 1'000'000'000)};
  const int result = kOriginal(condition, mutex, &slice);
  return result == ETIMEDOUT && left > kSlice ? 0 : result;
}
