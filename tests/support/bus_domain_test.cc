// SPDX-License-Identifier: Apache-2.0
#include "tests/support/bus_domain.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

std::vector<int> all_domains() {
  std::vector<int> domains(kLastTestDomain - kFirstTestDomain + 1);
  std::iota(domains.begin(), domains.end(), kFirstTestDomain);
  return domains;
}

/// A process that takes domains of a folder until none is left, and keeps them until release() or the end of this
/// process.
class Taker {
 public:
  /// It begins when this process has closed the end of `start` that it writes to.
  Taker(const std::filesystem::path& folder, const std::array<int, 2>& start) {
    EXPECT_EQ(pipe(taken_.data()), 0);
    EXPECT_EQ(pipe(stop_.data()), 0);
    pid_ = fork();
    if (pid_ == 0) {
      close(start[1]);
      close(stop_[1]);
      wait_for_end(start[0]);
      while (const auto domain = take_domain(folder)) {
        if (write(taken_[1], &*domain, sizeof *domain) != sizeof *domain) _exit(1);
      }
      close(taken_[1]);
      wait_for_end(stop_[0]);
      _exit(0);
    }
    close(taken_[1]);
    close(stop_[0]);
  }
  ~Taker() { release(); }
  Taker(const Taker&) = delete;
  Taker& operator=(const Taker&) = delete;

  /// All that it took; waits until it has done so.
  std::vector<int> taken() const {
    std::vector<int> domains;
    for (int domain = 0; read(taken_[0], &domain, sizeof domain) == sizeof domain;) domains.push_back(domain);
    return domains;
  }
  /// Ends it.
  void release() {
    if (pid_ <= 0) return;
    close(stop_[1]);
    close(taken_[0]);
    int status = -1;
    EXPECT_EQ(waitpid(pid_, &status, 0), pid_);
    EXPECT_EQ(status, 0);
    pid_ = -1;
  }

 private:
  static void wait_for_end(int descriptor) {
    for (char byte = 0; read(descriptor, &byte, 1) > 0;) continue;
  }

  std::array<int, 2> taken_{};
  std::array<int, 2> stop_{};
  pid_t pid_ = -1;
};

TEST(BusDomain, TwoProcessesShareAllDomainsWithoutOneInCommon) {
  const ScratchDir folder;
  std::array<int, 2> start{};
  ASSERT_EQ(pipe(start.data()), 0);
  Taker one(folder.path(), start);
  Taker other(folder.path(), start);
  close(start[1]);
  close(start[0]);
  std::vector<int> taken = one.taken();
  const std::vector<int> of_other = other.taken();
  taken.insert(taken.end(), of_other.begin(), of_other.end());
  std::sort(taken.begin(), taken.end());
  EXPECT_EQ(taken, all_domains());
  EXPECT_FALSE(take_domain(folder.path()).has_value());
  other.release();
  one.release();
  EXPECT_TRUE(take_domain(folder.path()).has_value());
}

TEST(BusDomain, AScriptTakesThemByTheSameFiles) {
  const ScratchDir folder;
  for (std::size_t i = 1; i < all_domains().size(); ++i) ASSERT_TRUE(take_domain(folder.path()).has_value());
  const std::string stop = (folder.path() / "stop").string();
  ASSERT_EQ(mkfifo(stop.c_str(), 0600), 0);
  const std::string script = "set -eu; . '" + (source_dir() / "tests/support/take_domain.sh").string() +
                             "'; take_domain '" + folder.path().string() + "'; echo $domain; read -r end < '" + stop +
                             "'";
  FILE* running = popen(script.c_str(), "r");
  ASSERT_NE(running, nullptr);
  std::array<char, 16> line{};
  const bool has_one = std::fgets(line.data(), line.size(), running) != nullptr;
  EXPECT_TRUE(has_one);
  EXPECT_FALSE(take_domain(folder.path()).has_value());
  if (has_one) std::ofstream(stop) << "end\n";
  EXPECT_EQ(pclose(running), 0);
  EXPECT_EQ(take_domain(folder.path()), std::atoi(line.data()));
  // Now that all are taken, a script gets none.
  EXPECT_NE(std::system((script + " 2> /dev/null").c_str()), 0);
}

TEST(BusDomain, OfAProcessStaysAndFurtherOnesAreOthers) {
  const int own = own_domain();
  EXPECT_EQ(own_domain(), own);
  EXPECT_NE(another_domain(), own);
  EXPECT_NE(another_domain(), another_domain());
}

TEST(BusDomain, PortsEndBelowThoseOfTheSystem) {
  constexpr int kFirstPort = 7400;
  constexpr int kPortsOfADomain = 250;
  EXPECT_LT(kFirstPort + kPortsOfADomain * (kLastTestDomain + 1), 32768);
  EXPECT_GT(kFirstTestDomain, 0);
}

}  // namespace
}  // namespace prescene::tests
