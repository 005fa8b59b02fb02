// SPDX-License-Identifier: Apache-2.0
// What the bus and recordings cost: from writing a frame to the belief that is published of it, a recorder's share of a
// core and its loss when it is killed, how fast a recording is replayed, and what the live view costs who tracks.
//
//   bench_interfaces [--quick] [--only=PART] [--seconds=N] [--domain=N] [--benchmark_out=PATH]
//
// --only: bus, recorder, replay or view. --seconds: of each measurement at 30 Hz (30; quick 8). The service, the
// recorder and the reader by Cyclone's own interface are processes of their own; the robot that writes is this one.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <vector>

#include "benchmarks/arguments.h"
#include "benchmarks/interfaces_processes.h"
#include "benchmarks/report.h"
#include "benchmarks/statistics.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/recording/simulated_recording.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

using interfaces::DdsNode;
using interfaces::TopicQos;
using std::chrono::steady_clock;

constexpr double kRate = 30.0;

// One object on a table, as an ordinary RGB-D camera sees it.
constexpr const char* kScene = R"(name: bench
duration: 2.0
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.05], normal: {position: [0.005, 0.005, 0]}}}
camera:
  width: 640
  height: 480
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
)";

struct Options {
  double seconds = 30.0;
  int domain = 97;
  std::string only;  // "" = all
  std::string out;

  bool measures(const char* part) const { return only.empty() || only == part; }
};

struct Frames {
  std::vector<interfaces::RosImage> depths, colors;
  interfaces::RosCameraInfo info;
  interfaces::RosTfMessage pose;
};

core::Status record(const std::filesystem::path& path) {
  core::ThreadPool pool;
  service::Backends backends(pool);
  PRESCENE_TRY(const auto scene, service::load_scene_text(kScene, "bench.yaml", {}));
  PRESCENE_TRY(const auto recording, service::RecordingWriter::create(path, {"bench.yaml", kScene, 1, ""}));
  service::SimulatedRecordingOptions options;
  options.rate = kRate;
  PRESCENE_RETURN_IF_ERROR(service::simulate_recording(*scene, options, 1, backends, {}, {}, *recording));
  return recording->close();
}

core::Result<Frames> read_frames(const std::filesystem::path& path) {
  PRESCENE_TRY(const auto reader, service::RecordingReader::open(path));
  const service::InputTopics topics;
  Frames frames;
  for (;;) {
    PRESCENE_TRY(const auto entry, reader->next());
    if (!entry) return frames;
    const auto& [topic, cdr] = std::tie(entry->message.topic, entry->message.cdr);
    if (topic == topics.depth) {
      PRESCENE_TRY(frames.depths.emplace_back(), interfaces::decode_cdr<interfaces::RosImage>(cdr));
    } else if (topic == topics.color) {
      PRESCENE_TRY(frames.colors.emplace_back(), interfaces::decode_cdr<interfaces::RosImage>(cdr));
    } else if (topic == topics.camera_info) {
      PRESCENE_TRY(frames.info, interfaces::decode_cdr<interfaces::RosCameraInfo>(cdr));
    } else if (topic == topics.tf_static) {
      PRESCENE_TRY(frames.pose, interfaces::decode_cdr<interfaces::RosTfMessage>(cdr));
    }
  }
}

/// Writes frames at 30 Hz; the stamp is the time at which the depth image, the last of its frame, is written.
class Robot {
 public:
  static core::Result<std::unique_ptr<Robot>> join(const Frames& frames, int domain) {
    auto robot = std::unique_ptr<Robot>(new Robot(frames));
    interfaces::DdsOptions options;
    options.domain = domain;
    options.node_name = "bench_robot";
    const service::InputTopics topics;
    PRESCENE_TRY(robot->node_, DdsNode::create(options, {}));
    DdsNode& node = *robot->node_;
    PRESCENE_TRY(robot->depth_, node.advertise(topics.depth, "sensor_msgs/msg/Image", TopicQos::kImages));
    PRESCENE_TRY(robot->color_, node.advertise(topics.color, "sensor_msgs/msg/Image", TopicQos::kImages));
    PRESCENE_TRY(robot->info_, node.advertise(topics.camera_info, "sensor_msgs/msg/CameraInfo", TopicQos::kReliable));
    PRESCENE_TRY(robot->tf_, node.advertise(topics.tf, "tf2_msgs/msg/TFMessage", TopicQos::kTf));
    return robot;
  }

