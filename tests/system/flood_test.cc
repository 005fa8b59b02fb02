// SPDX-License-Identifier: Apache-2.0
// The service as a hostile or broken bus meets it: floods of mutated messages and questions, storms of transforms, a
// reader that has stopped, a wall clock that is set. It stays up, keeps answering, tells what it lost and keeps its log
// short.
//
// The flood lasts PRESCENE_FLOOD_SECONDS (default 4; 30 for the figures of docs/reference/ros2.md).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "prescene/belief/json.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/belief_summary.h"
#include "program.h"
#include "tests/service/robot_on_bus.h"
#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"
#include "tests/support/sanitizers.h"

namespace prescene::tests {
namespace {

using std::chrono::steady_clock;

constexpr core::TimeNs kSecond = 1'000'000'000;
constexpr int kMessagesPerSecond = 10'000;
constexpr int kQuestionsPerSecond = 100;

double flood_seconds() {
  const char* text = std::getenv("PRESCENE_FLOOD_SECONDS");
  return text ? std::atof(text) : 4.0;
}

/// Questions at the ends of what JSON and the questions' keys can say.
std::vector<std::string> extreme_questions() {
  std::vector<std::string> questions;
  const auto predict = [&](const std::string& rest) { questions.push_back(R"({"predict": {)" + rest + "}}"); };
  for (const char* value : {"0.9999999999999999", "1.0", "1e308", "-1", "1e-320", "null", "[]"}) {
    predict(R"("effort": {"confidence": )" + std::string(value) + "}");
    predict(R"("effort": {"max_seconds": )" + std::string(value) + "}");
  }
  for (const char* value : {"9223372036854775807", "-9223372036854775808", "18446744073709551615", "0"}) {
    predict(R"("effort": {"exact_instances": )" + std::string(value) + "}");
  }
  predict(R"("horizon": 1e300)");
  predict(R"("duration": 1e300, "actions": [{"time": 1e300}])");
  questions.push_back(std::string(100'000, '['));
  questions.push_back(R"({"where": )" + std::string(50'000, '{'));
  questions.push_back(R"({"id": ")" + std::string(500'000, 'x') + R"(", "where": {}})");
  questions.push_back("{\"id\": \"\xff\xfe\", \"where\": {\"object\": \"\xff\"}}");
  questions.push_back(R"({"stability": {"object": ")" + std::string(100'000, 'y') + R"("}})");
  questions.push_back("");
  questions.push_back("\xef\xbb\xbf{\"where\": {}}");
  return questions;
}

class Flood : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(robot_.good());
    write_file(path("scene.yaml"), kBoxScene);
    set_clock(0);
  }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  void set_clock(std::int64_t shift_s) {
    // Written in place: the service has the file mapped.
    std::fstream file(path("clock"), std::ios::binary | std::ios::in | std::ios::out);
    if (!file) file.open(path("clock"), std::ios::binary | std::ios::out);
    file.write(reinterpret_cast<const char*>(&shift_s), sizeof shift_s);
    ASSERT_TRUE(file.good());
    shift_s_ = shift_s;
  }
  /// By the robot's clock, which is that of the service.
  core::TimeNs now_ns() const { return core::wall_now_ns() + shift_s_ * kSecond; }

  std::vector<std::string> service_environment() const {
    std::vector<std::string> environment = {"ROS_DOMAIN_ID=" + std::to_string(domain_),
                                            "PRESCENE_TEST_CLOCK_FILE=" + path("clock")};
    if (!PRESCENE_SANITIZES_MEMORY) {
      environment.push_back("LD_PRELOAD=" + (build_dir() / "tests" / "libshifted_clock.so").string());
    }
    return environment;
  }

  /// Frames until the belief is of their time.
  bool tracks() {
    const std::size_t before = robot_.beliefs().size();
    const core::TimeNs from = now_ns();
    return robot_.send_until(
        [&] {
          const auto beliefs = robot_.beliefs();
          return std::any_of(beliefs.begin() + static_cast<std::ptrdiff_t>(before), beliefs.end(),
                             [&](const auto& text) {
                               const auto summary = service::belief_summary_from_json(text);
                               return summary && std::abs(summary->stamp_ns - from) < 600 * kSecond;
                             });
        },
        from);
  }

  /// Asks `where` and notes how long the answer takes. Asks again, as clients do, where none comes: a flood may push a
  /// question out of the bus, or its answer.
  void begin_where() {
    pending_id_ = "where-" + std::to_string(asked_++);
    asked_at_ = steady_clock::now();
    ask_where();
  }
  void ask_where() {
    ask_again_at_ = steady_clock::now() + std::chrono::milliseconds(250);
    robot_.ask(R"({"id": ")" + pending_id_ + R"(", "where": {}})");
  }
  void poll_where() {
    const auto now = steady_clock::now();
    const auto answers = robot_.answers_since(answers_read_);
    answers_read_ += answers.size();
    for (const std::string& text : answers) {
      const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
      if (!json.is_object() || json.value("id", nlohmann::ordered_json()) != pending_id_) continue;
      if (!json.contains("where")) continue;  // too many questions waited: asked again
      where_ms_.push_back(1e3 * std::chrono::duration<double>(now - asked_at_).count());
      pending_id_.clear();
    }
    if (!pending_id_.empty() && now >= ask_again_at_) {
      ++asked_again_;
      ask_where();
    }
  }

  std::mt19937_64 random_{7};
  ScratchDir folder_;
  int domain_ = own_domain();
  RobotOnBus robot_{kBoxScene, domain_};
  std::int64_t shift_s_ = 0;
  int asked_ = 0;
  std::size_t answers_read_ = 0;
  std::string pending_id_;
  steady_clock::time_point asked_at_, ask_again_at_;
  int asked_again_ = 0;
  std::vector<double> where_ms_;
};

/// Sends mutated messages of every kind, one a call.
class Mutator {
 public:
  Mutator(RobotOnBus& robot, std::mt19937_64& random) : robot_(robot), random_(random) {}

  void send(core::TimeNs now_ns) {
    switch (below(10)) {
      case 0:
        return robot_.send_depth(image(now_ns));
      case 1:
        return robot_.send_color(image(now_ns));
      case 2:
      case 3:
        return robot_.send_camera_info(info(now_ns));
      case 4:
      case 5:
      case 6:
        return robot_.send_tf(transforms(now_ns));
      case 7:
        return robot_.control(
            mutated_text(R"({"stamp_ns": 0, "actions": [{"time": 0.1, "release": {"object": "box"}}]})"));
      default:
        return robot_.control(text());
    }
  }
  std::string question() {
    static const std::vector<std::string> kSeeds = {
        R"({"id": "m", "where": {}})", R"({"id": "m", "stability": {"object": "box"}})",
        R"({"id": "m", "predict": {"horizon": 1.0, "effort": {"max_seconds": 0.1, "confidence": 0.9}}})",
        R"({"id": "m", "predict": {"actions": [{"time": 0.0, "push": {"object": "box", "force": [1, 0, 0]}}]}})"};
    return mutated_text(kSeeds[below(kSeeds.size())]);
  }

 private:
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  bool rarely() { return below(4) == 0; }
  double number() {
    static const double kNumbers[] = {0.0, -1.0, 1e308, -1e308, 1e-308, std::nan(""), HUGE_VAL, 640.0, 0.5};
    return kNumbers[below(std::size(kNumbers))];
  }
  std::string text() {
    std::string bytes(below(40), ' ');
    for (char& c : bytes) c = static_cast<char>(random_());
    return bytes;
  }
  std::string mutated_text(std::string text_in) {
    for (std::size_t i = below(4); i > 0 && !text_in.empty(); --i) {
      const std::size_t at = below(text_in.size());
      switch (below(4)) {
        case 0:
          text_in[at] = static_cast<char>(random_());
          break;
        case 1:
          text_in.erase(at, 1 + below(5));
          break;
        case 2: {
          const std::size_t length = below(20);
          text_in.insert(at, text_in.substr(below(text_in.size()), length));
          break;
        }
        default:
          text_in.insert(at, "1e999");
      }
    }
    return text_in;
  }
  interfaces::RosHeader header(core::TimeNs now_ns) {
    interfaces::RosHeader header{interfaces::to_ros_time(now_ns), robot_.depth().header.frame_id};
    if (rarely()) header.stamp.sec = static_cast<std::int32_t>(random_());
    if (rarely()) header.stamp.nanosec = static_cast<std::uint32_t>(random_());
    if (rarely()) header.frame_id = text();
    return header;
  }
  interfaces::RosImage image(core::TimeNs now_ns) {
    interfaces::RosImage image = robot_.depth();
    image.header = header(now_ns);
    if (rarely()) image.width = static_cast<std::uint32_t>(random_());
    if (rarely()) image.height = static_cast<std::uint32_t>(random_() >> below(32));
    if (rarely()) image.step = static_cast<std::uint32_t>(random_());
    if (rarely()) image.encoding = text();
    if (rarely()) image.data.resize(below(image.data.size() + 1));
    for (int i = 0; i < 8 && !image.data.empty(); ++i)
      image.data[below(image.data.size())] = static_cast<std::uint8_t>(random_());
    return image;
  }
  interfaces::RosCameraInfo info(core::TimeNs now_ns) {
    interfaces::RosCameraInfo info = robot_.camera_info();
    info.header = header(now_ns);
    if (rarely()) info.width = static_cast<std::uint32_t>(random_());
    if (rarely()) info.k[below(9)] = number();
    if (rarely()) info.p[below(12)] = number();
    if (rarely()) {
      const double value = number();
      info.d.assign(below(2000), value);
    }
    if (rarely()) info.distortion_model = text();
    return info;
  }
  interfaces::RosTfMessage transforms(core::TimeNs now_ns) {
    interfaces::RosTfMessage tf;
    const std::size_t count = below(200) == 0 ? 4090 : below(6);
    for (std::size_t i = 0; i < count; ++i) {
      interfaces::RosTransformStamped transform;
      transform.header = header(now_ns);
      transform.header.frame_id = rarely() ? text() : "frame" + std::to_string(below(5000));
      transform.child_frame_id = rarely() ? text() : "frame" + std::to_string(below(5000));
      transform.transform.rotation.w = rarely() ? number() : 1.0;
      transform.transform.translation.x = number();
      tf.transforms.push_back(std::move(transform));
    }
    return tf;
  }

  RobotOnBus& robot_;
  std::mt19937_64& random_;
};

TEST_F(Flood, TheServiceStaysUpAnswersAndTellsWhatItLost) {
  const std::string log = path("log");
  BackgroundProgram listener(build_dir() / "tests" / "bus_listener", {std::to_string(domain_)}, {}, "/dev/null");
  BackgroundProgram service(build_dir() / "prescene",
                            {"serve", "--scene", path("scene.yaml"), "--record", path("s.mcap")}, service_environment(),
                            log);
  ASSERT_TRUE(tracks()) << read_file(log);
  // The listener has found the service's topics by now: it has the same time for it as the robot.
  listener.signal(SIGSTOP);

  Mutator mutator(robot_, random_);
  const std::vector<std::string> extremes = extreme_questions();
  const double seconds = flood_seconds();
  const auto begin = steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(steady_clock::now() - begin).count(); };
  std::uint64_t sent = 0, questions = 0;
  double next_where = 0.1, next_frame = 0.0;
  while (elapsed() < seconds) {
    const double share = elapsed() / seconds;
    if (!PRESCENE_SANITIZES_MEMORY) {
      const std::int64_t shift = share < 0.3 ? 0 : share < 0.6 ? -3600 : 3600;
      if (shift != shift_s_) set_clock(shift);
    }
    for (int i = 0; i < kMessagesPerSecond / 100; ++i) {
      mutator.send(now_ns());
      ++sent;
    }
    while (static_cast<double>(questions) < kQuestionsPerSecond * elapsed()) {
      robot_.ask(mutator.question());
      if (questions % 10 == 0) robot_.ask(extremes[(questions / 10) % extremes.size()]);
      ++questions;
    }
    if (elapsed() >= next_frame) {
      robot_.send_frame(now_ns());
      next_frame += 1.0 / 30.0;
    }
    poll_where();
    if (pending_id_.empty() && elapsed() >= next_where) {
      begin_where();
      next_where = elapsed() + 0.1;
    }
    const double due = static_cast<double>(sent) / kMessagesPerSecond;
    if (due > elapsed()) robot_.wait(std::chrono::milliseconds(static_cast<int>(1e3 * (due - elapsed())) + 1));
  }
  ASSERT_TRUE(robot_.send_until(
      [&] {
        poll_where();
        return pending_id_.empty();
      },
      now_ns()))
      << "a question was never answered; " << robot_.diagnosis();
  EXPECT_TRUE(tracks()) << robot_.diagnosis();

  std::map<std::string, std::string> told = robot_.diagnostics();
  listener.stop(SIGKILL);
  EXPECT_EQ(service.stop(SIGINT), 0) << read_file(log).substr(0, 2000);
  EXPECT_LT(std::filesystem::file_size(log), 1'000'000u);
  EXPECT_NE(told["refused messages"], "0");
  EXPECT_EQ(told["failures"], "0") << read_file(log).substr(0, 2000);

  ASSERT_FALSE(where_ms_.empty());
  std::sort(where_ms_.begin(), where_ms_.end());
  std::string figures = "compared: flood of " + std::to_string(sent) + " messages and " + std::to_string(questions) +
                        " questions in " + std::to_string(seconds) + " s: where answered within " +
                        std::to_string(where_ms_[where_ms_.size() / 2]) + " ms (median), " +
                        std::to_string(where_ms_.back()) + " ms (worst), n = " + std::to_string(where_ms_.size()) +
                        "; log " + std::to_string(std::filesystem::file_size(log)) + " bytes";
  for (const auto& [key, value] : told) figures += "; " + key + " " + value;
  std::printf("%s\n", figures.c_str());
}

}  // namespace
}  // namespace prescene::tests
