// SPDX-License-Identifier: Apache-2.0
// Two cameras feed one belief: what is hidden from one stays tracked by the other, and every bit is repeated.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "prescene/belief/json.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/tracking_score.h"
#include "prescene/service/tracking/tracker.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::several_cameras_test {
namespace {

/// A box that slides behind a wall, of which only the camera at the side knows.
std::string sliding_box(const std::string& wall, const std::string& cameras, const std::string& duration = "1") {
  return "name: sliding_box\nduration: " + duration + R"(
stop_at_rest: false
models:
  box: {box: [0.1, 0.08, 0.1], mass: 0.4, friction: 0.4}
supports:
  table: {box: [1.2, 1.2, 0.04], pose: {position: [0, 0, -0.02]}}
)" + wall +
         R"(objects:
  box: {model: box, pose: {position: [0, -0.03, 0.05]}, velocity: [0, 0.6, 0]}
)" + cameras;
}

const std::string kWall = "  wall: {box: [0.02, 0.36, 0.25], pose: {position: [0.16, 0, 0.125]}}\n";
const std::string kFront =
    "  - {name: front, width: 160, height: 120, fov_deg: 45, look: {from: [0.6, 0, 0.3], at: [0, 0, 0.04]}}\n";
const std::string kSide =
    "  - {name: side, width: 160, height: 120, fov_deg: 45, look: {from: [-0.45, 0.4, 0.4], at: [0, 0, 0.04]}}\n";
const std::string kBoth = "cameras:\n" + kFront + kSide;

constexpr core::TimeNs kAtRestNs = 500'000'000;  // the box slides for less than 0.2 s

struct Tracked {
  std::vector<std::string> hashes;
  std::vector<int> cameras;
  std::vector<belief::TrackState> states;
  std::vector<std::string> degraded;  // of the last step
  double largest_error = 0.0;         // m, of tracked frames ...
  double rest_error = 0.0;            // ... and of those in which the box lies still again
  // At each instant at which any camera took a frame, as it was believed then: whether it was tracked, and how far the
  // mean was off, m.
  std::vector<bool> tracked_then;
  std::vector<double> errors_then;
};

/// What may be done to the messages: false leaves one out.
using Change = std::function<bool(interfaces::ReceivedMessage&)>;

/// Plays the recording to a tracker of `scene_text`.
Tracked track(const std::filesystem::path& path, const std::string& scene_text, int threads = 1,
              const Change& change = {}) {
  Tracked tracked;
  core::ThreadPool pool(threads);
  Backends backends(pool);
  const auto scene = load_scene_text(scene_text, "scene.yaml", {});
  EXPECT_TRUE(scene.ok()) << scene.status().message();
  const auto tracker = Tracker::create(*scene, {}, 1, backends);
  EXPECT_TRUE(tracker.ok()) << tracker.status().message();
  const auto reader = RecordingReader::open(path);
  EXPECT_TRUE(reader.ok()) << reader.status().message();
  std::map<core::TimeNs, geometry::Pose> truth, believed;
  std::map<core::TimeNs, std::pair<bool, geometry::Pose>> all;  // with those of frames in which it was not tracked
  for (;;) {
    auto entry = (*reader)->next();
    EXPECT_TRUE(entry.ok());
    if (!entry.ok() || !*entry) break;
    interfaces::ReceivedMessage& message = (*entry)->message;
    if ((*entry)->is_json) {
      const std::string json(message.cdr.begin(), message.cdr.end());
      if (message.topic != kTruthTopic) continue;
      const TruthRecord record = *truth_from_json(json);
      truth[record.stamp_ns] = record.objects.at(0).X_WO;
      continue;
    }
    if (change && !change(message)) continue;
    EXPECT_TRUE((*tracker)->take_in(message, (*entry)->index).ok());
    while (const auto step = (*tracker)->step(message.received_ns)) {
      const belief::Belief& belief = *(*tracker)->belief();
      tracked.hashes.push_back(step->record.belief_hash);
      tracked.cameras.push_back(step->record.camera);
      tracked.degraded = step->record.degraded;
      tracked.states.push_back(belief.objects.at(0).state);
      const bool is_tracked = belief.objects[0].state == belief::TrackState::kTracked;
      all[belief.stamp_ns] = {is_tracked, belief::estimate(belief, belief.objects[0]).mean};
      if (is_tracked) believed[belief.stamp_ns] = all[belief.stamp_ns].second;
    }
  }
  for (const auto& [stamp_ns, X_WO] : truth) {
    const auto after = all.upper_bound(stamp_ns);
    if (after == all.begin()) continue;
    const auto& [is_tracked, X_WO_believed] = std::prev(after)->second;
    tracked.tracked_then.push_back(is_tracked);
    tracked.errors_then.push_back((X_WO.translation - X_WO_believed.translation).norm());
  }
  for (const auto& [stamp_ns, X_WO] : believed) {
    const double error = (truth.at(stamp_ns).translation - X_WO.translation).norm();
    tracked.largest_error = std::max(tracked.largest_error, error);
    if (stamp_ns - believed.begin()->first > kAtRestNs) tracked.rest_error = std::max(tracked.rest_error, error);
  }
  return tracked;
}