  bool wait_for_readers(int readers) const {
    for (int i = 0; i < 400 && node_->matched_readers(depth_) < readers; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return node_->matched_readers(depth_) >= readers;
  }

  /// How many writes the middleware refused.
  int write(double seconds) {
    int refused = 0;
    const auto start = steady_clock::now();
    const int count = static_cast<int>(seconds * kRate);
    for (int i = 0; i < count; ++i) {
      std::this_thread::sleep_until(start + std::chrono::duration<double>(i / kRate));
      const std::size_t frame = static_cast<std::size_t>(i) % frames_.depths.size();
      const core::TimeNs stamp_ns = core::wall_now_ns();
      const interfaces::RosTime stamp = interfaces::to_ros_time(stamp_ns);
      interfaces::RosTfMessage pose = frames_.pose;
      for (auto& transform : pose.transforms) transform.header.stamp = stamp;
      interfaces::RosCameraInfo info = frames_.info;
      info.header.stamp = stamp;
      interfaces::RosImage& color = frames_.colors[frame];
      interfaces::RosImage& depth = frames_.depths[frame];
      color.header.stamp = depth.header.stamp = stamp;
      refused += node_->publish(tf_, pose).ok() ? 0 : 1;
      refused += node_->publish(info_, info).ok() ? 0 : 1;
      refused += node_->publish(color_, color).ok() ? 0 : 1;
      refused += node_->publish(depth_, depth).ok() ? 0 : 1;
    }
    return refused;
  }

 private:
  explicit Robot(const Frames& frames) : frames_(frames) {}
  Frames frames_;
  std::unique_ptr<DdsNode> node_;
  interfaces::DdsPublisher depth_, color_, info_, tf_;
};

/// The value below which this share of them lies.
std::optional<double> milliseconds(std::vector<double> seconds, double share) {
  if (seconds.empty()) return std::nullopt;
  const auto at = static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(seconds.size() - 1)));
  std::nth_element(seconds.begin(), seconds.begin() + at, seconds.end());
  return 1e3 * *(seconds.begin() + at);
}

/// From the bus to a published belief, with a bare reader beside it.
core::Status measure_bus(const Frames& frames, const Options& arguments, Child& service, Child& bare,
                         const SharedFigures<FrameTimes>& steps, const SharedFigures<double>& delays, Report* report) {
  PRESCENE_TRY(const auto robot, Robot::join(frames, arguments.domain));
  if (!robot->wait_for_readers(2)) return core::unavailable("the service and the bare reader do not listen");
  robot->write(2.0);  // the first frames find the object
  const std::size_t warm = steps.all().size(), warm_bare = delays.all().size();
  const int refused = robot->write(arguments.seconds);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  service.stop();
  bare.stop();
  std::vector<double> published, begun, step;
  const std::vector<FrameTimes> times = steps.all();
  for (std::size_t i = warm; i < times.size(); ++i) {
    published.push_back(times[i].published);
    begun.push_back(times[i].begun);
    step.push_back(times[i].step);
  }
  std::vector<double> raw = delays.all();
  raw.erase(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(std::min(warm_bare, raw.size())));
  const auto n = static_cast<std::int64_t>(published.size());
  const int written = static_cast<int>(arguments.seconds * kRate);
  const std::string counts = std::to_string(n) + " beliefs of " + std::to_string(written) + " frames, " +
                             std::to_string(refused) + " writes refused; the step itself takes " +
                             core::rounded_text(milliseconds(step, 0.5).value_or(0.0)) +
                             " ms (median); colour, camera info and tf are written after the stamp, too";
  report->add({.work = "30 Hz 640x480 RGB-D, one object: write on the bus to belief published, median",
               .better = Better::kLower,
               .must = at_most(12.0),
               .aim = at_most(6.0),
               .reached = milliseconds(published, 0.5),
               .unit = "ms",
               .n = n,
               .baseline = "none",
               .why = counts});
  report->add({.work = "the same, 99 %",
               .better = Better::kLower,
               .must = at_most(35.0),
               .aim = at_most(15.0),
               .reached = milliseconds(published, 0.99),
               .unit = "ms",
               .n = n,
               .baseline = "none",
               .why = published.empty() ? "no belief came" : ""});
  const auto ours = milliseconds(begun, 0.5), theirs = milliseconds(raw, 0.5);
  report->add({.work = "added to raw Cyclone from write to belief input, median",
               .better = Better::kLower,
               .must = at_most(2.0),
               .aim = at_most(1.0),
               .reached = ours && theirs ? std::optional(*ours - *theirs) : std::nullopt,
               .unit = "ms",
               .n = n,
               .baseline = "a process that takes the depth images by Cyclone's C interface in the same run: " +
                           core::rounded_text(theirs.value_or(0.0)) + " ms, n = " + std::to_string(raw.size()),
               .why = "an upper bound: writing the frame's other messages, converting images and publishing the belief "
                      "are counted in"});
  Table table{"frames", {"published ms", "begun ms", "step ms"}, {}};
  for (std::size_t i = 0; i < published.size(); ++i)
    table.rows.push_back({1e3 * published[i], 1e3 * begun[i], 1e3 * step[i]});
  report->add(table);
  return core::ok_status();
}

