// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/tracking_suite.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "kinds.h"
#include "prescene/core/clock.h"
#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/backends.h"
#include "prescene/service/evaluate/carried_cube.h"
#include "prescene/service/evaluate/suite_scenes.h"
#include "prescene/service/evaluate/tracking_counter.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "prescene/service/recording/simulated_recording.h"
#include "scratch_folder.h"
#include "suite_camera.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;
using core::fixed_text;
using nlohmann::ordered_json;

struct Sequence {
  std::string kind;
  std::uint64_t seed = 0;
};

constexpr std::size_t kMostSceneBytes = std::size_t{1} << 20;

/// The files of a sequence.
struct SequenceFiles {
  fs::path recording;
  fs::path known;  ///< What the tracker is told.
  fs::path world;  ///< What is recorded. Written last: it says that the recording is whole, and of what it is.
};

/// The scene that is recorded, and how it is: a recording at another rate has another text.
std::string world_text(const SuiteScene& scene, double rate) {
  return "# recorded with --rate " + core::rounded_text(rate) + "\n" + scene.world;
}

/// Whether an earlier evaluation left this very sequence whole.
bool is_recorded(const SequenceFiles& files, const std::string& world, const RecordingInfo& info) {
  const auto kept = interfaces::read_file(files.world, kMostSceneBytes);
  if (!kept || !std::equal(kept->begin(), kept->end(), world.begin(), world.end())) return false;
  const auto reader = RecordingReader::open(files.recording);
  return reader.ok() && (*reader)->info().scene_text == info.scene_text && (*reader)->info().seed == info.seed;
}

/// Records aside, so that nobody takes a part of it for the whole: not after a stop, and not at the same time.
core::Status record_sequence(const SuiteScene& scene, const belief::Scene& world, double rate,
                             const RecordingInfo& info, const fs::path& path, Backends& backends,
                             const core::Cancellation& cancellation) {
  SimulatedRecordingOptions simulated;
  simulated.rate = rate;
  simulated.changes = scene.changes;
  simulated.reports_robot = scene.reports_robot;
  set_suite_camera(simulated);
  PRESCENE_TRY(const fs::path aside, interfaces::create_beside(path));
  const auto record = [&]() -> core::Status {
    PRESCENE_TRY(const auto recording, RecordingWriter::create(aside, info));
    PRESCENE_RETURN_IF_ERROR(simulate_recording(world, simulated, info.seed, backends, cancellation, {}, *recording));
    return recording->close();
  };
  core::Status status = record();
  std::error_code error;
  if (status.ok()) fs::rename(aside, path, error);
  if (error) status = core::unavailable(path.string() + ": cannot be replaced: " + error.message());
  if (!status.ok()) fs::remove(aside, error);
  return status.code() == core::StatusCode::kCancelled ? core::cancelled("stopped on request") : status;
}

core::Result<TrackingFigures> run_sequence(const Sequence& sequence, const TrackingOptions& options,
                                           const fs::path& folder, core::ThreadPool& threads,
                                           const core::Cancellation& cancellation) {
  const SuiteScene scene = make_suite_scene(sequence.kind, sequence.seed);
  const std::string name = sequence.kind + "_" + std::to_string(sequence.seed);
  const SequenceFiles files{folder / (name + ".mcap"), folder / (name + ".yaml"), folder / (name + "_world.yaml")};
  const bool keeps = !options.keep.empty();
  if (keeps) PRESCENE_RETURN_IF_ERROR(interfaces::write_file(files.known, scene.known));
  PRESCENE_TRY(const auto world, load_scene_text(scene.world, files.world, {}));
  PRESCENE_TRY(const auto known, load_scene_text(scene.known, files.known, {}));
  BackendSettings backend_settings;
  backend_settings.likelihood = options.likelihood;
  Backends backends(threads, backend_settings);
  const RecordingInfo info{name + ".yaml", scene.known, sequence.seed, ""};
  const std::string recorded_world = world_text(scene, options.rate);
  std::error_code ignored;
  if (!keeps || !is_recorded(files, recorded_world, info)) {
    fs::remove(files.world, ignored);
    PRESCENE_RETURN_IF_ERROR(
        record_sequence(scene, *world, options.rate, info, files.recording, backends, cancellation));
    if (keeps) PRESCENE_RETURN_IF_ERROR(interfaces::write_file(files.world, recorded_world));
  }
  PRESCENE_TRY(const auto tracker, Tracker::create(known, {}, sequence.seed, backends));
  TrackingCounter counter(known);
  const StepSink on_step = [&](const TrackerStep&, const Tracker& at) {
    counter.add(summary_of(*at.belief()));
    return core::ok_status();
  };
  const JsonSink on_json = [&](const std::string& topic, const std::string& json, core::TimeNs) -> core::Status {
    if (topic != kTruthTopic) return core::ok_status();
    PRESCENE_TRY(const TruthRecord truth, truth_from_json(json));
    counter.add(truth);
    return core::ok_status();
  };
  const double begin = core::process_cpu_seconds();
  PRESCENE_TRY(const ReplaySummary summary,
               replay_recording(files.recording, {}, *tracker, cancellation, {}, on_step, on_json));
  if (summary.cancelled) return core::cancelled("stopped on request");
  TrackingFigures figures = counter.figures();
  figures.cpu_seconds = core::process_cpu_seconds() - begin;
  if (!keeps) fs::remove(files.recording, ignored);
  return figures;
}

