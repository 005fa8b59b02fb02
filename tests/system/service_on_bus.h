// SPDX-License-Identifier: Apache-2.0
// `prescene serve` in a process of its own and the robot that it serves, for what is done to both.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "program.h"
#include "tests/service/robot_on_bus.h"
#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"

namespace prescene::tests {

/// Whether all of it is to be done, as for the figures of docs/reference/reliability.md: PRESCENE_FAULTS=full.
bool is_full_run();

/// Of a recording, as it can be read.
struct ReadBack {
  std::size_t frames = 0;
  core::TimeNs newest_frame_ns = 0;  ///< When the robot sent it, by the wall clock.
  std::string loss;
};

class ServiceOnBus : public ::testing::Test {
 protected:
  explicit ServiceOnBus(const std::string& scene = kBoxScene) : scene_(scene) {}
  void SetUp() override;

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// `prescene serve` of the scene with more options; before it the shell runs `limits`, such as "ulimit -n 20". The
  /// newest one's log is log().
  std::unique_ptr<BackgroundProgram> serve(const std::vector<std::string>& more = {}, const std::string& limits = "",
                                           std::vector<std::string> environment = {});
  std::string log() const { return read_file(path("log" + std::to_string(services_))).substr(0, 3000); }

  /// The robot sends 30 frames a second, stamped by the wall clock and `shift_ns_`, until `done`; false after a minute.
  bool drive(const std::function<bool()>& done);
  void drive_for(double seconds);
  /// Drives until there is a belief of a frame that was sent after this call; false after a minute, or when the
  /// service has ended.
  bool tracks(const BackgroundProgram& service);
  /// The stamps of the beliefs that came since the last call.
  std::vector<core::TimeNs> new_beliefs();

  /// Fails the test where the recording can't be opened.
  ReadBack read_back(const std::string& file);
  /// Replays it and compares each step with the recorded one; the number of steps.
  int replay(const std::string& file, const std::vector<std::string>& options = {});

  const std::string scene_;
  ScratchDir folder_;
  int domain_ = own_domain();
  std::unique_ptr<RobotOnBus> robot_;
  core::TimeNs shift_ns_ = 0;
  std::uint64_t frames_sent_ = 0;

 private:
  std::chrono::steady_clock::time_point next_frame_{};
  int services_ = 0;
};

/// "median 0.12, worst 0.31, n = 50".
std::string spread_text(std::vector<double> values);

/// Kilobytes by this name in /proc/PID/status ("VmRSS"); 0 when it has ended.
std::int64_t process_kilobytes(pid_t pid, const std::string& name);
/// Its open descriptors.
int process_descriptors(pid_t pid);

}  // namespace prescene::tests
