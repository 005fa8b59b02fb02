// SPDX-License-Identifier: Apache-2.0
// What damaged and hostile recordings may take, and what `replay` says about the sound ones.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"
#include "program.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

constexpr std::int64_t kGigabyte = 1'000'000'000;
constexpr core::TimeNs kStart = 1'000'000'000'000'000'000;
constexpr core::TimeNs kFrame = 100'000'000;

constexpr const char* kScene = R"(name: box
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.05]}}
)";

/// A robot's recording, by hand: a camera that looks straight down from 1 m at images of one depth and one colour.
class HandRecording {
 public:
  explicit HandRecording(const std::filesystem::path& path) {
    auto writer = service::RecordingWriter::create(path, {"box.yaml", kScene, 1, ""});
    EXPECT_TRUE(writer.ok()) << writer.status().message();
    writer_ = *std::move(writer);
    const geometry::Pose X_WC{{0.0, 1.0, 0.0, 0.0}, {0.0, 0.0, 1.0}};
    write(topics_.tf_static, "tf2_msgs/msg/TFMessage",
          interfaces::encode_cdr(interfaces::RosTfMessage{
              {interfaces::to_ros_transform(interfaces::FrameTransform{"world", "camera", kStart, X_WC})}}));
  }

  void write_camera(int width, int height, std::vector<double> distortion = {}) {
    const geometry::PinholeCamera camera{width, height, 1.0 * width, 1.0 * width, 0.5 * width, 0.5 * height};
    interfaces::RosCameraInfo info = interfaces::to_ros_camera_info(camera, header());
    if (!distortion.empty()) info.d = std::move(distortion);
    write(topics_.camera_info, "sensor_msgs/msg/CameraInfo", interfaces::encode_cdr(info));
  }

  void write_frame(const geometry::DepthImage& depth, const geometry::ColorImage* color) {
    now_ += kFrame;
    if (color != nullptr)
      write(topics_.color, "sensor_msgs/msg/Image", interfaces::encode_cdr(interfaces::to_ros_image(*color, header())));
    write(topics_.depth, "sensor_msgs/msg/Image",
          interfaces::encode_cdr(interfaces::to_ros_image_32fc1(depth, header())));
  }

  void close() { EXPECT_TRUE(writer_->close().ok()); }

 private:
  interfaces::RosHeader header() const { return {interfaces::to_ros_time(now_), "camera"}; }
  void write(const std::string& topic, const std::string& type, std::vector<std::uint8_t> cdr) {
    EXPECT_TRUE(writer_->write({topic, type, std::move(cdr), now_, now_}).ok());
  }

  service::InputTopics topics_;
  std::unique_ptr<service::RecordingWriter> writer_;
  core::TimeNs now_ = kStart;
};

/// A recording of one truth record that no writer of ours would write, and the scene beside it.
void write_truth(const std::filesystem::path& path, const std::string& json) {
  const auto writer = interfaces::McapWriter::create(path, {});
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  interfaces::McapChannel channel = interfaces::ros_channel(service::kTruthTopic, "std_msgs/msg/String");
  channel.metadata["prescene"] = "json";
  const auto truth = (*writer)->add_channel(channel);
  ASSERT_TRUE(truth.ok());
  ASSERT_TRUE((*writer)->write({*truth, 0, kStart, kStart, interfaces::encode_cdr(interfaces::RosString{json})}).ok());
  ASSERT_TRUE((*writer)->close().ok());
  write_file(path.parent_path() / "box.yaml", kScene);
}

TEST(RecordingLimits, ASmallFileOfTheLargestImagesTakesLessThanAGigabyte) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "large.mcap").string();
  {
    HandRecording recording(path);
    recording.write_camera(4096, 4096, {-0.1, 0.0, 0.0, 0.0, 0.0});  // straightened, which takes most
    const geometry::DepthImage depth(4096, 4096, 1.0F);
    const geometry::ColorImage color(4096, 4096, {90, 90, 90});
    for (int i = 0; i < 4; ++i) recording.write_frame(depth, &color);
    recording.close();
  }
  EXPECT_LT(std::filesystem::file_size(path), 900'000U);
  const Finished finished = run_program({"replay", path});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_LT(finished.most_memory, kGigabyte);
  const Finished reported = run_program({"replay", path, "--report", (folder.path() / "r.html").string()});
  EXPECT_EQ(reported.exit_code, 0) << reported.err;
  EXPECT_LT(reported.most_memory, kGigabyte);
  std::printf("compared: a recording of %ju kB with images of 4096 x 4096: %.0f MB, with a report %.0f MB\n",
              static_cast<std::uintmax_t>(std::filesystem::file_size(path) / 1000),
              1e-6 * static_cast<double>(finished.most_memory), 1e-6 * static_cast<double>(reported.most_memory));
}

