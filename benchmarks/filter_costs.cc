// SPDX-License-Identifier: Apache-2.0
// What a frame costs: processor time with resting objects and a moving one beside them, and memory.
#include <fstream>
#include <limits>
#include <string>

#include "benchmarks/filter_targets.h"
#include "benchmarks/statistics.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/simulated_recording.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

constexpr double kRate = 30.0;         // Hz
constexpr std::size_t kSettling = 10;  // frames at the start that are not measured: objects are found and caches filled
constexpr int kModels = 20;            // of the scene that memory is measured with
constexpr int kMemoryObjects = 5;

std::string number(double value) { return core::fixed_text(value, 4); }

/// Boxes, cans and cartons in turn.
std::string models(int count) {
  std::string text = "models:\n";
  for (int i = 0; i < count; ++i) {
    const std::string name = "  model_" + std::to_string(i);
    const double size = 1.0 + 0.02 * i;
    if (i % 3 == 0)
      text += name + ": {box: [" + number(0.07 * size) + ", 0.05, " + number(0.1 * size) +
              "], mass: 0.3, symmetry: cuboid}\n";
    else if (i % 3 == 1)
      text += name + ": {cylinder: {radius: " + number(0.03 * size) +
              ", length: 0.1}, mass: 0.3, symmetry: {axis: z, continuous: true, flip: true}}\n";
    else
      text += name + ": {gable_carton: {base: [" + number(0.06 * size) +
              ", 0.06], shoulder_height: 0.1, height: 0.13}, mass: 0.4, symmetry: {axis: z, order: 2}}\n";
  }
  return text;
}

/// `resting` objects in rows, and one in front that a pusher takes along if `moving`; seen by a camera of 640 x 480.
std::string table_scene(int resting, bool moving, int model_count, double duration) {
  std::string objects = "objects:\n";
  for (int i = 0; i < resting; ++i)
    objects += "  object_" + std::to_string(i) + ": {model: model_" + std::to_string(i % model_count) +
               ", pose: {position: [" + number(-0.3 + 0.2 * (i % 4)) + ", " + number(-0.05 + 0.17 * (i / 4)) + ", " +
               (i % 3 == 2   ? "0.065"
                : i % 3 == 0 ? number(0.05 * (1.0 + 0.02 * i))
                             : "0.05") +
               "]}}\n";
  if (moving) objects += "  pushed: {model: model_0, pose: {position: [-0.2, -0.22, 0.05]}}\n";
  return "name: resting\nduration: " + number(duration) + "\n" + models(model_count) +
         "supports:\n  table: {box: [1.4, 1.0, 0.04], pose: {position: [0, 0, -0.02]}}\n" + objects +
         "camera: {fov_deg: 58, look: {from: [0.0, -0.95, 0.65], at: [0, 0.08, 0.03]}}\n" +
         (moving ? "actions:\n  - {time: 0.1, push: {from: [-0.3, -0.22, 0.05], to: [0.2, -0.22, 0.05], duration: " +
                       number(duration - 0.2) + ", radius: 0.015}}\n"
                 : "");
}

/// Tracks what a simulated camera sees of `yaml`; `on_frame` after each frame.
core::Status track(const std::string& yaml, std::uint64_t seed, core::ThreadPool& threads,
                   const std::function<void(std::size_t)>& on_frame) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "run.mcap";
  service::Backends backends(threads, {});
  PRESCENE_TRY(const auto scene, service::load_scene_text(yaml, "scene.yaml", {}));
  PRESCENE_TRY(const auto recording, service::RecordingWriter::create(path, {"scene.yaml", yaml, seed, ""}));
  service::SimulatedRecordingOptions options;
  options.rate = kRate;
  PRESCENE_RETURN_IF_ERROR(simulate_recording(*scene, options, seed, backends, {}, {}, *recording));
  PRESCENE_RETURN_IF_ERROR(recording->close());
  PRESCENE_TRY(const auto tracker, service::Tracker::create(scene, {}, seed, backends));
  std::size_t frame = 0;
  const service::StepSink on_step = [&](const service::TrackerStep&, const service::Tracker&) {
    on_frame(frame++);
    return core::ok_status();
  };
  return service::replay_recording(path, {}, *tracker, {}, {}, on_step, {}).status();
}

