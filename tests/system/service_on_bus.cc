// SPDX-License-Identifier: Apache-2.0
#include "service_on_bus.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "prescene/core/text.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::tests {

using std::chrono::steady_clock;

bool is_full_run() {
  const char* text = std::getenv("PRESCENE_FAULTS");
  return text != nullptr && std::string(text) == "full";
}

void ServiceOnBus::SetUp() {
  write_file(path("scene.yaml"), scene_);
  robot_ = std::make_unique<RobotOnBus>(scene_, domain_);
  ASSERT_TRUE(robot_->good());
}

std::unique_ptr<BackgroundProgram> ServiceOnBus::serve(const std::vector<std::string>& more, const std::string& limits,
                                                       std::vector<std::string> environment) {
  std::vector<std::string> args = {"-c",
                                   (limits.empty() ? "" : limits + " && ") + "exec \"$0\" \"$@\"",
                                   (build_dir() / "prescene").string(),
                                   "serve",
                                   "--scene",
                                   path("scene.yaml")};
  args.insert(args.end(), more.begin(), more.end());
  environment.push_back("ROS_DOMAIN_ID=" + std::to_string(domain_));
  return std::make_unique<BackgroundProgram>("/bin/sh", args, environment, path("log" + std::to_string(++services_)));
}

bool ServiceOnBus::drive(const std::function<bool()>& done) {
  const auto end = steady_clock::now() + std::chrono::minutes(1);
  while (!done()) {
    const auto now = steady_clock::now();
    if (now > end) return false;
    if (now >= next_frame_) {
      robot_->send_frame(core::wall_now_ns() + shift_ns_);
      ++frames_sent_;
      next_frame_ = std::max(next_frame_, now - std::chrono::milliseconds(100)) + std::chrono::microseconds(33'333);
    }
    robot_->wait(std::chrono::ceil<std::chrono::milliseconds>(
        std::max(next_frame_ - steady_clock::now(), steady_clock::duration::zero())));
  }
  return true;
}

void ServiceOnBus::drive_for(double seconds) {
  const auto end = steady_clock::now() + std::chrono::duration<double>(seconds);
  EXPECT_TRUE(drive([&] { return steady_clock::now() >= end; }));
}

std::vector<core::TimeNs> ServiceOnBus::new_beliefs() {
  std::vector<core::TimeNs> stamps;
  for (const std::string& text : robot_->take_beliefs())
    if (const auto summary = service::belief_summary_from_json(text)) stamps.push_back(summary->stamp_ns);
  return stamps;
}

bool ServiceOnBus::tracks(const BackgroundProgram& service) {
  const core::TimeNs from_ns = core::wall_now_ns() + shift_ns_;
  bool found = false;
  drive([&] {
    // After a jump of the clock beliefs of the other time may still come.
    for (const core::TimeNs stamp_ns : new_beliefs())
      found = found || (stamp_ns >= from_ns && stamp_ns - from_ns < 600'000'000'000);
    return found || service.has_ended();
  });
  return found;
}

ReadBack ServiceOnBus::read_back(const std::string& file) {
  ReadBack read;
  const auto reader = service::RecordingReader::open(file);
  EXPECT_TRUE(reader.ok()) << reader.status().message();
  if (!reader) return read;
  for (;;) {
    const auto entry = (*reader)->next();
    EXPECT_TRUE(entry.ok()) << entry.status().message();
    if (!entry || !*entry) break;
    if ((*entry)->message.topic != service::InputTopics().depth) continue;
    ++read.frames;
    read.newest_frame_ns = std::max(read.newest_frame_ns, (*entry)->message.source_ns);
  }
  read.loss = (*reader)->loss_text();
  return read;
}

int ServiceOnBus::replay(const std::string& file, const std::vector<std::string>& options) {
  std::vector<std::string> words = {"replay", file, "--json"};
  words.insert(words.end(), options.begin(), options.end());
  const Finished finished = run_program(words);
  EXPECT_EQ(finished.exit_code, 0) << file << ": " << finished.err;
  const auto json = nlohmann::ordered_json::parse(finished.out, nullptr, false);
  if (!json.is_object()) return 0;
  EXPECT_EQ(json["different_steps"], 0) << file;
  return json["compared_steps"].get<int>();
}

std::string spread_text(std::vector<double> values) {
  if (values.empty()) return "none";
  std::sort(values.begin(), values.end());
  return "median " + core::fixed_text(values[values.size() / 2], 3) + ", worst " + core::fixed_text(values.back(), 3) +
         ", n = " + std::to_string(values.size());
}

std::int64_t process_kilobytes(pid_t pid, const std::string& name) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(name + ":")) return std::strtoll(line.c_str() + name.size() + 1, nullptr, 10);
  return 0;
}

int process_descriptors(pid_t pid) {
  std::error_code error;
  int count = 0;
  for (auto at = std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd", error);
       !error && at != std::filesystem::directory_iterator(); at.increment(error))
    ++count;
  return count;
}

}  // namespace prescene::tests