TEST(RecordingLimits, LargerImagesAreRefusedAndSayingWhyTakesNoMemory) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "larger.mcap").string();
  {
    HandRecording recording(path);
    recording.write_camera(5000, 5000);
    const geometry::DepthImage depth(5000, 5000, 1.0F);
    for (int i = 0; i < 3; ++i) recording.write_frame(depth, nullptr);
    recording.close();
  }
  const Finished finished = run_program({"replay", path});
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_NE(finished.err.find("5000 x 5000 exceeds the limit of 16777216 pixels"), std::string::npos) << finished.err;
  EXPECT_LT(finished.most_memory, kGigabyte);
}

TEST(RecordingLimits, AMessageOfMoreThanAChunkMayHaveIsRefused) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "bomb.mcap").string();
  ASSERT_NO_FATAL_FAILURE(write_truth(path, std::string(std::size_t{129} << 20, ' ')));
  EXPECT_LT(std::filesystem::file_size(path), 900'000U);
  const Finished finished = run_program({"replay", path, "--scene", (folder.path() / "box.yaml").string()});
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_NE(finished.err.find("up to 128.0 MiB are read"), std::string::npos) << finished.err;
  EXPECT_LT(finished.most_memory, kGigabyte);
}

TEST(RecordingLimits, JsonThatWouldUnfoldIsRefused) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "unfolds.mcap").string();
  {
    std::string zeros = "[";
    zeros.reserve(std::size_t{61} << 20);
    while (zeros.size() < std::size_t{60} << 20) zeros += "0,";
    ASSERT_NO_FATAL_FAILURE(write_truth(path, zeros + "0]"));
  }
  EXPECT_LT(std::filesystem::file_size(path), 900'000U);
  const Finished finished = run_program({"replay", path, "--scene", (folder.path() / "box.yaml").string()});
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_NE(finished.err.find("up to 8.0 MiB are read"), std::string::npos) << finished.err;
  EXPECT_LT(finished.most_memory, kGigabyte);
}

TEST(Replay, SaysInItsTextWhereEachObjectIsAndWhatWasIgnored) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "robot.mcap").string();
  {
    HandRecording recording(path);
    recording.write_camera(160, 120, {0.3, 0.1, 0.0});  // of no lens that is known
    // The top of the box at 10 cm fills a part of the middle.
    geometry::DepthImage depth(160, 120, 1.0F);
    for (int y = 53; y < 67; ++y)
      for (int x = 70; x < 90; ++x) depth(x, y) = 0.9F;
    const geometry::ColorImage color(160, 120, {90, 90, 90});
    for (int i = 0; i < 3; ++i) recording.write_frame(depth, &color);
    recording.close();
  }
  const Finished finished = run_program({"replay", path});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  const auto says = [&](const std::string& text) { return finished.out.find(text) != std::string::npos; };
  EXPECT_TRUE(says("Objects in the last frame\n")) << finished.out;
  EXPECT_TRUE(says("\nbox  ")) << finished.out;
  EXPECT_TRUE(says("in 3 of 3 steps: distortion_model: 'plumb_bob' with 3 coefficients is unknown")) << finished.out;
  const nlohmann::ordered_json json =
      nlohmann::ordered_json::parse(run_program({"replay", path, "--json"}).out, nullptr, false);
  ASSERT_FALSE(json.is_discarded());
  const nlohmann::ordered_json& box = json["objects"][0];
  EXPECT_EQ(box["name"], "box");
  EXPECT_EQ(box["pose"], json["steps"].back()["objects"][0]["pose"]);
  int frames = 0;
  for (const auto& [state, count] : box["frames"].items()) frames += count.get<int>();
  EXPECT_EQ(frames, 3);
  EXPECT_EQ(json["degraded"][0]["steps"], 3);
}

TEST(Replay, RefusesADamagedRecordingAndSalvagesWhatIsSound) {
  const ScratchDir folder;
  const std::string path = (folder.path() / "robot.mcap").string();
  {
    HandRecording recording(path);
    recording.write_camera(80, 60);
    const geometry::DepthImage depth(80, 60, 1.0F);
    for (int i = 0; i < 3; ++i) recording.write_frame(depth, nullptr);
    recording.close();
  }
  std::string bytes = read_file(path);
  const std::size_t mass = bytes.find("mass: 0.4");
  ASSERT_NE(mass, std::string::npos);
  bytes[mass + 8] = '5';
  write_file(path, bytes);
  const Finished refused = run_program({"replay", path});
  EXPECT_EQ(refused.exit_code, 2) << refused.out;
  EXPECT_NE(refused.err.find("damaged"), std::string::npos) << refused.err;
  // Nothing of a scene whose checksum is wrong is believed.
  EXPECT_EQ(run_program({"replay", path, "--salvage"}).exit_code, 2);
  write_file(folder.path() / "box.yaml", kScene);
  const Finished salvaged =
      run_program({"replay", path, "--salvage", "--scene", (folder.path() / "box.yaml").string()});
  EXPECT_EQ(salvaged.exit_code, 0) << salvaged.err;
  EXPECT_NE(salvaged.out.find("its scene, seed and settings are damaged"), std::string::npos) << salvaged.out;
  EXPECT_NE(salvaged.out.find("the checksum of its data section is wrong"), std::string::npos) << salvaged.out;
}

}  // namespace
}  // namespace prescene::tests