/// The side's images as if they had been taken with the front's, which came before them.
class TriggeredTogether {
 public:
  bool operator()(interfaces::ReceivedMessage& message) {
    if (message.type != "sensor_msgs/msg/Image") return true;
    auto image = *interfaces::decode_cdr<interfaces::RosImage>(message.cdr);
    if (message.topic.rfind("/front/", 0) == 0) {
      front_ = image.header.stamp;
    } else {
      image.header.stamp = front_;
      message.cdr = interfaces::encode_cdr(image);
    }
    return true;
  }

 private:
  interfaces::RosTime front_;
};

class SeveralCameras : public testing::Test {
 protected:
  std::filesystem::path record(const std::string& scene, double rate = 15.0) {
    const std::filesystem::path path = folder_.path() / "run.mcap";
    const core::Status recorded = tests::record_scene(scene, {"scene.yaml", scene, 1, ""}, rate, path);
    EXPECT_TRUE(recorded.ok()) << recorded.message();
    return path;
  }

  tests::ScratchDir folder_;
};

TEST_F(SeveralCameras, KeepWhatOneOfThemSees) {
  const std::string scene = sliding_box(kWall, kBoth);
  const Tracked tracked = track(record(scene), scene);
  EXPECT_EQ(std::set<int>(tracked.cameras.begin(), tracked.cameras.end()), (std::set<int>{0, 1}));
  ASSERT_GE(tracked.states.size(), 30U);
  EXPECT_EQ(tracked.states.front(), belief::TrackState::kUnseen)
      << "the first frame is of the camera that sees nothing";
  for (std::size_t i = 1; i < tracked.states.size(); ++i)
    EXPECT_EQ(tracked.states[i], belief::TrackState::kTracked) << i;
  EXPECT_LT(tracked.largest_error, 0.010) << "in the frame in which it stops";
  EXPECT_LT(tracked.rest_error, 0.002);
  // The same bits again, and with two threads.
  EXPECT_EQ(track(folder_.path() / "run.mcap", scene, 2).hashes, tracked.hashes);
  // The hidden one alone knows nothing.
  const Tracked front = track(folder_.path() / "run.mcap", sliding_box(kWall, "cameras:\n" + kFront));
  EXPECT_EQ(std::count(front.states.begin(), front.states.end(), belief::TrackState::kTracked), 0);
}

/// Share of the instants at which it was tracked, and the median error at all of them.
std::pair<double, double> share_and_error(const std::vector<Tracked>& runs) {
  std::vector<double> errors;
  double count = 0.0;
  for (const Tracked& run : runs) {
    errors.insert(errors.end(), run.errors_then.begin(), run.errors_then.end());
    count += static_cast<double>(std::count(run.tracked_then.begin(), run.tracked_then.end(), true));
  }
  if (errors.empty()) return {0.0, 0.0};
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return {count / static_cast<double>(errors.size()), *middle};
}

