// SPDX-License-Identifier: Apache-2.0
// The service for as long as PRESCENE_SOAK_SECONDS says (default 3; `./dev faults soak 86400` for a day), with 30
// frames a second, `where` five times a second and a question that is simulated every two seconds, while it records:
// how its memory and its descriptors develop, and how long `where` takes. PRESCENE_SOAK_SIZE=640x480 makes larger
// frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "prescene/core/text.h"
#include "service_on_bus.h"

namespace prescene::tests::soak_test {
namespace {

using std::chrono::steady_clock;

std::string from_environment(const char* name, const std::string& otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? text : otherwise;
}

std::string soak_scene() {
  std::string scene = kBoxScene;
  const std::string size = from_environment("PRESCENE_SOAK_SIZE", "80x60");
  const std::size_t cross = size.find('x');
  const auto put = [&](const std::string& old, const std::string& text) {
    scene.replace(scene.find(old), old.size(), text);
  };
  put("width: 80", "width: " + size.substr(0, cross));
  put("height: 60", "height: " + size.substr(cross + 1));
  return scene;
}

/// The line of least squares through (x, y): its slope and the slope's standard error.
std::pair<double, double> slope(const std::vector<std::pair<double, double>>& points) {
  const auto n = static_cast<double>(points.size());
  if (points.size() < 3) return {0.0, HUGE_VAL};
  double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0, rest = 0.0;
  for (const auto& [x, y] : points) mean_x += x / n, mean_y += y / n;
  for (const auto& [x, y] : points) xx += (x - mean_x) * (x - mean_x), xy += (x - mean_x) * (y - mean_y);
  for (const auto& [x, y] : points) rest += std::pow(y - mean_y - xy / xx * (x - mean_x), 2);
  return {xy / xx, std::sqrt(rest / (n - 2.0) / xx)};
}

class Soak : public ServiceOnBus {
 protected:
  Soak() : ServiceOnBus(soak_scene()) {}

  void ask(const std::string& question) {
    const std::string id = "soak-" + std::to_string(asked_++);
    asked_at_[id] = steady_clock::now();
    robot_->ask(R"({"id": ")" + id + R"(", )" + question + "}");
  }
  void read_answers() {
    for (const std::string& text : robot_->take_answers()) {
      const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
      const auto asked =
          json.is_object() && json.contains("id") ? asked_at_.find(json["id"].get<std::string>()) : asked_at_.end();
      if (asked == asked_at_.end()) continue;
      const double ms = 1e3 * std::chrono::duration<double>(steady_clock::now() - asked->second).count();
      if (json.contains("where")) where_ms_.push_back(ms);
      answered_ += json.contains("error") ? 0 : 1;
      asked_at_.erase(asked);
    }
  }

  std::map<std::string, steady_clock::time_point> asked_at_;
  std::vector<double> where_ms_;
  std::size_t asked_ = 0, answered_ = 0;
};

TEST_F(Soak, MemoryAndDescriptorsStayAsTheyAre) {
  const double seconds = std::atof(from_environment("PRESCENE_SOAK_SECONDS", "3").c_str());
  const std::string file = path("soak.mcap");
  const auto service = serve({"--record", file});
  ASSERT_TRUE(tracks(*service)) << log();
  const auto begin = steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(steady_clock::now() - begin).count(); };
  std::vector<std::pair<double, double>> memory;  // hours, MB
  std::vector<int> descriptors;
  std::size_t beliefs = 0;
  double next_where = 0.0, next_stability = 0.0, next_look = 0.0;
  const std::uint64_t frames_before = frames_sent_;
  while (elapsed() < seconds && !service->has_ended()) {
    const auto due = [&](double& next, double every) {
      if (elapsed() < next) return false;
      next += every;
      return true;
    };
    if (due(next_where, 0.2)) ask(R"("where": {})");
    if (due(next_stability, 2.0)) ask(R"("stability": {"object": "box"})");
    if (due(next_look, std::max(0.2, seconds / 2000.0))) {
      memory.emplace_back(elapsed() / 3600.0, 1e-3 * static_cast<double>(process_kilobytes(service->pid(), "VmRSS")));
      descriptors.push_back(process_descriptors(service->pid()));
    }
    drive_for(0.02);
    read_answers();
    beliefs += new_beliefs().size();
  }
  ASSERT_FALSE(service->has_ended()) << log();
  drive([&] {
    read_answers();
    return asked_at_.empty();
  });
  EXPECT_TRUE(tracks(*service)) << log();
  const auto diagnostics = robot_->diagnostics();
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  EXPECT_EQ(diagnostics.at("failures"), "0") << log();
  EXPECT_EQ(answered_, asked_) << "refused or lost";
  ASSERT_FALSE(where_ms_.empty());
  // What is made once is made in the first part.
  const auto half = memory.begin() + static_cast<std::ptrdiff_t>(memory.size() / 2);
  const auto [mb_per_hour, error] = slope({half, memory.end()});
  const auto [fewest, most] =
      std::minmax_element(descriptors.begin() + static_cast<std::ptrdiff_t>(descriptors.size() / 2), descriptors.end());
  // Once, when the recording's index has grown beyond what is kept in memory, it gets a file, which is written and
  // read.
  EXPECT_LE(*most, *fewest + 2) << "descriptors";
  std::sort(where_ms_.begin(), where_ms_.end());
  const auto quantile = [&](double q) {
    return where_ms_[static_cast<std::size_t>(q * static_cast<double>(where_ms_.size() - 1))];
  };
  std::printf(
      "compared: soak of %.0f s, %ju frames, %zu beliefs, %zu questions, all answered; recording %.1f MB; memory "
      "%.1f MB, in the second half %+.2f MB/h (standard error %.2f); %d descriptors; where: median %.1f ms, "
      "99 %% %.1f ms, worst %.1f ms\n",
      seconds, static_cast<std::uintmax_t>(frames_sent_ - frames_before), beliefs, asked_,
      1e-6 * static_cast<double>(std::filesystem::file_size(file)), memory.back().second, mb_per_hour, error, *most,
      quantile(0.5), quantile(0.99), where_ms_.back());
}

}  // namespace
}  // namespace prescene::tests::soak_test
