// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mesh_files/limited_child.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <thread>

#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using testing::HasSubstr;

constexpr ChildLimits kLimits{std::size_t{64} << 20, std::chrono::seconds(60), std::size_t{8} << 20};

std::string message_of(const std::function<void(ChildOutput&)>& work, const ChildLimits& limits = kLimits) {
  const auto result = run_in_child(work, limits);
  EXPECT_FALSE(result.ok());
  return to_string(result.status());
}

bool has_children() { return ::waitpid(-1, nullptr, WNOHANG) >= 0 || errno != ECHILD; }

std::size_t open_files() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

TEST(LimitedChild, GivesWhatTheWorkWrote) {
  const std::vector<std::uint8_t> expected(3'000'000, 7);
  const auto bytes = run_in_child([&](ChildOutput& out) { out.write(expected); }, kLimits);
  ASSERT_TRUE(bytes.ok()) << bytes.status().message();
  EXPECT_TRUE(*bytes == expected);
  EXPECT_TRUE(run_in_child([](ChildOutput&) {}, kLimits)->empty());
}

TEST(LimitedChild, SaysHowTheWorkFailed) {
  EXPECT_EQ(message_of([](ChildOutput&) { ::raise(SIGSEGV); }), "invalid input: crashed (signal 11)");
  EXPECT_EQ(message_of([](ChildOutput&) { ::_exit(3); }), "invalid input: crashed (exit status 3)");
  EXPECT_EQ(message_of([](ChildOutput&) { throw std::runtime_error("x"); }), "invalid input: failed with an exception");
  EXPECT_EQ(message_of([](ChildOutput&) { throw std::bad_alloc(); }),
            "resource exhausted: ran out of its 64.0 MiB of memory");
  EXPECT_EQ(message_of([](ChildOutput& out) { out.write(std::vector<std::uint8_t>(std::size_t{9} << 20)); }),
            "resource exhausted: gave more than 8.0 MiB");
  EXPECT_FALSE(has_children()) << "each was waited for";
}

TEST(LimitedChild, IsNotStartedWhereItsEndWouldBeLost) {
  std::signal(SIGCHLD, SIG_IGN);
  const std::string ignored = message_of([](ChildOutput&) { throw std::bad_alloc(); });
  std::signal(SIGCHLD, SIG_DFL);
  EXPECT_THAT(ignored, HasSubstr("unavailable: cannot be started: SIGCHLD is ignored"));
  EXPECT_TRUE(run_in_child([](ChildOutput&) {}, kLimits).ok());
}

TEST(LimitedChild, WhoseEndAnotherTookIsNotTakenForDone) {
  const tests::ScratchDir folder;
  const std::filesystem::path gate = folder.path() / "gate";
  ASSERT_EQ(::mkfifo(gate.c_str(), 0600), 0);
  // Waits for just any child, as a program around this library might, and opens the gate then.
  std::thread greedy([&] {
    while (::waitpid(-1, nullptr, 0) <= 0) std::this_thread::yield();
    ::close(::open(gate.c_str(), O_WRONLY));
  });
  // The child's own child keeps the pipe open until the gate opens.
  const auto result = run_in_child(
      [&](ChildOutput&) {
        if (::fork() == 0) ::close(::open(gate.c_str(), O_RDONLY));
        ::_exit(97);
      },
      kLimits);
  greedy.join();
  EXPECT_THAT(to_string(result.status()), HasSubstr("unavailable: ended in an unknown way"));
}

TEST(LimitedChild, IsToldByASignalThatItsProcessorTimeIsUp) {
  const auto limits = run_in_child(
      [](ChildOutput& out) {
        rlimit time{};
        ::getrlimit(RLIMIT_CPU, &time);
        const std::uint8_t below = time.rlim_cur < time.rlim_max ? 1 : 0;
        out.write({&below, 1});
      },
      kLimits);
  ASSERT_TRUE(limits.ok());
  EXPECT_EQ(limits->at(0), 1) << "at the hard limit it would be killed without a reason";
  EXPECT_EQ(message_of([](ChildOutput&) { ::raise(SIGXCPU); }), "resource exhausted: did not finish within 60 s");
}

