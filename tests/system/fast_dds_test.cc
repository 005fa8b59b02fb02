// SPDX-License-Identifier: Apache-2.0
// The service serves a robot on another middleware. tests/peers/fast_dds_robot.cc says what that robot does.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "prescene/service/belief_summary.h"
#include "program.h"
#include "tests/support/bus_domain.h"
#include "tests/support/paths.h"

namespace prescene::tests::fast_dds_test {
namespace {

// Where the box may be: the robot's stands 2.5 cm beside the middle of this, and turned.
constexpr const char* kScene = R"(name: box_on_table
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4, color: [0.8, 0.3, 0.2]}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box:
    model: box
    pose: {position: [0, 0, 0.05], normal: {position: [0.02, 0.02, 0], rotation_deg: [0, 0, 10]}}
)";

struct Seen {
  double error_m = 0.0;
  double true_y = 0.0;
};

double median_error(std::vector<Seen> all) {
  if (all.empty()) return 1e9;
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end(), [](const Seen& a, const Seen& b) { return a.error_m < b.error_m; });
  return middle->error_m;
}

TEST(FastDds, ARobotOnFastDdsIsServed) {
  const std::filesystem::path robot = build_dir() / "tests" / "fast_dds_robot";
  if (!std::filesystem::exists(robot))
    GTEST_SKIP() << "the peer on Fast DDS was not built: it needs libfastrtps-dev and fastddsgen (./dev setup interop)";
  const ScratchDir folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  write_file(path("scene.yaml"), kScene);
  BackgroundProgram service(build_dir() / "prescene", {"serve", "--scene", path("scene.yaml")}, {own_bus()},
                            path("log"));
  const std::string command = robot.string() + " " + std::to_string(own_domain()) + " > " + path("heard");
  const int ended = std::system(command.c_str());
  EXPECT_EQ(service.stop(SIGINT), 0);
  const std::string heard = read_file(path("heard"));
  ASSERT_EQ(ended, 0) << heard.substr(0, 2000) << "\n" << read_file(path("log"));

  std::vector<Seen> beliefs, frames;
  std::vector<std::string> answers;
  std::istringstream lines(heard);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string what, rest;
    words >> what;
    if (what == "answer") {
      answers.push_back(line.substr(7));
      continue;
    }
    core::TimeNs stamp_ns = 0;
    Eigen::Vector3d truth, found;
    words >> stamp_ns >> truth.x() >> truth.y() >> truth.z();
    if (what == "frame") {
      words >> found.x() >> found.y() >> found.z();
      ASSERT_TRUE(words) << line;
      frames.push_back({(found - truth).norm(), truth.y()});
      continue;
    }
    ASSERT_EQ(what, "belief") << line;
    std::getline(words >> std::ws, rest);
    const auto summary = service::belief_summary_from_json(rest);
    ASSERT_TRUE(summary.ok()) << summary.status().message() << "\n" << line;
    ASSERT_EQ(summary->objects.size(), 1u);
    EXPECT_EQ(summary->stamp_ns, stamp_ns);
    beliefs.push_back({(summary->objects[0].X_WO.translation - truth).norm(), truth.y()});
  }

  // Where it stood at first, and where it was pushed to: 5 cm apart, far beyond the bound.
  constexpr double kBound = 0.01;
  for (const auto* all : {&beliefs, &frames}) {
    std::vector<Seen> before, after;
    for (const Seen& seen : *all) {
      if (seen.true_y < -0.0149) before.push_back(seen);
      if (seen.true_y > 0.0349) after.push_back(seen);
    }
    EXPECT_LT(median_error(before), kBound) << before.size() << " of " << all->size();
    EXPECT_LT(median_error(after), kBound) << after.size() << " of " << all->size();
  }
  ASSERT_EQ(answers.size(), 1u);
  const auto answer = nlohmann::ordered_json::parse(answers[0], nullptr, false);
  ASSERT_TRUE(answer.is_object()) << answers[0];
  EXPECT_EQ(answer["id"], "fast");
  EXPECT_GT(answer["stability"]["stable"]["probability"].get<double>(), 0.8) << answers[0];
}

}  // namespace
}  // namespace prescene::tests::fast_dds_test
