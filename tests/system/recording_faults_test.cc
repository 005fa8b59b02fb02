// SPDX-License-Identifier: Apache-2.0
// The service and its recording when the program is killed, the power fails, the disk is full, and there are no rights,
// descriptors or memory. What is promised, and the figures: docs/reference/reliability.md, whose command is
// `./dev faults`. Without PRESCENE_FAULTS=full, a few cases of each.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>

#include "service_on_bus.h"
#include "tests/support/sanitizers.h"

namespace prescene::tests::recording_faults_test {
namespace {

using std::chrono::steady_clock;

// s; what a program that is killed may lose of a recording, and a power failure.
constexpr double kMostLostKilled = 0.5;
constexpr double kMostLostUnpowered = 1.0;

/// Of a process that runs; its hard limit stays.
bool set_limit(pid_t pid, __rlimit_resource resource, rlim_t value) {
  rlimit limit{};
  if (prlimit(pid, resource, nullptr, &limit) != 0) return false;
  limit.rlim_cur = std::min(value, limit.rlim_max);
  return prlimit(pid, resource, &limit, nullptr) == 0;
}

class RecordingFaults : public ServiceOnBus {
 protected:
  /// Starts, tracks, and kills at the i-th of n moments of 2.4 s; at the last one not before `bytes`, of the recording
  /// or of what the disk has of it, has changed three times: what was recorded with the first belief is among them
  /// then, however long a busy machine takes. When it was killed, by the wall clock.
  core::TimeNs killed(const std::string& file, int i, int n, const std::vector<std::string>& environment,
                      const std::function<std::int64_t()>& bytes) {
    const auto service = serve({"--record", file}, "", environment);
    EXPECT_TRUE(tracks(*service)) << log();
    first_ns_ = core::wall_now_ns();
    std::set<std::int64_t> seen = {bytes()};
    drive_for(2.4 * i / n);
    EXPECT_TRUE(drive([&] {
      seen.insert(bytes());
      return i + 1 < n || seen.size() > 3;
    })) << log();
    const core::TimeNs killed_ns = core::wall_now_ns();
    EXPECT_EQ(service->stop(SIGKILL), 128 + SIGKILL) << log();
    return killed_ns;
  }

  /// s of frames that are not in the recording. Where there is no frame, since the first belief.
  double lost(const ReadBack& read, core::TimeNs killed_ns) const {
    return core::seconds_of(killed_ns - (read.frames > 0 ? read.newest_frame_ns : first_ns_));
  }

  /// The environment in which noted() is filled.
  std::vector<std::string> noting_syncs() {
    write_file(path("noted"), std::string(2 * sizeof(std::int64_t), '\0'));
    return {"PRESCENE_TEST_SYNC_FILE=" + path("noted"),
            "LD_PRELOAD=" + (build_dir() / "tests" / "libnoted_syncs.so").string()};
  }
  /// How many bytes of the recording are on the disk for certain, and how many files got a name before their content
  /// was.
  std::array<std::int64_t, 2> noted() {
    std::array<std::int64_t, 2> numbers{};
    const std::string bytes = read_file(path("noted"));
    if (bytes.size() == sizeof numbers) std::memcpy(numbers.data(), bytes.data(), sizeof numbers);
    return numbers;
  }