/// A box is pushed, which nobody tells, from behind one board to behind another: at each instant one of two cameras
/// sees it. PRESCENE_CAMERA_RUNS=8 repeats it at other speeds, and prints the figures of docs/studies/tracking.md.
TEST_F(SeveralCameras, SeeWhatEachAloneMisses) {
  const std::string front =
      "  - {name: front, width: 160, height: 120, fov_deg: 50, look: {from: [0.8, 0, 0.35], at: [0, 0, 0.04]}}\n";
  const std::string back =
      "  - {name: back, width: 160, height: 120, fov_deg: 50, look: {from: [-0.8, 0, 0.35], at: [0, 0, 0.04]}}\n";
  const auto scene = [](const std::string& cameras, double speed) {
    return R"(name: two_boards
duration: 3.4
stop_at_rest: false
models:
  box: {box: [0.08, 0.06, 0.08], mass: 0.4, friction: 0.4}
supports:
  table: {box: [1.6, 1.6, 0.04], pose: {position: [0, 0, -0.02]}}
  front_board: {box: [0.02, 0.34, 0.25], pose: {position: [0.2, -0.19, 0.125]}}
  back_board: {box: [0.02, 0.34, 0.25], pose: {position: [-0.2, 0.19, 0.125]}}
objects:
  box: {model: box, pose: {position: [0, -0.17, 0.04]}}
actions:
  - {time: 0.2, push: {from: [0, -0.24, 0.03], to: [0, 0.12, 0.03], duration: )" +
           std::to_string(0.36 / speed) + "}}\ncameras:\n" + cameras;
  };
  const char* asked = std::getenv("PRESCENE_CAMERA_RUNS");
  const int runs = asked != nullptr ? std::max(1, std::atoi(asked)) : 1;
  std::array<std::vector<Tracked>, 3> tracked;  // by the front, the back, both
  for (int run = 0; run < runs; ++run) {
    const double speed = 0.12 + 0.005 * run;  // m/s
    const std::filesystem::path path = record(scene(front + back, speed), 10.0);
    const std::array<std::string, 3> cameras = {front, back, front + back};
    for (std::size_t i = 0; i < cameras.size(); ++i)
      tracked.at(i).push_back(
          track(path, scene(cameras.at(i), speed), 1,
                [](const interfaces::ReceivedMessage& message) { return message.topic != kControlTopic; }));
  }
  const auto [front_share, front_error] = share_and_error(tracked[0]);
  const auto [back_share, back_error] = share_and_error(tracked[1]);
  const auto [both_share, both_error] = share_and_error(tracked[2]);
  if (asked != nullptr)
    for (const auto& of : tracked)
      std::printf("tracked %.3f, median error %.1f mm\n", share_and_error(of).first, 1e3 * share_and_error(of).second);
  EXPECT_LT(front_share, 0.6) << "it sees the box for half of the time";
  EXPECT_LT(back_share, 0.6);
  EXPECT_GT(both_share, std::max(front_share, back_share));
  EXPECT_LT(both_error, std::max(front_error, back_error));
}

TEST_F(SeveralCameras, OneInAListIsAsOneByItself) {
  const std::string view = "width: 160, height: 120, fov_deg: 45, look: {from: [0.6, 0, 0.3], at: [0, 0, 0.04]}}\n";
  const std::string alone = sliding_box("", "camera: {" + view),
                    listed = sliding_box("", "cameras:\n  - {name: camera, " + view);
  const std::filesystem::path path = record(alone);
  const Tracked tracked = track(path, alone);
  EXPECT_GE(tracked.hashes.size(), 15U);
  EXPECT_EQ(track(path, listed).hashes, tracked.hashes);
}

TEST_F(SeveralCameras, OfWhichOneIsNotWhereTfSaysStayOnTheObject) {
  const std::string scene = sliding_box("", kBoth);
  const std::filesystem::path path = record(scene);
  const Tracked well = track(path, scene);
  EXPECT_LT(well.largest_error, 0.010);
  EXPECT_LT(well.rest_error, 0.002);
  const auto displaced = [](interfaces::ReceivedMessage& message) {
    if (message.topic != "/tf_static") return true;
    auto tf = *interfaces::decode_cdr<interfaces::RosTfMessage>(message.cdr);
    for (interfaces::RosTransformStamped& transform : tf.transforms)
      if (transform.child_frame_id == "side_optical_frame") transform.transform.translation.x += 0.004;
    message.cdr = interfaces::encode_cdr(tf);
    return true;
  };
  const Tracked off = track(path, scene, 1, displaced);
  EXPECT_EQ(std::count(off.states.begin(), off.states.end(), belief::TrackState::kTracked),
            static_cast<std::ptrdiff_t>(off.states.size()));
  EXPECT_LT(off.rest_error, 0.006) << "not further than the two are apart";
}

TEST_F(SeveralCameras, OfWhichOneStopsGoOnAndSaySo) {
  const std::string scene = sliding_box("", kBoth, "2");
  const std::filesystem::path path = record(scene, 8.0);
  int frames = 0;
  const Tracked tracked = track(path, scene, 1, [&](const interfaces::ReceivedMessage& message) {
    return message.topic != "/side/aligned_depth_to_color/image_raw" || ++frames < 4;
  });
  EXPECT_EQ(tracked.cameras.back(), 0);
  EXPECT_EQ(tracked.states.back(), belief::TrackState::kTracked);
  EXPECT_THAT(tracked.degraded, testing::Contains(testing::HasSubstr("camera 'side': it sends no more depth images")));
}

TEST_F(SeveralCameras, ThatAreTriggeredTogetherAreBothUsed) {
  std::string scene = sliding_box(kWall, kBoth);
  const std::string velocity = ", velocity: [0, 0.6, 0]";
  scene.erase(scene.find(velocity), velocity.size());
  const Tracked tracked = track(record(scene), scene, 1, TriggeredTogether());
  ASSERT_GE(tracked.states.size(), 30U);
  for (std::size_t i = 1; i < tracked.states.size(); ++i)
    EXPECT_EQ(tracked.states[i], belief::TrackState::kTracked) << i;
  EXPECT_TRUE(tracked.degraded.empty());
  EXPECT_EQ(std::count(tracked.cameras.begin(), tracked.cameras.end(), 1),
            static_cast<std::ptrdiff_t>(tracked.cameras.size() / 2));
  EXPECT_LT(tracked.largest_error, 0.005);
}

/// A service that is busy with each step while `busy` messages come is recorded, and its steps come to the same bits.
void expect_repeated(const std::filesystem::path& robot, const std::filesystem::path& session, const std::string& text,
                     int busy) {
  core::ThreadPool pool(1);
  Backends backends(pool);
  const auto scene = load_scene_text(text, "scene.yaml", {});
  ASSERT_TRUE(scene.ok());
  const auto tracker = Tracker::create(*scene, {}, 1, backends);
  const auto writer = RecordingWriter::create(session, {"scene.yaml", text, 1, ""});
  const auto reader = RecordingReader::open(robot);
  ASSERT_TRUE(tracker.ok() && writer.ok() && reader.ok());
  std::uint64_t steps = 0;
  int busy_until = 0, number = 0;
  for (auto entry = (*reader)->next(); entry.ok() && *entry; entry = (*reader)->next()) {
    if ((*entry)->is_json) continue;
    const auto index = (*writer)->write((*entry)->message);
    ASSERT_TRUE(index.ok());
    ASSERT_TRUE((*tracker)->take_in((*entry)->message, *index).ok());
    ++number;
    while (number > busy_until) {
      const auto step = (*tracker)->step((*entry)->message.received_ns);
      if (!step) break;
      ++steps;
      busy_until = busy > 0 ? number + busy : 0;
      const std::string json = belief::json_text(to_json(step->record));
      ASSERT_TRUE((*writer)->write_json(kStepTopic, json, (*entry)->message.received_ns).ok());
    }
  }
  ASSERT_TRUE((*writer)->close().ok());
  const auto again = Tracker::create(*scene, {}, 1, backends);
  const auto summary = replay_recording(session, {}, **again, {}, {}, {}, {});
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->followed_step_records);
  EXPECT_EQ(summary->compared, steps);
  EXPECT_GE(steps, 10U);
  EXPECT_EQ(summary->different, 0U) << busy;
  if (busy == 0) {
    EXPECT_EQ(summary->skipped, 0U);
  }
}

TEST_F(SeveralCameras, AreReplayedStepByStep) {
  const std::string text = sliding_box(kWall, kBoth);
  const std::filesystem::path robot = record(text, 8.0);
  expect_repeated(robot, folder_.path() / "session.mcap", text, 0);
}

TEST_F(SeveralCameras, AreReplayedStepByStepWhereTheServiceDidNotKeepUp) {
  const std::string text = sliding_box(kWall, kBoth);
  const std::filesystem::path robot = record(text, 30.0);
  expect_repeated(robot, folder_.path() / "slow.mcap", text, 10);
}

}  // namespace
}  // namespace prescene::service::several_cameras_test