TEST(LimitedChild, EndsWhoDoesNotReturn) {
  ChildLimits limits = kLimits;
  limits.time = std::chrono::milliseconds(200);
  EXPECT_EQ(message_of([](ChildOutput&) { ::pause(); }, limits), "resource exhausted: did not finish within 0.2 s");
  // Closing the pipe is not ending, and no time is waited for then.
  EXPECT_THAT(message_of([](ChildOutput&) {
                for (int file = 0; file < 64; ++file) ::close(file);
                for (;;) ::pause();
              }),
              HasSubstr("was killed"));
  EXPECT_FALSE(has_children());
}

TEST(LimitedChild, HasItsShareOfMemoryAndNoMore) {
  if (!child_memory_is_limited()) GTEST_SKIP() << "sanitizers map more than any limit";
  const auto take = [](std::size_t bytes) {
    return [bytes](ChildOutput& out) {
      const std::vector<std::uint8_t> taken(bytes, 1);
      out.write(std::span(taken).first(1));
    };
  };
  EXPECT_TRUE(run_in_child(take(std::size_t{48} << 20), kLimits).ok());
  // What this process has mapped and does not use is the child's, too, hence not 65.
  EXPECT_EQ(message_of(take(std::size_t{512} << 20)), "resource exhausted: ran out of its 64.0 MiB of memory");
}

TEST(LimitedChild, HasNoFilesOfTheParentAndNoStandardStreams) {
  const int file = ::open("/dev/null", O_RDONLY);
  ASSERT_GE(file, 0);
  const auto open_in_child = run_in_child(
      [](ChildOutput& out) {
        std::vector<std::uint8_t> open;
        for (int number = 4; number < 1000; ++number)
          if (::fcntl(number, F_GETFD) >= 0) open.push_back(static_cast<std::uint8_t>(number));
        out.write(open);
      },
      kLimits);
  ::close(file);
  ASSERT_TRUE(open_in_child.ok());
  EXPECT_TRUE(open_in_child->empty());
  const auto read_in = run_in_child(
      [](ChildOutput& out) {
        std::uint8_t byte = 0;
        const auto count = static_cast<std::uint8_t>(::read(STDIN_FILENO, &byte, 1) + 1);
        out.write({&count, 1});
      },
      kLimits);
  EXPECT_EQ(read_in->at(0), 1) << "standard input is at its end";
}

TEST(LimitedChild, LeavesNothingBehindAndMayBeUsedByManyThreads) {
  const std::size_t before = open_files();
  std::atomic<int> right{0};
  std::vector<std::thread> threads;
  for (std::uint8_t t = 0; t < 8; ++t) {
    threads.emplace_back([t, &right] {
      for (int i = 0; i < 5; ++i) {
        const std::vector<std::uint8_t> expected(100'000, t);
        const auto bytes = run_in_child([&](ChildOutput& out) { out.write(expected); }, kLimits);
        right += bytes.ok() && *bytes == expected;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 40);
  EXPECT_EQ(open_files(), before);
  EXPECT_FALSE(has_children());
}

TEST(LimitedChild, IsStoppedOnRequestAndIgnoresSignalsForItsParent) {
  core::Cancellation cancellation;
  cancellation.request();
  const auto stopped = run_in_child([](ChildOutput&) { ::pause(); }, kLimits, &cancellation);
  EXPECT_EQ(stopped.status().code(), StatusCode::kCancelled);
  // Ctrl-C reaches the child too, being of the same group.
  EXPECT_TRUE(run_in_child([](ChildOutput&) { ::raise(SIGINT); }, kLimits).ok());
  EXPECT_FALSE(has_children());
}

}  // namespace
}  // namespace prescene::interfaces