  core::TimeNs first_ns_ = 0;
};

TEST_F(RecordingFaults, KilledAtAnyMomentItOpensAgainAndReplays) {
  const int moments = is_full_run() ? 50 : 3;
  std::vector<double> seconds;
  int steps = 0, empty = 0;
  for (int i = 0; i < moments; ++i) {
    const std::string file = path("killed-" + std::to_string(i) + ".mcap");
    const core::TimeNs killed_ns =
        killed(file, i, moments, {}, [&file] { return static_cast<std::int64_t>(std::filesystem::file_size(file)); });
    const ReadBack read = read_back(file);
    seconds.push_back(lost(read, killed_ns));
    if (read.frames == 0)
      ++empty;
    else
      steps += replay(file);
  }
  EXPECT_GT(steps, 0);
  if (is_full_run()) {
    EXPECT_LE(*std::max_element(seconds.begin(), seconds.end()), kMostLostKilled);
  }
  std::printf("compared: killed: s of the recording lost: %s; %d steps replayed to the same bits; %d without a frame\n",
              spread_text(seconds).c_str(), steps, empty);
}

TEST_F(RecordingFaults, KilledWhileItGoesOnInNewFilesEachOpensAgainAndReplays) {
  const int moments = is_full_run() ? 20 : 2;
  std::vector<double> seconds;
  int steps = 0, files = 0;
  for (int i = 0; i < moments; ++i) {
    const std::string file = path("parts-" + std::to_string(i) + ".mcap");
    const auto service = serve({"--record", file, "--part-seconds", "0.4"});
    ASSERT_TRUE(tracks(*service)) << log();
    first_ns_ = core::wall_now_ns();
    drive_for(1.5 + 0.4 * i / moments);
    const std::filesystem::path third = service::part_path(file, 2);  // a busy machine may come to it later
    EXPECT_TRUE(drive([&] { return std::filesystem::exists(third); })) << log();
    const core::TimeNs killed_ns = core::wall_now_ns();
    EXPECT_EQ(service->stop(SIGKILL), 128 + SIGKILL) << log();
    ReadBack newest = read_back(file);
    EXPECT_GT(newest.frames, 0u);
    const auto reader = service::RecordingReader::open(file);
    ASSERT_TRUE(reader.ok());
    for (const std::filesystem::path& next : service::parts_after(file, (*reader)->info().part)) {
      ++files;
      const ReadBack read = read_back(next.string());
      if (read.newest_frame_ns > newest.newest_frame_ns) newest = read;
    }
    seconds.push_back(lost(newest, killed_ns));
    const int together = replay(file, {"--all-parts"});
    EXPECT_GT(together, 0);
    steps += together;
  }
  EXPECT_GE(files, moments);
  std::printf(
      "compared: killed while it goes on in new files: s lost: %s; %d files after the first of %d recordings; "
      "%d steps replayed to the same bits\n",
      spread_text(seconds).c_str(), files, moments, steps);
}

TEST_F(RecordingFaults, WhereThePowerFailsWhatTheDiskKeptOpensAgainAndReplays) {
  if (PRESCENE_SANITIZES_MEMORY) GTEST_SKIP() << "nothing can be preloaded before the sanitizer";
  const int moments = is_full_run() ? 25 : 2;
  std::vector<double> seconds;
  int steps = 0;
  for (int i = 0; i < moments; ++i) {
    const std::string file = path("power-" + std::to_string(i) + ".mcap");
    const core::TimeNs failed_ns = killed(file, i, moments, noting_syncs(), [this] { return noted()[0]; });
    const std::int64_t kept = noted()[0];
    const auto written = static_cast<std::int64_t>(std::filesystem::file_size(file));
    ASSERT_LE(kept, written);
    if (kept == 0) {  // so soon that the disk had nothing
      seconds.push_back(core::seconds_of(failed_ns - first_ns_));
      continue;
    }
    // The file ends there, or has its length but not its content.
    std::filesystem::resize_file(file, static_cast<std::uintmax_t>(kept));
    const ReadBack read = read_back(file);
    seconds.push_back(lost(read, failed_ns));
    std::filesystem::resize_file(file, static_cast<std::uintmax_t>(written));
    EXPECT_EQ(read_back(file).frames, read.frames);
    if (read.frames > 0) steps += replay(file);
  }
  EXPECT_GT(steps, 0);
  if (is_full_run()) {
    EXPECT_LE(*std::max_element(seconds.begin(), seconds.end()), kMostLostUnpowered);
  }
  std::printf("compared: power: s of the recording lost at most: %s; %d steps replayed to the same bits\n",
              spread_text(seconds).c_str(), steps);
}

TEST_F(RecordingFaults, WhereThePowerFailsTheLearnedFileIsWhole) {
  if (PRESCENE_SANITIZES_MEMORY) GTEST_SKIP() << "nothing can be preloaded before the sanitizer";
  const auto service = serve({"--learned", path("learned.yaml")}, "", noting_syncs());
  ASSERT_TRUE(tracks(*service)) << log();
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  EXPECT_GT(std::filesystem::file_size(path("learned.yaml")), 0u);
  EXPECT_EQ(noted()[1], 0) << "files that a power failure may leave empty: serve would not start with one";
}

TEST_F(RecordingFaults, AFullDiskEndsTheRecordingAndNothingElse) {
  const std::string file = path("full.mcap");
  const auto service = serve({"--record", file});
  ASSERT_TRUE(tracks(*service)) << log();
  ASSERT_TRUE(set_limit(service->pid(), RLIMIT_FSIZE, std::filesystem::file_size(file) + 30'000));
  const auto recording = [&] { return robot_->diagnostics()["recording"]; };
  ASSERT_TRUE(drive([&] { return recording().starts_with("failed"); })) << recording();
  EXPECT_NE(recording().find("free some space"), std::string::npos) << recording();
  EXPECT_TRUE(tracks(*service)) << log();
  EXPECT_EQ(service->stop(SIGINT), 1) << log();
  const ReadBack read = read_back(file);
  EXPECT_GT(read.frames, 0u);
  const int steps = replay(file);
  std::printf("compared: full disk: recording '%s'; tracking went on; %zu frames are readable, %d steps replayed\n",
              recording().c_str(), read.frames, steps);
}

TEST_F(RecordingFaults, AFullDiskThatHasRoomAgainIsRecordedTo) {
  if (!is_full_run()) GTEST_SKIP() << "a new file is tried every 10 s only; the laws of RollingRecording wait for none";
  const std::string file = path("room.mcap");
  const auto service = serve({"--record", file});
  ASSERT_TRUE(tracks(*service)) << log();
  ASSERT_TRUE(set_limit(service->pid(), RLIMIT_FSIZE, std::filesystem::file_size(file) + 30'000));
  const auto recording = [&] { return robot_->diagnostics()["recording"]; };
  ASSERT_TRUE(drive([&] { return recording().starts_with("failed"); })) << recording();
  ASSERT_TRUE(set_limit(service->pid(), RLIMIT_FSIZE, RLIM_INFINITY));
  const core::Stopwatch watch;
  ASSERT_TRUE(drive([&] { return recording() == "on"; })) << recording();
  const double seconds = watch.seconds();
  EXPECT_TRUE(tracks(*service)) << log();
  const std::string lost = robot_->diagnostics()["messages not recorded"];
  EXPECT_EQ(service->stop(SIGINT), 1) << log();
  const std::string next = service::part_path(file, 1).string();
  const int before = replay(file), after = replay(next);
  EXPECT_GT(after, 0);
  EXPECT_EQ(replay(file, {"--all-parts"}), before + after);
  std::printf(
      "compared: full disk that has room again: recorded to after %.1f s, %s messages were not; %d steps before "
      "and %d after it replayed to the same bits\n",
      seconds, lost.c_str(), before, after);
}

TEST_F(RecordingFaults, AFolderWithoutRightsIsRefusedAtTheStart) {
  std::filesystem::create_directory(path("sealed"));
  std::filesystem::permissions(path("sealed"), std::filesystem::perms(0555));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms(0755));
  // Rights do not hold root back.
  const bool is_root = geteuid() == 0;
  const std::vector<std::string> serve_args = {"serve", "--scene", path("scene.yaml")};
  for (const std::string option : {"--record", "--learned"}) {
    std::vector<std::string> args = {
        "-c",
        std::string(is_root ? "exec setpriv --reuid=65534 --regid=65534 --clear-groups" : "exec") + " \"$0\" \"$@\"",
        (build_dir() / "prescene").string()};
    args.insert(args.end(), serve_args.begin(), serve_args.end());
    args.insert(args.end(), {option, path("sealed/file")});
    BackgroundProgram service("/bin/sh", args, {"ROS_DOMAIN_ID=" + std::to_string(domain_)}, path("sealed.log"));
    if (!drive([&] { return service.has_ended(); })) {
      ADD_FAILURE() << option << ": it runs although its file can't be written: " << robot_->diagnosis();
      continue;
    }
    EXPECT_EQ(service.stop(SIGKILL), 1) << read_file(path("sealed.log"));
    const std::string said = read_file(path("sealed.log"));
    EXPECT_NE(said.find("choose another folder"), std::string::npos) << option << ": " << said;
  }
}

/// What became of services that were started with too little: by exit code, the limits. 0: it tracked and was stopped.
class ScarceStart : public RecordingFaults {
 protected:
  /// `may_be_ended`: by a signal, or by the system's loader (127), as libraries end a program that has no memory.
  void start_with(const std::string& limit, std::int64_t value, bool may_be_ended) {
    const std::string text = limit + " " + std::to_string(value);
    const auto service = serve({}, text);
    const bool tracked = tracks(*service);
    const bool ended = service->has_ended();
    EXPECT_TRUE(tracked || ended) << text << ": it neither tracks nor ends: " << log();
    const int code = service->stop(SIGINT);
    if (!may_be_ended) {
      EXPECT_TRUE(code == 0 || code == 1 || code == 2) << text << ": exit code " << code << ": " << log();
      EXPECT_TRUE(tracked || !log().empty()) << text << ": it ended without a word";
    }
    came_[code].push_back(value);
  }

  std::string came_text() const {
    std::string text;
    for (const auto& [code, values] : came_)
      text += (text.empty() ? "" : "; ") + std::string("exit code ") + std::to_string(code) + " at " +
              std::to_string(values.front()) + " to " + std::to_string(values.back()) + " (" +
              std::to_string(values.size()) + ")";
    return text;
  }

  std::map<int, std::vector<std::int64_t>> came_;
};

TEST_F(ScarceStart, WithoutDescriptorsItSaysSo) {
  std::vector<std::int64_t> limits = {12, 20, 50};
  if (is_full_run()) {
    limits.clear();
    for (int i = 10; i <= 50; ++i) limits.push_back(i);
  }
  for (const std::int64_t limit : limits) start_with("ulimit -n", limit, false);
  std::printf("compared: descriptors at the start: %s\n", came_text().c_str());
}

TEST_F(ScarceStart, WithoutMemoryItTracksOrEnds) {
  if (PRESCENE_SANITIZES_MEMORY) GTEST_SKIP() << "a sanitizer takes terabytes of addresses";
  std::vector<std::int64_t> limits = {60'000, 2'000'000};  // kB of addresses
  if (is_full_run()) {
    limits.clear();
    for (int i = 20'000; i <= 300'000; i += 5'000) limits.push_back(i);
  }
  for (const std::int64_t limit : limits) start_with("ulimit -v", limit, true);
  std::printf("compared: kB of addresses at the start: %s\n", came_text().c_str());
}

TEST_F(RecordingFaults, MemoryThatEndsIsToldAndComesBack) {
  if (PRESCENE_SANITIZES_MEMORY) GTEST_SKIP() << "a sanitizer has an allocator of its own";
  std::string came;
  const std::vector<std::int64_t> spare =
      is_full_run() ? std::vector<std::int64_t>{0, 1, 4, 16, 64} : std::vector<std::int64_t>{4};
  for (const std::int64_t megabytes : spare) {
    const auto service = serve({"--record", path("scarce.mcap")});
    ASSERT_TRUE(tracks(*service)) << log();
    const std::int64_t used = process_kilobytes(service->pid(), "VmSize") << 10;
    ASSERT_TRUE(set_limit(service->pid(), RLIMIT_AS, static_cast<rlim_t>(used + (megabytes << 20))));
    for (int i = 0; i < 6; ++i) {
      robot_->ask(R"({"id": "m)" + std::to_string(megabytes) + "-" + std::to_string(i) +
                  R"(", "stability": {"object": "box"}})");
      drive_for(0.3);
    }
    came += "; " + std::to_string(megabytes) + " MB more: ";
    if (service->has_ended()) {
      const int code = service->stop(SIGKILL);
      // A library that can't go on without memory aborts: the supervisor starts it again.
      EXPECT_EQ(code, 128 + SIGABRT) << log();
      came += "ended by signal";
      continue;
    }
    ASSERT_TRUE(set_limit(service->pid(), RLIMIT_AS, RLIM_INFINITY));
    EXPECT_TRUE(tracks(*service)) << log();
    came += "went on, " + robot_->diagnostics()["failures"] + " failures counted";
    const int code = service->stop(SIGINT);
    EXPECT_TRUE(code == 0 || code == 1) << code << log();
  }
  std::printf("compared: memory that ends while it runs%s\n", came.c_str());
}

TEST_F(RecordingFaults, DescriptorsThatEndWhileItRunsTakeNothing) {
  const auto service = serve({"--record", path("fd.mcap"), "--view", "0"});
  ASSERT_TRUE(tracks(*service)) << log();
  ASSERT_TRUE(set_limit(service->pid(), RLIMIT_NOFILE, 3));
  robot_->ask(R"({"id": "fd", "stability": {"object": "box"}})");
  ASSERT_TRUE(drive([&] {
    const auto answers = robot_->answers();
    return std::any_of(answers.begin(), answers.end(),
                       [](const std::string& text) { return text.find("\"fd\"") != std::string::npos; });
  }));
  EXPECT_TRUE(tracks(*service)) << log();
  const std::string failures = robot_->diagnostics()["failures"];
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  replay(path("fd.mcap"));
  std::printf("compared: descriptors that end while it runs: tracking and answers went on, %s failures counted\n",
              failures.c_str());
}

}  // namespace
}  // namespace prescene::tests::recording_faults_test