/// The share of a core of a recorder, and what is missing at the end of its file when it is killed.
core::Status measure_recorder(const Frames& frames, const Options& arguments, Child& recorder,
                              const std::filesystem::path& path, Report* report) {
  PRESCENE_TRY(const auto robot, Robot::join(frames, arguments.domain + 1));
  if (!robot->wait_for_readers(1)) return core::unavailable("the recorder does not listen");
  robot->write(1.0);
  const double before = recorder.processor_seconds();
  const core::Stopwatch watch;
  robot->write(arguments.seconds);
  const double share = (recorder.processor_seconds() - before) / watch.seconds();
  const core::TimeNs killed_ns = core::steady_now_ns();
  recorder.stop(true);
  PRESCENE_TRY(const auto reader, service::RecordingReader::open(path));
  core::TimeNs last_ns = 0;
  std::int64_t depths = 0;
  for (;;) {
    PRESCENE_TRY(const auto entry, reader->next());
    if (!entry) break;
    last_ns = std::max(last_ns, entry->message.received_ns);
    depths += entry->message.topic == service::InputTopics().depth ? 1 : 0;
  }
  const auto expected = static_cast<std::int64_t>((arguments.seconds + 1.0) * kRate);
  report->add({.work = "recording 640x480 RGB-D at 30 Hz: share of a core",
               .better = Better::kLower,
               .must = at_most(20.0),
               .aim = at_most(10.0),
               .reached = 100.0 * share,
               .unit = "%",
               .n = depths,
               .baseline = "none",
               .why = "the whole recorder process, with receiving and compressing; " + std::to_string(depths) + " of " +
                      std::to_string(expected) + " depth images are in the file"});
  report->add({.work = "recording: lost at kill -9",
               .better = Better::kLower,
               .must = at_most(0.5),
               .aim = at_most(0.2),
               .reached = core::seconds_of(killed_ns - last_ns),
               .unit = "s",
               .n = 1,
               .baseline = "from the newest message in the file to the kill",
               .why = reader->loss_text()});
  return core::ok_status();
}

core::Status measure_replay(const std::filesystem::path& path, int runs, Report* report) {
  core::ThreadPool pool;
  service::Backends backends(pool);
  std::vector<double> speeds;
  std::int64_t steps = 0;
  for (int run = 0; run < runs; ++run) {
    const core::Stopwatch watch;
    PRESCENE_TRY(const auto input, service::ReplayInput::open({.path = path, .scene_file = {}}, {}));
    PRESCENE_TRY(const auto tracker, service::Tracker::create(input.scene(), {}, 1, backends));
    PRESCENE_TRY(const auto summary, input.replay(*tracker, {}, {}, {}, {}));
    steps = static_cast<std::int64_t>(summary.steps);
    speeds.push_back(static_cast<double>(summary.steps) / kRate / watch.seconds());
  }
  report->add({.work = "replay as fast as possible, one object, 640x480 at 30 Hz, median",
               .must = at_least(4.0),
               .aim = at_least(10.0),
               .reached = median(speeds),
               .unit = "x real time",
               .n = runs,
               .baseline = "the recording's own duration",
               .why = std::to_string(steps) + " steps each; opening the recording and finding the object are counted"});
  return core::ok_status();
}

constexpr int kPages = 20;
constexpr int kViewPort = 18765;

/// A step's time with pages at the live view over that without, in phases that alternate, so that what else the machine
/// does falls on both.
core::Status measure_view(const Frames& frames, const Options& arguments, const SharedFigures<FrameTimes>& steps,
                          SharedFigures<double>& phases, const SharedFigures<double>& taken, Report* report) {
  PRESCENE_TRY(const auto robot, Robot::join(frames, arguments.domain + 2));
  if (!robot->wait_for_readers(1)) return core::unavailable("the service with a live view does not listen");
  robot->write(2.0);  // the first frames find the object
  constexpr int kPhases = 12;
  std::array<std::vector<double>, 2> seconds;  // without and with pages
  for (int phase = 0; phase < kPhases; ++phase) {
    if (phase > 0) phases.add(0.0);
    robot->write(0.5);  // pages open, or close
    const std::size_t begin = steps.all().size();
    robot->write(arguments.seconds / (kPhases / 2));
    const std::vector<FrameTimes> all = steps.all();
    for (std::size_t i = begin; i < all.size(); ++i) seconds[phase % 2].push_back(all[i].step);
  }
  phases.add(0.0);
  robot->write(0.5);
  double bytes = 0.0;
  for (const double of_phase : taken.all()) bytes += of_phase;
  const auto without = milliseconds(seconds[0], 0.5), with = milliseconds(seconds[1], 0.5);
  report->add({.work = "live view, 20 clients, one frozen: the filter's frame time",
               .better = Better::kLower,
               .must = at_most(1.05),
               .aim = at_most(1.01),
               .reached = with && without && bytes > 0.0 ? std::optional(*with / *without) : std::nullopt,
               .unit = "x",
               .n = static_cast<std::int64_t>(seconds[1].size()),
               .baseline = "the same service without a page, in phases that alternate: " +
                           core::rounded_text(without.value_or(0.0)) + " ms, n = " + std::to_string(seconds[0].size()),
               .why = "medians; the 19 pages that read took " + core::rounded_text(1e-6 * bytes) + " MB"});
  return core::ok_status();
}

