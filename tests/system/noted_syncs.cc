// SPDX-License-Identifier: Apache-2.0
// Preloaded into a program (LD_PRELOAD), notes in the file named by PRESCENE_TEST_SYNC_FILE two numbers (int64): up to
// which byte its recording is on the disk for certain, which is what was written when the last fdatasync() that has
// ended began; and how many files got a new name before that was done for them. A power failure may leave no more than
// that of the recording, and of the other files nothing but the name.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>
#include <string>

namespace {

std::mutex synced_mutex;
std::set<ino_t> synced;

volatile std::int64_t* notes() {
  static volatile std::int64_t* const kShared = []() -> volatile std::int64_t* {
    const char* path = std::getenv("PRESCENE_TEST_SYNC_FILE");
    const int file = path != nullptr ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0) return nullptr;
    void* memory = mmap(nullptr, 2 * sizeof(std::int64_t), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    return memory == MAP_FAILED ? nullptr : static_cast<volatile std::int64_t*>(memory);
  }
  ();
  return kShared;
}

bool is_recording(int descriptor) {
  char name[4096];
  const ssize_t size = readlink(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), name, sizeof name);
  return size > 5 && std::string(name, static_cast<std::size_t>(size)).ends_with(".mcap");
}

}  // namespace

extern "C" int fdatasync(int descriptor) {
  using Function = int (*)(int);
  static const auto kOriginal = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "fdatasync"));
  struct stat before {};
  const bool known = fstat(descriptor, &before) == 0;
  const int result = kOriginal(descriptor);
  if (!known || result != 0) return result;
  {
    const std::lock_guard lock(synced_mutex);
    synced.insert(before.st_ino);
  }
  if (volatile std::int64_t* noted = notes(); noted != nullptr && is_recording(descriptor)) noted[0] = before.st_size;
  return result;
}

extern "C" int rename(const char* from, const char* to) noexcept {
  using Function = int (*)(const char*, const char*);
  static const auto kOriginal = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "rename"));
  struct stat file {};
  if (volatile std::int64_t* noted = notes(); noted != nullptr && stat(from, &file) == 0) {
    const std::lock_guard lock(synced_mutex);
    if (!synced.contains(file.st_ino)) noted[1] = noted[1] + 1;
  }
  return kOriginal(from, to);
}