double share(int part, int whole) {
  return whole > 0 ? static_cast<double>(part) / whole : std::numeric_limits<double>::quiet_NaN();
}

ordered_json or_null(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

ordered_json figures_json(const TrackingFigures& f) {
  ordered_json calibration = ordered_json::array();
  for (std::size_t i = 0; i < f.by_confidence.size(); ++i)
    calibration.push_back({{"confidence", 0.05 + 0.1 * static_cast<double>(i)},
                           {"n", f.by_confidence[i]},
                           {"right", or_null(share(f.right_by_confidence[i], f.by_confidence[i]))}});
  return {{"sequences", f.sequences},
          {"frames", f.frames},
          {"visible", f.visible},
          {"share_tracked", or_null(share(f.tracked, f.visible))},
          {"believed", f.believed},
          {"share_wrong", or_null(share(f.wrong, f.believed))},
          {"wrong", f.wrong},
          {"surely_wrong", f.surely_wrong},
          {"median_position_error_m", or_null(core::quantile(f.position_errors, 0.5))},
          {"p90_position_error_m", or_null(core::quantile(f.position_errors, 0.9))},
          {"median_turn_error_rad", or_null(core::quantile(f.turn_errors, 0.5))},
          {"p90_turn_error_rad", or_null(core::quantile(f.turn_errors, 0.9))},
          {"hidden", f.hidden},
          {"hidden_90_percent_region_holds", or_null(share(f.hidden_covered, f.hidden))},
          {"confidence_above_099", f.sure},
          {"confidence_above_099_right", or_null(share(f.sure_right, f.sure))},
          {"still", f.still_shifts.size()},
          {"still_shift_p90_m", or_null(core::quantile(f.still_shifts, 0.9))},
          {"still_turn_p90_rad", or_null(core::quantile(f.still_turns, 0.9))},
          {"cpu_ms_per_frame",
           or_null(f.frames > 0 ? 1e3 * f.cpu_seconds / f.frames : std::numeric_limits<double>::quiet_NaN())},
          {"calibration", calibration}};
}

std::string percent(double value) { return std::isfinite(value) ? fixed_text(100.0 * value, 1) : "-"; }
std::string scaled(double value, double factor, int decimals) {
  return std::isfinite(value) ? fixed_text(factor * value, decimals) : "-";
}

std::vector<std::string> row_of(const std::string& kind, const TrackingFigures& f) {
  constexpr double kDegrees = 57.29577951308232;
  return {kind,
          std::to_string(f.frames),
          std::to_string(f.visible),
          percent(share(f.tracked, f.visible)),
          std::to_string(f.wrong) + " (" + std::to_string(f.surely_wrong) + ") of " + std::to_string(f.believed),
          scaled(core::quantile(f.position_errors, 0.5), 1e3, 1),
          scaled(core::quantile(f.turn_errors, 0.5), kDegrees, 1),
          percent(share(f.hidden_covered, f.hidden)) + " of " + std::to_string(f.hidden),
          percent(share(f.sure_right, f.sure)) + " of " + std::to_string(f.sure),
          scaled(core::quantile(f.still_shifts, 0.9), 1e3, 2),
          scaled(core::quantile(f.still_turns, 0.9), kDegrees, 2),
          f.frames > 0 ? fixed_text(1e3 * f.cpu_seconds / f.frames, 0) : "-"};
}

}  // namespace

