// SPDX-License-Identifier: Apache-2.0
#include "tests/support/bus_domain.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace prescene::tests {
namespace {

// Not $TMPDIR: runs that have different ones share the bus all the same.
constexpr const char* kSharedFolder = "/tmp";

// Where the descriptor of a lock is at least. Programs under test inherit it, and tests of scarce descriptors want the
// low ones to be free.
constexpr int kLowestDescriptor = 200;

/// Whether the lock of this file is ours now; it is kept for good.
bool lock(const std::filesystem::path& path) {
  // Without O_CREAT first: in a folder with the sticky bit, Linux may refuse it for a file of another user.
  int opened = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) opened = open(path.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC, 0644);
  if (opened < 0) return false;
  const int kept = flock(opened, LOCK_EX | LOCK_NB) == 0 ? fcntl(opened, F_DUPFD, kLowestDescriptor) : -1;
  close(opened);
  return kept >= 0;
}

}  // namespace

std::optional<int> take_domain(const std::filesystem::path& folder) {
  constexpr int kCount = kLastTestDomain - kFirstTestDomain + 1;
  // From different ones on, so that a domain is not used again at once.
  const int start = static_cast<int>(getpid() % kCount);
  for (int i = 0; i < kCount; ++i) {
    const int domain = kFirstTestDomain + (start + i) % kCount;
    if (lock(folder / ("prescene_test_domain_" + std::to_string(domain)))) return domain;
  }
  return std::nullopt;
}

int another_domain() {
  const std::optional<int> domain = take_domain(kSharedFolder);
  if (!domain)
    throw std::runtime_error("no DDS domain from " + std::to_string(kFirstTestDomain) + " to " +
                             std::to_string(kLastTestDomain) + " is free: other processes have locked " +
                             kSharedFolder + "/prescene_test_domain_*, or this one may not open them");
  return *domain;
}

int own_domain() {
  static const int kDomain = another_domain();
  return kDomain;
}

}  // namespace prescene::tests
