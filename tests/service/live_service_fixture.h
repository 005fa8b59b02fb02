// SPDX-License-Identifier: Apache-2.0
// The live service and a robot beside it, in the test's process.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "prescene/service/belief_summary.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/load_scene.h"
#include "tests/service/robot_on_bus.h"
#include "tests/support/bus_domain.h"

namespace prescene::service {

inline constexpr core::TimeNs kSecond = 1'000'000'000;
inline constexpr core::TimeNs kNoon = 1'700'000'000 * kSecond;

class LiveServiceTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(robot_.good()); }
  void TearDown() override {
    if (runner_.joinable()) {
      EXPECT_TRUE(stop().ok());
    }
  }

  void start(std::unique_ptr<RollingRecording> recording = nullptr, const std::string& clock = "",
             const std::string& scene_yaml = tests::kBoxScene) {
    const auto scene = load_scene_text(scene_yaml, "box.yaml", {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    LiveSettings settings;
    settings.dds.domain = tests::own_domain();
    settings.diagnostics_rate = 50.0;
    settings.tracker.topics.clock = clock;
    settings.learned_file = learned_file_;
    if (adjust_) adjust_(settings);
    const core::LogSink log = [this](core::LogLevel, const std::string& text) {
      const std::lock_guard lock(log_mutex_);
      log_.push_back(text);
    };
    auto service = LiveService::create(*scene, settings, 1, backends_, std::move(recording), log);
    ASSERT_TRUE(service.ok()) << service.status().message();
    service_ = *std::move(service);
    runner_ = std::thread([this] { status_ = service_->run(cancellation_); });
  }
  core::Status stop() {
    cancellation_.request();
    runner_.join();
    service_.reset();
    return status_;
  }

  /// Sends frames from `stamp_ns` on until one of that time and its successors was stepped `count` times, and something
  /// is known from the diagnostics.
  bool tracks_from(core::TimeNs stamp_ns, std::size_t count = 3) {
    const std::size_t before = robot_.beliefs().size();
    return robot_.send_until(
        [&] {
          std::size_t found = 0;
          const std::vector<std::string> beliefs = robot_.beliefs();
          for (std::size_t i = before; i < beliefs.size(); ++i) {
            const auto summary = belief_summary_from_json(beliefs[i]);
            if (summary && summary->stamp_ns >= stamp_ns && summary->stamp_ns < stamp_ns + 600 * kSecond) ++found;
          }
          return found >= count && !robot_.diagnosis().empty();
        },
        stamp_ns);
  }
  /// Sends the image, which may get lost as any, until one more message was refused.
  bool refuses(const interfaces::RosImage& nonsense) {
    const auto refused = [&] { return std::stoi("0" + robot_.diagnostics()["refused messages"]); };
    const int before = refused();
    return robot_.send_until(
        [&] {
          robot_.send_depth(nonsense);
          return refused() > before;
        },
        kNoon + kSecond);
  }

  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  tests::RobotOnBus robot_{tests::kBoxScene, tests::own_domain()};
  std::mutex log_mutex_;
  std::vector<std::string> log_;
  core::Cancellation cancellation_;
  core::Status status_;
  std::unique_ptr<LiveService> service_;
  std::string learned_file_;
  std::function<void(LiveSettings&)> adjust_;  // of what start() starts
  std::thread runner_;
};

}  // namespace prescene::service