/// Targets of interfaces that this program does not measure.
void add_unmeasured(Report* report) {
  const auto add = [&](const char* work, Better better, Goal must, Goal aim, const char* unit, const char* why) {
    report->add(
        {.work = work, .better = better, .must = must, .aim = aim, .reached = std::nullopt, .unit = unit, .why = why});
  };
  add("memory slope over a soak", Better::kLower, at_most(1.0), at_most(0.0), "MB/h", "takes hours");
}

int run(const Options& arguments) {
  const tests::ScratchDir folder;
  const std::filesystem::path recorded = folder.path() / "robot.mcap", played = folder.path() / "played.mcap";
  SharedFigures<FrameTimes> steps(1 << 16);
  SharedFigures<double> delays(1 << 16);
  // Before this process has threads.
  Child simulator = Child::start([&](const core::Cancellation&) {
    const core::Status status = record(played);
    if (!status.ok()) std::fprintf(stderr, "%s\n", status.message().c_str());
  });
  simulator.wait();
  SharedFigures<FrameTimes> viewed_steps(1 << 16);
  SharedFigures<double> phases(1 << 8), taken(1 << 8);
  std::optional<Child> service, bare, recorder, viewed, pages;
  if (arguments.measures("bus")) {
    service = Child::start([&](const core::Cancellation& c) { run_service(kScene, arguments.domain, steps, c); });
    bare = Child::start([&](const core::Cancellation& c) { run_bare_reader(arguments.domain, delays, c); });
  }
  if (arguments.measures("recorder"))
    recorder = Child::start([&](const core::Cancellation& c) { run_recorder(arguments.domain + 1, recorded, c); });
  if (arguments.measures("view")) {
    viewed = Child::start(
        [&](const core::Cancellation& c) { run_service(kScene, arguments.domain + 2, viewed_steps, c, kViewPort); });
    pages = Child::start([&](const core::Cancellation& c) { run_pages(kViewPort, kPages, phases, taken, c); });
  }
  Report report("interfaces", best_simd_target());
  const auto measure = [&]() -> core::Status {
    PRESCENE_TRY(const Frames frames, read_frames(played));
    if (service) PRESCENE_RETURN_IF_ERROR(measure_bus(frames, arguments, *service, *bare, steps, delays, &report));
    if (recorder) PRESCENE_RETURN_IF_ERROR(measure_recorder(frames, arguments, *recorder, recorded, &report));
    if (viewed) PRESCENE_RETURN_IF_ERROR(measure_view(frames, arguments, viewed_steps, phases, taken, &report));
    if (!arguments.measures("replay")) return core::ok_status();
    return measure_replay(played, arguments.seconds < 20.0 ? 3 : 9, &report);
  };
  const core::Status status = measure();
  for (std::optional<Child>* child : {&service, &bare, &recorder, &pages, &viewed})
    if (*child) (*child)->stop(true);
  if (!status.ok()) {
    std::fprintf(stderr, "%s\n", core::to_string(status).c_str());
    return 1;
  }
  if (arguments.only.empty()) add_unmeasured(&report);
  std::fputs(report.text().c_str(), stdout);
  return report.finish(arguments.out);
}

}  // namespace
}  // namespace prescene::benchmarks

int main(int count, char** words) {
  prescene::benchmarks::Options options;
  prescene::benchmarks::Arguments arguments;
  arguments.flag("quick", [&] { options.seconds = 8.0; });
  arguments.number("seconds", 0.1, 1e6, &options.seconds);
  arguments.number("domain", 1, 230, &options.domain);
  arguments.one_of("only", {"bus", "recorder", "replay", "view"}, &options.only);
  arguments.text("benchmark_out", "PATH", &options.out);
  return arguments.parse(count, words) ? prescene::benchmarks::run(options) : 2;
}
