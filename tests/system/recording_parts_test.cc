// SPDX-License-Identifier: Apache-2.0
// A recording in several files, as a script replays it: the exit code says whether all of it was there.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "prescene/service/recording/rolling_recording.h"
#include "program.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::tests::recording_parts_test {
namespace {

/// The messages of a robot in files of ten each.
void record_in_parts(const std::filesystem::path& robot, const std::filesystem::path& first) {
  const auto reader = service::RecordingReader::open(robot);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  const auto recording = service::RollingRecording::create(first, (*reader)->info());
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  std::size_t messages = 0;
  for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next()) {
    if ((*entry)->is_json) continue;
    if (++messages % 10 == 0) {
      (*recording)->ask_for_change();
      while (!(*recording)->is_change_due()) std::this_thread::yield();
      (*recording)->change(nullptr);
    }
    (*recording)->write((*entry)->message);
  }
  ASSERT_TRUE((*recording)->close().ok());
  ASSERT_GE((*recording)->state().files, 4u);
}

TEST(RecordingParts, ReplayEndsWithTwoWhereAFileIsMissing) {
  const ScratchDir folder;
  const auto path = [&folder](const std::string& name) { return folder.path() / name; };
  const std::string scene = box_on_table("1.0");
  ASSERT_TRUE(record_scene(scene, {"box.yaml", scene, 1, ""}, 15.0, path("robot.mcap")).ok());
  record_in_parts(path("robot.mcap"), path("run.mcap"));
  const auto replay = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"replay", path("run.mcap").string(), "--json"});
    const Finished finished = run_program(more);
    return std::pair(finished.exit_code, nlohmann::json::parse(finished.out, nullptr, false));
  };
  const auto [whole, all] = replay({"--all-parts"});
  EXPECT_EQ(whole, 0);
  EXPECT_EQ(all.value("missing", "-"), "");

  std::filesystem::remove(path("run_0002.mcap"));
  const auto [code, rest] = replay({"--all-parts"});
  EXPECT_EQ(code, 2);
  EXPECT_EQ(rest.value("missing", ""), "run_0003.mcap: 10 messages before it are not there");
  EXPECT_GT(rest.value("messages", 0), 30) << "what is there is played all the same";
  EXPECT_EQ(replay({"--all-parts", "--salvage"}).first, 0) << "what is there was asked for";
  EXPECT_EQ(replay({}).first, 0) << "the first file alone was asked for";
}

TEST(RecordingParts, ASlashAtTheEndMakesABag) {
  const ScratchDir folder;
  const auto path = [&folder](const std::string& name) { return (folder.path() / name).string(); };
  write_file(path("box.yaml"), box_on_table("0.5"));
  const auto record = [&](const std::string& output) {
    return run_program({"record", "--simulate", path("box.yaml"), "-o", output, "--rate", "8", "--json"});
  };
  const auto steps_of = [&](const std::string& recording) {
    const Finished replayed = run_program({"replay", recording, "--json"});
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    auto steps = nlohmann::json::parse(replayed.out, nullptr, false)["steps"];
    for (auto& step : steps) step.erase("seconds");
    return steps;
  };
  EXPECT_EQ(record(path("run.mcap")).exit_code, 0);
  const Finished recorded = record(path("bag/"));
  EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
  EXPECT_EQ(nlohmann::json::parse(recorded.out)["recording"], path("bag/bag_0.mcap"));
  EXPECT_TRUE(std::filesystem::exists(path("bag/metadata.yaml")));
  EXPECT_EQ(read_file(path("bag/bag_0.mcap")), read_file(path("run.mcap")));
  EXPECT_EQ(steps_of(path("bag")), steps_of(path("run.mcap")));
  EXPECT_GT(steps_of(path("bag")).size(), 2u);

  const Finished again = record(path("bag/"));
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("is there already"), std::string::npos) << again.err;
  EXPECT_EQ(record(path("run.mcap/")).exit_code, 2);
  EXPECT_EQ(record(path("none/bag/")).exit_code, 1);
  const Finished bounded = run_program({"record", "-o", path("live/"), "--keep-megabytes", "50"}, {own_bus()});
  EXPECT_EQ(bounded.exit_code, 2);
  EXPECT_NE(bounded.err.find("--keep-megabytes"), std::string::npos) << bounded.err;
}

// As `ros2 bag record`, but for a folder that is there: what a robot saw is not written over, nor refused.
TEST(RecordingParts, ALiveBagIsClosedByCtrlCAndTakesAnotherNameWhereItsOwnIsTaken) {
  const ScratchDir folder;
  std::filesystem::create_directory(folder.path() / "bag");
  BackgroundProgram recorder({"record", "-o", (folder.path() / "bag/").string()}, {own_bus()});
  const std::filesystem::path bag = folder.path() / "bag-2";
  while (!std::filesystem::exists(bag / "bag-2_0.mcap") && !recorder.has_ended()) std::this_thread::yield();
  EXPECT_EQ(recorder.stop(SIGINT), 0);
  EXPECT_TRUE(std::filesystem::exists(bag / "metadata.yaml"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path() / "bag"));
}

}  // namespace
}  // namespace prescene::tests::recording_parts_test