/// Median processor time of a frame, ms; decoding of the recording included.
core::Result<double> cost(const std::string& yaml, std::uint64_t seed, core::ThreadPool& threads) {
  std::vector<double> times;
  double before = core::process_cpu_seconds();
  PRESCENE_RETURN_IF_ERROR(track(yaml, seed, threads, [&](std::size_t frame) {
    const double now = core::process_cpu_seconds();
    if (frame >= kSettling) times.push_back(1e3 * (now - before));
    before = core::process_cpu_seconds();
  }));
  return median(std::move(times));
}

/// Resident memory of this process, MB; NaN where the system does not tell.
double resident_megabytes() {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024.0;
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

core::Status add_cost_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  const double duration = effort.cost_frames / kRate;
  struct Row {
    int objects;
    double must, aim;
  };
  Table table{"cost", {"resting objects", "ms a frame", "with a moving one beside them, ms"}, {}};
  double largest_more = 0.0;
  for (const Row& row : {Row{1, 8.0, 3.0}, Row{5, 30.0, 10.0}, Row{12, 80.0, 25.0}}) {
    PRESCENE_TRY(const double resting, cost(table_scene(row.objects, false, 12, duration), effort.seed, threads));
    PRESCENE_TRY(const double with_moving, cost(table_scene(row.objects, true, 12, duration), effort.seed, threads));
    table.rows.push_back({std::int64_t{row.objects}, resting, with_moving});
    largest_more = std::max(largest_more, with_moving - resting);
    report->add({.work = "processor time a frame, " + std::to_string(row.objects) + " resting",
                 .better = Better::kLower,
                 .must = at_most(row.must),
                 .aim = at_most(row.aim),
                 .reached = resting,
                 .unit = "ms",
                 .n = effort.cost_frames - static_cast<int>(kSettling),
                 .baseline = "none",
                 .why = "median over frames of 640 x 480, reading the recording included"});
  }
  report->add({.work = "processor time a frame, one more that moves",
               .better = Better::kLower,
               .must = at_most(15.0),
               .aim = at_most(5.0),
               .reached = largest_more,
               .unit = "ms",
               .n = effort.cost_frames - static_cast<int>(kSettling),
               .baseline = "the same scene without it",
               .why = "the largest difference of the three scenes"});
  report->add(std::move(table));
  return core::ok_status();
}

core::Status add_memory_targets(const FilterEffort& effort, core::ThreadPool& threads, Report* report) {
  double at_half = 0.0, at_end = 0.0;
  const auto half = static_cast<std::size_t>(effort.memory_frames / 2);
  PRESCENE_RETURN_IF_ERROR(track(table_scene(kMemoryObjects, false, kModels, effort.memory_frames / kRate), effort.seed,
                                 threads, [&](std::size_t frame) {
                                   if (frame + 1 == half) at_half = resident_megabytes();
                                   at_end = resident_megabytes();
                                 }));
  const std::string frames = std::to_string(effort.memory_frames) + " frames, not an hour of them (108000)";
  report->add({.work = "memory, 20 models",
               .better = Better::kLower,
               .must = at_most(400.0),
               .aim = at_most(250.0),
               .reached = at_end,
               .unit = "MB",
               .n = effort.memory_frames,
               .baseline = "none",
               .why = "resident after " + frames + "; what simulated the recording is in it"});
  report->add({.work = "memory, growth in the second half",
               .better = Better::kLower,
               .must = at_most(5.0),
               .aim = at_most(1.0),
               .reached = at_end - at_half,
               .unit = "MB",
               .n = effort.memory_frames / 2,
               .baseline = "memory after the first half",
               .why = "over " + frames});
  return core::ok_status();
}

}  // namespace prescene::benchmarks
