// SPDX-License-Identifier: Apache-2.0
// Two cameras on the bus, each a participant of its own, before the live service.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "prescene/service/belief_summary.h"
#include "prescene/service/live/doctor.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/recording/replay.h"
#include "tests/service/robot_on_bus.h"
#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"

namespace prescene::service::cameras_on_bus_test {
namespace {

using testing::HasSubstr;

constexpr core::TimeNs kMs = 1'000'000;
constexpr core::TimeNs kNoon = 1'700'000'000'000 * kMs;

const std::string kScene = R"(
name: two_cameras
duration: 0.3
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.05], normal: {position: [0.005, 0.005, 0]}}}
cameras:
  - {name: front, width: 80, height: 60, fov_deg: 55, look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}}
  - {name: side, width: 80, height: 60, fov_deg: 55, look: {from: [-0.55, -0.5, 0.5], at: [0, 0, 0.03]}}
)";

InputTopics topics_of(const std::string& camera) {
  InputTopics topics;
  topics.depth = "/" + camera + "/aligned_depth_to_color/image_raw";
  topics.color = "/" + camera + "/color/image_raw";
  topics.camera_info = "/" + camera + "/color/camera_info";
  return topics;
}

class CamerasOnBus : public testing::Test {
 protected:
  void SetUp() override {
    const auto scene = load_scene_text(kScene, "two.yaml", {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    scene_ = *scene;
    front_ = camera("front");
    side_ = camera("side");
    ASSERT_TRUE(front_->good() && side_->good());
  }
  void TearDown() override {
    if (runner_.joinable()) stop();
  }

  static std::unique_ptr<tests::RobotOnBus> camera(const std::string& name) {
    return std::make_unique<tests::RobotOnBus>(kScene, tests::own_domain(), topics_of(name));
  }
  void start(std::unique_ptr<RollingRecording> recording = nullptr) {
    LiveSettings settings;
    settings.dds.domain = tests::own_domain();
    settings.diagnostics_rate = 50.0;
    auto service = LiveService::create(scene_, settings, 1, backends_, std::move(recording), {});
    ASSERT_TRUE(service.ok()) << service.status().message();
    service_ = *std::move(service);
    runner_ = std::thread([this] { EXPECT_TRUE(service_->run(cancellation_).ok()); });
  }
  void stop() {
    cancellation_.request();
    runner_.join();
    service_.reset();
  }
  /// Frames of both cameras, where they are there: the side's some milliseconds later.
  bool sends_until(const std::function<bool()>& done) {
    for (int i = 0; i < 3000; ++i) {
      if (done()) return true;
      stamp_ns_ += 33 * kMs;
      front_->send_frame(stamp_ns_);
      if (side_) side_->send_frame(stamp_ns_ + 7 * kMs);
      front_->wait(std::chrono::milliseconds(30));
    }
    return done();
  }
  /// Frames of the camera that the service says it used.
  std::uint64_t used(const std::string& name) const {
    const std::string counts = front_->diagnostics()["cameras"];
    const std::size_t at = counts.find(name + ": ");
    return at == std::string::npos ? 0 : std::stoull(counts.substr(at + name.size() + 2));
  }
  bool is_tracked() const {
    const std::vector<std::string> beliefs = front_->beliefs();
    if (beliefs.empty()) return false;
    const auto summary = belief_summary_from_json(beliefs.back());
    return summary && summary->objects.at(0).state == belief::TrackState::kTracked;
  }

  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  std::shared_ptr<const belief::Scene> scene_;
  std::unique_ptr<tests::RobotOnBus> front_, side_;
  core::TimeNs stamp_ns_ = kNoon;
  core::Cancellation cancellation_;
  std::unique_ptr<LiveService> service_;
  std::thread runner_;
};

TEST_F(CamerasOnBus, AreBothUsedAndOneGoesAndComesBack) {
  start();
  ASSERT_TRUE(sends_until([&] { return used("front") >= 5 && used("side") >= 5 && is_tracked(); }))
      << front_->diagnosis();
  side_.reset();
  ASSERT_TRUE(sends_until([&] {
    return front_->diagnosis().find("camera 'side': it sends no more depth images") != std::string::npos;
  })) << front_->diagnosis();
  EXPECT_TRUE(is_tracked());
  EXPECT_THAT(front_->diagnosis(), HasSubstr("tracking"));
  const std::uint64_t before = used("side");
  side_ = camera("side");
  ASSERT_TRUE(sends_until([&] { return used("side") >= before + 5 && front_->diagnosis() == "tracking"; }))
      << front_->diagnosis();
  EXPECT_TRUE(is_tracked());
}

TEST_F(CamerasOnBus, AreRecordedAndReplayedToTheSameBits) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  auto recording = RollingRecording::create(path, {"two.yaml", kScene, 1, ""});
  ASSERT_TRUE(recording.ok());
  start(*std::move(recording));
  ASSERT_TRUE(sends_until([&] { return used("front") >= 15 && used("side") >= 15; })) << front_->diagnosis();
  stop();
  const auto tracker = Tracker::create(scene_, {}, 1, backends_);
  ASSERT_TRUE(tracker.ok());
  const auto summary = replay_recording(path, {}, **tracker, {}, {}, {}, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_GE(summary->compared, 30U);
  EXPECT_EQ(summary->different, 0U);
}

TEST_F(CamerasOnBus, AreBothLookedAtByTheDoctor) {
  DoctorOptions options;
  options.dds.domain = tests::own_domain();
  options.seconds = 1.0;
  std::atomic<bool> done = false;
  std::thread sender([&] { sends_until([&] { return done.load(); }); });
  const auto is_found = [](const core::Result<Diagnosis>& diagnosis) {
    return diagnosis && std::any_of(diagnosis->checks.begin(), diagnosis->checks.end(), [](const DoctorCheck& check) {
             return check.name == "cameras" && check.what == "frames of all can be used: front, side";
           });
  };
  core::Result<Diagnosis> diagnosis = examine_bus(options, scene_, backends_, {}, {}, {});
  for (int i = 0; i < 20 && !is_found(diagnosis); ++i)  // a busy machine may take its time
    diagnosis = examine_bus(options, scene_, backends_, {}, {}, {});
  done = true;
  sender.join();
  EXPECT_TRUE(is_found(diagnosis));
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status().message();
  EXPECT_TRUE(diagnosis->usable());
  EXPECT_EQ(diagnosis->overlay.height(), 120) << "one picture below the other";
  for (const char* camera : {"front", "side"})
    EXPECT_EQ(std::count_if(diagnosis->checks.begin(), diagnosis->checks.end(),
                            [&](const auto& check) { return check.name == "view" && check.camera == camera; }),
              1);
}

}  // namespace
}  // namespace prescene::service::cameras_on_bus_test