void TrackingFigures::add(const TrackingFigures& more) {
  sequences += more.sequences;
  frames += more.frames;
  visible += more.visible;
  tracked += more.tracked;
  believed += more.believed;
  wrong += more.wrong;
  surely_wrong += more.surely_wrong;
  hidden += more.hidden;
  hidden_covered += more.hidden_covered;
  sure += more.sure;
  sure_right += more.sure_right;
  for (std::size_t i = 0; i < by_confidence.size(); ++i) {
    by_confidence[i] += more.by_confidence[i];
    right_by_confidence[i] += more.right_by_confidence[i];
  }
  cpu_seconds += more.cpu_seconds;
  const auto append = [](const std::vector<double>& from, std::vector<double>& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(more.position_errors, position_errors);
  append(more.turn_errors, turn_errors);
  append(more.still_shifts, still_shifts);
  append(more.still_turns, still_turns);
}

core::Result<TrackingReport> evaluate_tracking(const fs::path& data, const TrackingOptions& options, std::uint64_t seed,
                                               core::ThreadPool& threads, const core::ProgressSink& progress,
                                               const core::Cancellation* cancellation) {
  const core::Cancellation never;
  const core::Cancellation& stop = cancellation != nullptr ? *cancellation : never;
  const auto wanted = [&](const std::string& kind) {
    return options.kinds.empty() || std::find(options.kinds.begin(), options.kinds.end(), kind) != options.kinds.end();
  };
  std::vector<std::string> known = suite_kinds();
  known.emplace_back(kCarriedCube);
  PRESCENE_RETURN_IF_ERROR(check_kinds(options.kinds, known, "sequence"));
  const bool cube = wanted(kCarriedCube) && !(data.empty() && options.kinds.empty());
  if (cube && data.empty())
    return core::invalid_input(std::string(kCarriedCube) + " is recorded: name the folder that holds it with --data");
  // The simulated sequences come first and take long, so data that are not there are an error before them.
  if (cube) PRESCENE_RETURN_IF_ERROR(check_carried_cube(data / kCarriedCube));
  PRESCENE_TRY(const auto scratch, ScratchFolder::create());
  fs::path folder = scratch->path();
  if (!options.keep.empty()) {
    std::error_code error;
    fs::create_directories(options.keep, error);
    if (error) return core::unavailable(options.keep.string() + ": cannot be made: " + error.message());
    folder = options.keep;
  }
  std::vector<Sequence> sequences;
  for (const std::string& kind : suite_kinds())
    if (wanted(kind))
      for (int k = 0; k < options.sequences; ++k) sequences.push_back({kind, seed + static_cast<std::uint64_t>(k)});
  const double parts = static_cast<double>(sequences.size()) + (cube ? options.sequences : 0);

  TrackingReport report{.seed = seed, .rate = options.rate, .rows = {}, .simulated = {}};
  double done = 0.0;
  for (const Sequence& sequence : sequences) {
    const std::string name = sequence.kind + " " + std::to_string(sequence.seed);
    if (progress) progress({done / parts, std::nullopt, name});
    core::Result<TrackingFigures> figures = run_sequence(sequence, options, folder, threads, stop);
    if (!figures) return figures.status().at(name);
    if (report.rows.empty() || report.rows.back().kind != sequence.kind) report.rows.push_back({sequence.kind, {}});
    report.rows.back().figures.add(*figures);
    report.simulated.add(*figures);
    done += 1.0;
  }
  if (cube) {
    TrackingRow row{kCarriedCube, {}};
    for (int k = 0; k < options.sequences; ++k) {
      if (progress) progress({done / parts, std::nullopt, row.kind});
      BackendSettings backend_settings;
      backend_settings.likelihood = options.likelihood;
      Backends backends(threads, backend_settings);
      PRESCENE_TRY(const TrackingFigures figures,
                   track_carried_cube(data / kCarriedCube, seed + static_cast<std::uint64_t>(k), backends, stop));
      row.figures.add(figures);
      done += 1.0;
    }
    report.rows.push_back(std::move(row));
  }
  if (progress) progress({1.0, std::nullopt, "done"});
  return report;
}

ordered_json to_json(const TrackingReport& report) {
  ordered_json kinds = ordered_json::array();
  for (const TrackingRow& row : report.rows) {
    ordered_json json = {{"kind", row.kind}};
    json.update(figures_json(row.figures));
    kinds.push_back(std::move(json));
  }
  return {
      {"seed", report.seed}, {"rate", report.rate}, {"kinds", kinds}, {"simulated", figures_json(report.simulated)}};
}

std::vector<std::vector<std::string>> table_of(const TrackingReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"sequences", "frames", "visible", "tracked, %", "wrong (at 0.9) of tracked", "median, mm", "median, deg",
       "hidden in 90 % region, %", "right at 0.99, %", "still p90, mm", "still p90, deg", "CPU ms/frame"}};
  for (const TrackingRow& row : report.rows) rows.push_back(row_of(row.kind, row.figures));
  if (report.simulated.sequences > 0) rows.push_back(row_of("all simulated", report.simulated));
  return rows;
}

}  // namespace prescene::service
