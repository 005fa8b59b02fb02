// SPDX-License-Identifier: Apache-2.0
// What the program does to files and streams, its own and those of others, where something is in the way.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>
#include <thread>

#include "program.h"
#include "tests/support/paths.h"

namespace prescene::tests::outputs_test {
namespace {

constexpr const char* kScene =
    "name: box\nduration: 0.2\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\n"
    "supports:\n  floor: {ground: {size: 4}}\n"
    "objects:\n  box: {model: box, pose: {position: [{normal: [0, 0.01]}, 0, 0.05]}}\n"
    "outcomes:\n  low: {object: box, below: 0.2}\n";
constexpr const char* kCamera =
    "camera: {width: 80, height: 60, fov_deg: 55, look: {from: [0.5, -0.5, 0.5], at: [0, 0, 0]}}\n";

class Outputs : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(path("scene.yaml"), kScene);
    write_file(path("seen.yaml"), std::string(kScene) + kCamera);
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::ptrdiff_t files() const { return std::distance(std::filesystem::directory_iterator(folder_.path()), {}); }
  /// The exit code of a line of the shell in the folder, in which $P is the program.
  int shell(const std::string& line) const {
    const std::string command =
        "cd '" + folder_.path().string() + "' && P='" + (build_dir() / "prescene").string() + "'; " + line;
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  Finished predict(std::vector<std::string> more) const {
    more.insert(more.begin(), {"predict", path("scene.yaml"), "--max-instances", "16"});
    return run_program(more);
  }

  ScratchDir folder_;
};

TEST_F(Outputs, AClosedStreamIsNoFile) {
  for (const char* closed : {"<&-", ">&-", "2>&-", "<&- >&- 2>&-"}) {
    EXPECT_EQ(shell(std::string("$P record --simulate seen.yaml -o run.mcap ") + closed), 0) << closed;
    EXPECT_EQ(run_program({"replay", path("run.mcap")}).exit_code, 0) << closed;
  }
}

TEST_F(Outputs, AFileThatGetsTooLargeIsAnError) {
  const std::ptrdiff_t before = files();
  EXPECT_EQ(shell("(ulimit -f 8; exec $P predict scene.yaml --max-instances 16 --json --report r.html) >out 2>err"), 1);
  EXPECT_NE(read_file(path("out")).find("r.html: cannot be written"), std::string::npos) << read_file(path("err"));
  EXPECT_EQ(shell("(ulimit -f 8; exec $P record --simulate seen.yaml -o r.mcap) >out 2>err"), 1);
  EXPECT_NE(read_file(path("err")).find("r.mcap: cannot be written"), std::string::npos) << read_file(path("err"));
  EXPECT_EQ(files(), before + 2) << "files were left";
}

TEST_F(Outputs, AnOlderRecordingStaysUntilTheNewOneIsWhole) {
  write_file(path("old.mcap"), "precious");
  const std::ptrdiff_t before = files();
  const Finished refused = run_program({"record", "--simulate", path("scene.yaml"), "-o", path("old.mcap")});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_NE(refused.err.find("no camera"), std::string::npos) << refused.err;
  EXPECT_EQ(read_file(path("old.mcap")), "precious");
  EXPECT_EQ(files(), before);
  EXPECT_EQ(run_program({"record", "--simulate", path("seen.yaml"), "-o", path("old.mcap")}).exit_code, 0);
  EXPECT_EQ(run_program({"replay", path("old.mcap")}).exit_code, 0);
  EXPECT_EQ(files(), before);
}

// Whenever it is stopped. So long a scene is mostly still played then, before its first frame.
TEST_F(Outputs, WhatIsStoppedHoldsAFrameOrLeavesNothing) {
  std::string scene = std::string(kScene) + kCamera;
  scene.replace(scene.find("0.2"), 3, "600");
  write_file(path("long.yaml"), scene);
  const std::ptrdiff_t before = files();
  BackgroundProgram recording({"record", "--simulate", path("long.yaml"), "-o", path("stopped.mcap")});
  while (files() == before && !recording.has_ended()) std::this_thread::yield();
  EXPECT_EQ(recording.stop(SIGINT), 1);
  if (std::filesystem::exists(path("stopped.mcap"))) {
    EXPECT_EQ(run_program({"replay", path("stopped.mcap")}).exit_code, 0);
  } else {
    EXPECT_EQ(files(), before) << "something was left";
  }
}

TEST_F(Outputs, LabelsLieBesideTheSameRecording) {
  ASSERT_EQ(shell("$P record --simulate seen.yaml -o plain.mcap"), 0);
  ASSERT_EQ(shell("$P record --simulate seen.yaml -o labelled.mcap --labels labels --json > out"), 0);
  EXPECT_NE(read_file(path("out")).find(R"("labels")"), std::string::npos) << read_file(path("out"));
  EXPECT_EQ(shell("cmp plain.mcap labelled.mcap"), 0);
  EXPECT_EQ(
      shell("test -s labels/000000/rgb/000000.png -a -s labels/000000/scene_gt.json -a -s labels/models/names.json"),
      0);
  // A second run does not mix its labels with those, nor does it touch a recording.
  EXPECT_EQ(shell("$P record --simulate seen.yaml -o other.mcap --labels labels 2>err"), 2);
  EXPECT_NE(read_file(path("err")).find("labels: is not empty"), std::string::npos) << read_file(path("err"));
  EXPECT_EQ(shell("test -e other.mcap"), 1);
}

TEST_F(Outputs, PipesDevicesAndNamesThatCannotBeAreRefusedBeforeTheWork) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  std::vector<std::string> places = {path("pipe"), path(std::string(256, 'x'))};
  for (const char* folder : {"/proc", "/sys"})
    if (std::filesystem::is_directory(folder)) places.push_back(std::string(folder) + "/out");
  for (const std::string& place : places) {
    const Finished refused = predict({"--report", place});
    EXPECT_EQ(refused.exit_code, 1) << place;
    EXPECT_NE(refused.err.find(place + ": "), std::string::npos) << refused.err;
    EXPECT_EQ(refused.err.find("predicting"), std::string::npos) << "in vain: " << refused.err;
  }
  for (const std::vector<std::string>& args : std::vector<std::vector<std::string>>{
           {"record", "--simulate", path("seen.yaml")}, {"record"}, {"serve", "--scene", path("seen.yaml")}}) {
    for (const std::string& place : {path("pipe"), path("."), std::string("/dev/stdout"), std::string("/dev/null")}) {
      std::vector<std::string> with = args;
      with.insert(with.end(), {args[0] == "serve" ? "--record" : "-o", place});
      const Finished refused = run_program(with, {own_bus()});
      EXPECT_EQ(refused.exit_code, 2) << args[0] << " " << place;
      EXPECT_NE(refused.err.find("a recording is a file of its own"), std::string::npos) << refused.err;
    }
  }
  EXPECT_EQ(predict({"--report", path(std::string(255, 'x'))}).exit_code, 0);
  EXPECT_EQ(predict({"--report", "/dev/null"}).exit_code, 0);
  EXPECT_EQ(shell("$P predict scene.yaml -q --max-instances 16 --report /dev/stdout 2>err | grep -q '</html>'"), 0)
      << read_file(path("err"));
}

TEST_F(Outputs, AnOptionIsNoFileName) {
  const Finished refused = predict({"--report", "--json"});
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_NE(refused.err.find("./--json"), std::string::npos) << refused.err;
}

TEST_F(Outputs, WithFewThreadsAllowedTheWorkIsDone) {
  // The limit is for others than root.
  const std::string as_other = getuid() == 0 ? "setpriv --reuid 65534 --clear-groups " : "";
  if (shell("cd / && " + as_other + "test -x $P && prlimit --version >/dev/null") != 0)
    GTEST_SKIP() << "no other user can run the program";
  const std::string predicts = "prlimit --nproc=4 $P predict scene.yaml --max-instances 16 --threads 64 --json";
  ASSERT_EQ(shell("chmod 755 . && " + as_other + predicts + " >out 2>err"), 0) << read_file(path("err"));
  EXPECT_NE(read_file(path("err")).find("the system allows no more than"), std::string::npos) << read_file(path("err"));
}

TEST(CommandLine, OptionsAndVariablesThatMeanNothingHereAreRefused) {
  const ScratchDir folder;
  const std::string scene = (folder.path() / "seen.yaml").string();
  const std::string run = (folder.path() / "run.mcap").string();
  write_file(scene, std::string(kScene) + kCamera);
  // What needs no bus does not look at its domain.
  EXPECT_EQ(run_program({"record", "--simulate", scene, "-o", run}, {"ROS_DOMAIN_ID=foo"}).exit_code, 0);
  EXPECT_EQ(run_program({"replay", run}, {"ROS_DOMAIN_ID=foo"}).exit_code, 0);
  const std::pair<std::vector<std::string>, std::string> all[] = {
      {{"ask", "where"}, "ROS_DOMAIN_ID is 'foo'"},
      {{"record", "-o", run}, "ROS_DOMAIN_ID is 'foo'"},
      {{"serve", "--scene", scene}, "ROS_DOMAIN_ID is 'foo'"},
      {{"record", "--simulate", scene, "-o", run, "--domain", "5"}, "--domain is for recording the bus"},
      {{"record", "--simulate", scene, "-o", run, "--interface", "lo"}, "--interface is for recording the bus"},
      {{"record", "--simulate", scene, "-o", run, "--labels", run}, "is the recording's name"},
      {{"record", "--simulate", scene, "-o", run, "--labels", scene}, "is no folder"},
      {{"record", "--simulate", scene, "-o", run, "--labels", folder.path().string()}, "is not empty"},
      {{"record", "-o", run, "--labels", folder.path().string()}, "--simulate"},
      {{"replay", run, "--domain", "5"}, "--domain is for --over-dds"},
      {{"replay", run, "--peer", "10.0.0.2"}, "--peer is for --over-dds"},
      {{"ask", "where", "--domain", "5", "--interface", "no such"}, "'no such' is no network interface"},
      {{"replay", run, "--frame-rate", "3"}, "--frame-rate is for folders"},
      {{"replay", run, "--depth-scale", "9"}, "--depth-scale is for folders"},
      {{"ask", "where", "--question", "{}"}, "leave one of them out"},
      {{"ask", "--question", "{\"predict\": {\"duration\": 1e400}}"}, "a number is out of range"},
      {{"ask", "--question", "{\"id\": \"\\ud800\"}"}, "half of a character"},
      {{"predict", scene, "--duration", "1e-13"}, "the least is 1e-12"}};
  for (const auto& [arguments, reason] : all) {
    const Finished finished = run_program(arguments, {"ROS_DOMAIN_ID=foo"});
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find(reason), std::string::npos) << finished.err;
  }
  EXPECT_NE(run_program({"ask", "--help"}).out.find("default: 15"), std::string::npos)
      << "more than the 12 s in which a service ends a question";
}

}  // namespace
}  // namespace prescene::tests::outputs_test
