// SPDX-License-Identifier: Apache-2.0
// A whole session with processes of its own: record, serve, replay over DDS, ask, kill and start again.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "prescene/interfaces/images/png.h"
#include "program.h"
#include "tests/support/paths.h"

namespace prescene::tests::session_test {
namespace {

using nlohmann::ordered_json;

// Small, so that the processes keep up on any machine.
constexpr const char* kScene = R"(name: box_on_table
duration: 2.5
models:
  box:
    box: [0.12, 0.08, 0.1]
    mass: 0.4
    color: [0.8, 0.3, 0.2]
supports:
  table:
    box: [0.8, 0.8, 0.04]
    pose: {position: [0, 0, -0.02]}
objects:
  box:
    model: box
    pose:
      position: [0.02, 0.03, 0.05]
      normal: {position: [0.01, 0.01, 0], rotation_deg: [0, 0, 10]}
camera:
  width: 160
  height: 120
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
outcomes:
  stays: {object: box, resting_on: table}
)";

ordered_json parsed(const Finished& finished) {
  ordered_json json = ordered_json::parse(finished.out, nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << finished.out << finished.err;
  return json;
}

/// What `replay --json` prints but for how long each step took.
ordered_json without_times(ordered_json replayed) {
  for (ordered_json& step : replayed["steps"]) EXPECT_EQ(step.erase("seconds"), 1u);
  return replayed;
}

class Session : public ::testing::Test {
 protected:
  void SetUp() override {
    write_file(path("scene.yaml"), kScene);
    const Finished recorded =
        run_program({"record", "--simulate", path("scene.yaml"), "-o", path("run.mcap"), "--rate", "8", "--seed", "4"});
    ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  ScratchDir folder_;
  std::vector<std::string> bus_ = {own_bus()};
};

TEST_F(Session, ARecordingTracksToTheSameBytesOnAnyThreads) {
  const Finished one =
      run_program({"replay", path("run.mcap"), "--json", "--threads", "1", "--report", path("run.html")});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  const Finished two = run_program({"replay", path("run.mcap"), "--json", "--threads", "2"});
  const ordered_json json = without_times(parsed(one));
  EXPECT_EQ(json, without_times(parsed(two)));
  EXPECT_GE(json["steps"].size(), 19u);
  EXPECT_LT(json["tracking"][0]["median_position_error_m"].get<double>(), 0.01) << json["tracking"].dump();
  EXPECT_NE(read_file(path("run.html")).find("<img"), std::string::npos);
}

TEST_F(Session, InspectShowsAFrameAndWhyItsPosesAreBelieved) {
  const Finished found = run_program({"inspect", path("run.mcap"), "--frame", "6", "--overlay", path("seen.png"),
                                      "--likelihood-map", path("why.png"), "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const ordered_json json = parsed(found);
  const ordered_json& box = json["objects"][0];
  EXPECT_EQ(box["name"], "box");
  EXPECT_GT(box["evidence"]["log_ratio"].get<double>(), 100.0);
  EXPECT_GT(box["evidence"]["hit_share"].get<double>(), 0.8);
  // The belief is that of the replay's step.
  const ordered_json replayed = parsed(run_program({"replay", path("run.mcap"), "--json"}));
  EXPECT_EQ(replayed["steps"][6]["objects"][0]["pose"], box["pose"]);
  EXPECT_EQ(replayed["steps"][6]["stamp_ns"], json["stamp_ns"]);

  const auto seen = interfaces::read_png_color(path("seen.png"));
  const auto why = interfaces::read_png_color(path("why.png"));
  ASSERT_TRUE(seen && why);
  EXPECT_EQ(seen->width(), 160);
  EXPECT_EQ(seen->height(), 120);
  // Orange speaks for the pose: most of what is coloured is.
  int orange = 0, blue = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < why->width(); ++x) {
      const geometry::Rgb& c = (*why)(x, y);
      orange += c[0] > c[2] + 30;
      blue += c[2] > c[0] + 30;
    }
  }
  EXPECT_GT(orange, 200);
  EXPECT_LT(blue, orange / 4);
}

TEST_F(Session, AMeasuredDepthNoiseGoesIntoTheSceneFile) {
  // The scene's own camera, from above, twice as noisy as the default.
  std::string scene = kScene;
  scene.replace(scene.find("from: [0.55, -0.5, 0.5]"), 23, "from: [0.0, -0.2, 0.7]");
  write_file(path("noisy.yaml"), scene + "depth_noise: {sigma_per_depth_squared: 0.008}\n");
  ASSERT_EQ(
      run_program({"record", "--simulate", path("noisy.yaml"), "-o", path("still.mcap"), "--rate", "12"}).exit_code, 0);
  const Finished found = run_program({"inspect", path("still.mcap"), "--depth-noise", "--json"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const double sigma = parsed(found)["settings"]["sigma_per_depth_squared"].get<double>();
  EXPECT_NEAR(sigma, 0.008, 0.1 * 0.008);

  const std::string printed = run_program({"inspect", path("still.mcap"), "--depth-noise"}).out;
  const std::size_t begin = printed.find("depth_noise:\n");
  ASSERT_NE(begin, std::string::npos) << printed;
  write_file(path("measured.yaml"), scene + printed.substr(begin, printed.find("\n\n", begin) - begin) + "\n");
  const Finished valid = run_program({"validate", path("measured.yaml")});
  EXPECT_EQ(valid.exit_code, 0) << valid.out << valid.err;
  EXPECT_EQ(run_program({"replay", path("still.mcap"), "--scene", path("measured.yaml"), "--json"}).exit_code, 0);
}

TEST_F(Session, InspectSaysWhatIsAmiss) {
  const auto refused = [&](std::vector<std::string> args, const std::string& reason) {
    args.insert(args.begin(), "inspect");
    const Finished finished = run_program(args);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_NE(finished.err.find(reason), std::string::npos) << finished.err;
  };
  refused({path("run.mcap"), "--frame", "1000"}, "there is no frame 1000: it has ");
  refused({path("run.mcap"), "--density", "500"}, "--density is for meshes");
  refused({path("none.ply"), "--overlay", path("x.png")}, "--overlay is for recordings");
  refused({path("run.mcap"), "--overlay", path("run.mcap")}, "is the input too");
  refused({path("run.mcap"), "--overlay", path("a.png"), "--likelihood-map", path("./a.png")}, "name the same file");
}

TEST_F(Session, ACutRecordingIsReadToItsLastWholeMessage) {
  const std::string whole = read_file(path("run.mcap"));
  write_file(path("cut.mcap"), whole.substr(0, whole.size() * 6 / 10));
  const Finished finished = run_program({"replay", path("cut.mcap"), "--json"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const ordered_json json = parsed(finished);
  EXPECT_GT(json["steps"].size(), 3u);
  EXPECT_FALSE(json["loss"].get<std::string>().empty());
  write_file(path("noise.mcap"), "this is no recording");
  EXPECT_EQ(run_program({"replay", path("noise.mcap")}).exit_code, 2);
}

TEST_F(Session, ReplaysWithTheSettingsThatItWasRecordedWith) {
  {
    // No tf knows this frame, so the camera is where the command line says.
    BackgroundProgram service({"serve", "--scene", path("scene.yaml"), "--record", path("session.mcap"),
                               "--world-frame", "hall", "--camera-pose", "0", "0", "0.9", "0", "1", "0", "0"},
                              bus_);
    const Finished played = run_program({"replay", path("run.mcap"), "--over-dds", "--json"}, bus_);
    EXPECT_EQ(played.exit_code, 0) << played.err;
    EXPECT_EQ(service.stop(SIGINT), 0);
  }
  const Finished again = run_program({"replay", path("session.mcap"), "--json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_GT(parsed(again)["compared_steps"].get<int>(), 3);
  EXPECT_EQ(parsed(again)["different_steps"], 0);
  // Where the camera is makes the belief, so another place is another belief.
  const Finished elsewhere =
      run_program({"replay", path("session.mcap"), "--camera-pose", "0", "0", "0.8", "0", "1", "0", "0"});
  EXPECT_EQ(elsewhere.exit_code, 1) << elsewhere.out;
}

TEST_F(Session, AReplayWithoutAFrameOfUseSaysWhy) {
  const Finished unconnected = run_program({"replay", path("run.mcap"), "--world-frame", "hall", "--json"});
  EXPECT_EQ(unconnected.exit_code, 2) << unconnected.out;
  EXPECT_NE(unconnected.err.find("hall"), std::string::npos) << unconnected.err;
  const Finished unnamed = run_program({"replay", path("run.mcap"), "--depth-topic", "/nobody/depth"});
  EXPECT_EQ(unnamed.exit_code, 2) << unnamed.out;
  EXPECT_NE(unnamed.err.find("/nobody/depth"), std::string::npos) << unnamed.err;
}

TEST_F(Session, ServesAnswersSurvivesBeingKilledAndReplaysItsSessionBitForBit) {
  // A busy machine may take its time for a question.
  const std::vector<std::string> serve = {
      "serve", "--scene", path("scene.yaml"), "--question-seconds", "10", "--most-question-seconds", "60"};
  const std::vector<std::string> replay = {"replay", path("run.mcap"), "--over-dds",
                                           "--json", "--ask",          R"(1.0:{"where": {}})"};
  {
    BackgroundProgram service(serve, bus_);
    const Finished played = run_program(replay, bus_);
    EXPECT_EQ(played.exit_code, 0) << played.err;
    EXPECT_GT(parsed(played)["beliefs"].get<int>(), 0);
    const Finished asked = run_program({"ask", "stability", "box", "--json"}, bus_);
    ASSERT_EQ(asked.exit_code, 0) << asked.err;
    EXPECT_GT(parsed(asked)["stability"]["stable"]["probability"].get<double>(), 0.8) << asked.out;
    EXPECT_EQ(run_program({"ask", "stability", "nobody"}, bus_).exit_code, 2);
    const Finished viewed = run_program({"ask", "--question", R"({"view": {"time": 0}})"}, bus_);
    EXPECT_EQ(viewed.exit_code, 0) << viewed.err;
    EXPECT_NE(viewed.out.find("--images FOLDER writes them"), std::string::npos) << viewed.out.substr(0, 2000);
    EXPECT_LT(viewed.out.size(), 5000u) << "images are left out of the text";
    // A question that is refused, and one for a time after the recording's end.
    const Finished refused = run_program({"replay", path("run.mcap"), "--over-dds", "--json", "--speed", "10", "--ask",
                                          R"(1e9:{"stability": {"object": "nobody"}})"},
                                         bus_);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_NE(refused.err.find("it is asked now"), std::string::npos) << refused.err;
    EXPECT_LT(parsed(refused)["answers"][0]["at"].get<double>(), 60.0) << refused.out;
    EXPECT_EQ(service.stop(SIGKILL), 128 + SIGKILL);
  }
  {
    std::vector<std::string> recording_serve = serve;
    recording_serve.insert(recording_serve.end(), {"--record", path("session.mcap")});
    BackgroundProgram service(recording_serve, bus_);
    const Finished played = run_program(replay, bus_);
    EXPECT_EQ(played.exit_code, 0) << played.err;
    const ordered_json json = parsed(played);
    EXPECT_LT(json["tracking"][0]["median_position_error_m"].get<double>(), 0.01) << json["tracking"].dump();
    ASSERT_EQ(json["answers"].size(), 1u);
    EXPECT_EQ(json["answers"][0]["answer"]["where"]["items"][0]["object"], "box");
    // Played again, the clock goes back, and the box is tracked from there.
    const ordered_json second = parsed(run_program(replay, bus_));
    EXPECT_GT(second["tracking"][0]["frames"].get<int>(), 3) << second["tracking"].dump();
    EXPECT_LT(second["tracking"][0]["median_position_error_m"].get<double>(), 0.01) << second["tracking"].dump();
    const Finished why =
        run_program({"ask", "--json", "--question",
                     R"({"explain": {"object": "box", "last": 0.5, "points": 8, "runs": 2}})", "--timeout", "30"},
                    bus_);
    ASSERT_EQ(why.exit_code, 0) << why.err;
    EXPECT_EQ(parsed(why)["explain"]["explanations"][0]["event"], "nothing") << why.out;
    const Finished reasons =
        run_program({"ask", "why", "box", "--against", "absence", "--images", path("why"), "--json"}, bus_);
    ASSERT_EQ(reasons.exit_code, 0) << reasons.err;
    EXPECT_GT(parsed(reasons)["why"]["comparisons"][0]["tempered"].get<double>(), 1.0) << reasons.out;
    EXPECT_FALSE(std::filesystem::is_empty(path("why")));
    EXPECT_EQ(run_program({"ask", "why", "bx"}, bus_).exit_code, 2);
    const Finished too_early = run_program({"ask", "explain", "--last", "500"}, bus_);
    EXPECT_EQ(too_early.exit_code, 2) << too_early.out;
    EXPECT_NE(too_early.err.find("the history holds"), std::string::npos) << too_early.err;
    EXPECT_EQ(service.stop(SIGINT), 0);
  }
  const Finished again = run_program({"replay", path("session.mcap"), "--json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  const ordered_json json = parsed(again);
  EXPECT_TRUE(json["followed_step_records"].get<bool>());
  EXPECT_GT(json["compared_steps"].get<int>(), 0);
  EXPECT_EQ(json["different_steps"], 0);
  EXPECT_EQ(json["compared_explanations"], 2);  // what happened, and why
  EXPECT_EQ(json["different_explanations"], 0) << again.err;
  // The service's own settings are in the recording, and explain has fewer options than replay to replace them by.
  const Finished explained = run_program(
      {"explain", path("session.mcap"), "--from", "0.1", "--to", "0.6", "--points", "8", "--runs", "2", "--json"});
  EXPECT_EQ(explained.exit_code, 0) << explained.err;
}

TEST_F(Session, AskingNobodySaysSo) {
  const Finished asked = run_program({"ask", "where", "--timeout", "0.3"}, bus_);
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_NE(asked.err.find("prescene serve"), std::string::npos) << asked.err;
}

}  // namespace
}  // namespace prescene::tests::session_test
