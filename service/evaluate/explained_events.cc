// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/explained_events.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "kinds.h"
#include "prescene/core/clock.h"
#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/explained.h"
#include "prescene/service/recording/simulated_recording.h"
#include "scratch_folder.h"
#include "suite_camera.h"

namespace prescene::service {
namespace {

using belief::EventKind;
using core::fixed_text;
using nlohmann::ordered_json;

constexpr double kTruthStep = 0.001;  // s, of Bullet's stepper
constexpr double kProbable = 1e-4;    // from which on an explanation is listed
constexpr double kBegun = 5e-4;       // m: the object has moved

/// Where the object is at the end, and when it began to move.
struct EpisodeTruth {
  std::optional<geometry::Pose> end;
  double begun = -1.0;
};

EpisodeTruth truth_of(const EventEpisode& episode, const std::vector<PlayedPart>& parts) {
  EpisodeTruth truth;
  std::optional<geometry::Pose> start;
  for (const PlayedPart& part : parts) {
    const auto index = belief::find_object(part.scene, episode.object);
    for (const belief::WorldState& state : part.trajectory.states) {
      if (state.time > episode.to) return truth;
      truth.end.reset();
      if (!index) continue;
      truth.end = state.objects[static_cast<std::size_t>(*index)].X_WO;
      // Things settle in the beginning.
      if (state.time < 0.5 * episode.from || !start) start = truth.end;
      if (truth.begun < 0.0 && (truth.end->translation - start->translation).norm() > kBegun) truth.begun = state.time;
    }
  }
  return truth;
}

std::string label_of(const queries::Explanation& e) {
  return std::string(belief::name_of(e.kind)) + (e.object.empty() ? "" : " " + e.object);
}

core::Status explain_into(const EventEpisode& episode, std::uint64_t seed, const ExplainedEventsOptions& options,
                          const std::string& folder, const core::Cancellation& cancellation, EpisodeResult& result) {
  const std::filesystem::path path =
      std::filesystem::path(folder) / (episode.kind + "_" + std::to_string(seed) + ".mcap");
  core::ThreadPool pool(1);
  PRESCENE_TRY(const auto world, load_scene_text(episode.world, "world.yaml", {}));
  PRESCENE_TRY(const auto known, load_scene_text(episode.known, "known.yaml", {}));
  EpisodeTruth truth;
  {
    BackendSettings settings;
    settings.stepper = Stepper::kBullet;
    settings.bullet.step = kTruthStep;
    Backends backends(pool, settings);
    SimulatedRecordingOptions simulated;
    simulated.rate = options.rate;
    simulated.changes = episode.changes;
    simulated.reports_robot = episode.reports_robot;
    set_suite_camera(simulated);
    PRESCENE_TRY(const auto recording, RecordingWriter::create(path, {"known.yaml", episode.known, seed, ""}));
    PRESCENE_RETURN_IF_ERROR(simulate_recording(*world, simulated, seed, backends, cancellation, {}, *recording));
    PRESCENE_RETURN_IF_ERROR(recording->close());
    // Once more, at a fine interval: it is rounded to the frames of the recording where changes are.
    PRESCENE_TRY(const auto parts, play_scene(*world, episode.changes, backends.simulator_factory(),
                                              1.0 / (8.0 * options.rate), seed, pool));
    truth = truth_of(episode, parts);
  }
  const double begin = core::process_cpu_seconds();
  Backends backends(pool);
  ReplayInputOptions opened;
  opened.path = path;
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open(opened, {}));
  ExplainOptions explain;
  explain.path = path;
  explain.from = episode.from;
  explain.to = episode.to;
  explain.query = options.query;
  explain.query.seed = seed;
  explain.max_seconds = options.max_seconds;
  const auto explained = explain_recording(input, explain, {}, seed, backends, cancellation, {});
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  if (!explained) return explained.status();
  result.seconds = core::process_cpu_seconds() - begin;

  const auto is_true = [&](const queries::Explanation& e) {
    return e.kind == episode.truth &&
           (e.object == episode.object || e.partner == episode.object || episode.truth == EventKind::kNothing);
  };
  const queries::Explanation& first = explained->answer.explanations.front();
  result.first = label_of(first);
  result.probability = first.probability;
  result.low = first.low;
  result.high = first.high;
  result.explaining = explained->cpu_seconds;
  result.cut_short = explained->answer.cut_short;
  result.right = is_true(first);
  const auto is_touch = [](EventKind kind) { return kind == EventKind::kPushed || kind == EventKind::kBumped; };
  const bool touched = is_touch(first.kind) && is_touch(episode.truth) && first.object == episode.object;
  result.nearly_right = result.right || touched;
  for (const queries::Explanation& e : explained->answer.explanations) {
    if (is_true(e)) result.of_truth += e.probability;
    if (e.probability >= kProbable || is_true(e))
      result.ranking.push_back({label_of(e), e.probability, e.log_bayes_factor});
  }
  if (result.nearly_right && first.time) {
    const bool by_push = episode.truth == EventKind::kPushed;
    // Changes are taken to the nearest frame.
    const double time =
        by_push && truth.begun >= 0.0 ? truth.begun : std::round(episode.time * options.rate) / options.rate;
    result.time_error = std::abs(first.time->mean + explained->from - time);
  }
  if (result.nearly_right && first.towards)
    result.direction_error = std::abs(
        std::remainder(first.towards->mean * std::numbers::pi / 180.0 - episode.direction, 2.0 * std::numbers::pi));
  for (const queries::WhereItIs& object : explained->answer.objects) {
    if (object.object != episode.object || !truth.end || object.present < 0.5) continue;
    result.place_error = (object.mean - truth.end->translation).norm();
    result.place_radius = object.radius_90;
    result.place_within = result.place_error <= object.radius_90;
    result.hidden = object.out_of_sight;
  }
  return core::ok_status();
}

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : std::numeric_limits<double>::quiet_NaN();
}

struct KindFigures {
  std::size_t n = 0, right = 0, nearly = 0, failed = 0, placed = 0, within = 0, hidden = 0, hidden_within = 0;
  std::vector<double> time_errors, direction_errors, half_widths, seconds, explaining;

  void add(const EpisodeResult& e) {
    ++n;
    failed += e.failure.empty() ? 0 : 1;
    right += e.right ? 1 : 0;
    nearly += e.nearly_right ? 1 : 0;
    if (e.time_error >= 0.0) time_errors.push_back(e.time_error);
    if (e.direction_error >= 0.0) direction_errors.push_back(e.direction_error);
    if (e.place_error >= 0.0) {
      ++placed;
      within += e.place_within ? 1 : 0;
      hidden += e.hidden ? 1 : 0;
      hidden_within += e.hidden && e.place_within ? 1 : 0;
    }
    if (e.failure.empty()) half_widths.push_back(0.5 * (e.high - e.low));
    seconds.push_back(e.seconds);
    explaining.push_back(e.explaining);
  }
};

std::string percent_of(std::size_t part, std::size_t whole) {
  return whole > 0 ? fixed_text(100.0 * share(part, whole), 1) : "-";
}
std::string number_of(double value, int decimals) { return std::isfinite(value) ? fixed_text(value, decimals) : "-"; }

std::vector<std::string> figures_row(const std::string& kind, const KindFigures& f) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  return {kind,
          std::to_string(f.n),
          percent_of(f.right, f.n),
          percent_of(f.nearly, f.n),
          std::to_string(f.failed),
          number_of(core::quantile(f.time_errors, 0.5), 3),
          number_of(core::quantile(f.time_errors, 0.9), 3),
          number_of(kDegrees * core::quantile(f.direction_errors, 0.5), 1),
          number_of(kDegrees * core::quantile(f.direction_errors, 0.9), 1),
          percent_of(f.within, f.placed) + " of " + std::to_string(f.placed),
          number_of(100.0 * core::quantile(f.half_widths, 0.5), 1),
          number_of(100.0 * core::quantile(f.half_widths, 0.9), 1),
          number_of(core::quantile(f.explaining, 0.5), 1),
          number_of(core::quantile(f.explaining, 0.9), 1)};
}

ordered_json null_or(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(); }

ordered_json kind_json(const std::string& kind, const KindFigures& f) {
  return {{"kind", kind},
          {"n", f.n},
          {"right", f.right},
          {"right_push_and_blow_as_one", f.nearly},
          {"failed", f.failed},
          {"median_time_error", null_or(core::quantile(f.time_errors, 0.5))},
          {"p90_time_error", null_or(core::quantile(f.time_errors, 0.9))},
          {"timed", f.time_errors.size()},
          {"median_direction_error_rad", null_or(core::quantile(f.direction_errors, 0.5))},
          {"p90_direction_error_rad", null_or(core::quantile(f.direction_errors, 0.9))},
          {"directed", f.direction_errors.size()},
          {"placed", f.placed},
          {"within_90", f.within},
          {"hidden", f.hidden},
          {"hidden_within_90", f.hidden_within},
          {"median_half_width", null_or(core::quantile(f.half_widths, 0.5))},
          {"p90_half_width", null_or(core::quantile(f.half_widths, 0.9))},
          {"median_cpu_seconds", null_or(core::quantile(f.explaining, 0.5))},
          {"p90_cpu_seconds", null_or(core::quantile(f.explaining, 0.9))},
          {"median_cpu_seconds_with_tracking", null_or(core::quantile(f.seconds, 0.5))}};
}

/// By kind, in the order of event_episode_kinds(), then all.
std::vector<std::pair<std::string, KindFigures>> figures_of(const ExplainedEventsReport& report) {
  std::vector<std::pair<std::string, KindFigures>> rows;
  KindFigures all;
  for (const std::string& kind : event_episode_kinds()) {
    KindFigures figures;
    for (const EpisodeResult& e : report.episodes)
      if (e.kind == kind) figures.add(e);
    if (figures.n > 0) rows.emplace_back(kind, figures);
  }
  for (const EpisodeResult& e : report.episodes) all.add(e);
  rows.emplace_back("all", all);
  return rows;
}

}  // namespace

EpisodeResult explain_episode(const EventEpisode& episode, std::uint64_t seed, const ExplainedEventsOptions& options,
                              const std::string& folder, const core::Cancellation& cancellation) {
  EpisodeResult result;
  result.kind = episode.kind;
  result.seed = seed;
  result.truth = episode.truth;
  if (const core::Status status = explain_into(episode, seed, options, folder, cancellation, result); !status.ok())
    result.failure = core::to_string(status);
  return result;
}

core::Result<ExplainedEventsReport> evaluate_explained_events(const ExplainedEventsOptions& options, std::uint64_t seed,
                                                              core::ThreadPool& threads,
                                                              const core::ProgressSink& progress,
                                                              const core::Cancellation* cancellation) {
  const std::vector<std::string>& known = event_episode_kinds();
  PRESCENE_RETURN_IF_ERROR(check_kinds(options.kinds, known, "episode"));
  const std::vector<std::string>& kinds = options.kinds.empty() ? known : options.kinds;
  PRESCENE_TRY(const auto scratch, ScratchFolder::create());
  const core::Cancellation never;
  const core::Cancellation& stop = cancellation != nullptr ? *cancellation : never;
  ExplainedEventsReport report;
  const auto count = static_cast<std::size_t>(options.episodes);
  report.episodes.resize(count);
  // In parts, so that progress is reported from here.
  const auto part = static_cast<std::size_t>(std::max(1, threads.threads()));
  for (std::size_t begin = 0; begin < count; begin += part) {
    if (stop.requested()) return core::cancelled("stopped on request");
    if (progress) progress({static_cast<double>(begin) / static_cast<double>(count), std::nullopt, "episodes"});
    threads.for_each_index(std::min(part, count - begin), [&](std::size_t i) {
      const std::size_t number = begin + i;
      const std::uint64_t own = seed + number / kinds.size();
      report.episodes[number] = explain_episode(make_event_episode(kinds[number % kinds.size()], own), own, options,
                                                scratch->path().string(), stop);
    });
  }
  if (progress) progress({1.0, std::nullopt, "done"});
  return report;
}

double expected_calibration_error(const ExplainedEventsReport& report) {
  struct Bin {
    double n = 0.0, stated = 0.0, right = 0.0;
  };
  std::array<Bin, 10> bins;
  double all = 0.0;
  for (const EpisodeResult& e : report.episodes) {
    if (!e.failure.empty()) continue;
    Bin& bin = bins[static_cast<std::size_t>(std::clamp(10.0 * e.probability, 0.0, 9.0))];
    bin.n += 1.0;
    bin.stated += e.probability;
    bin.right += e.right ? 1.0 : 0.0;
    all += 1.0;
  }
  double error = 0.0;
  for (const Bin& bin : bins) error += std::abs(bin.stated - bin.right);
  return all > 0.0 ? error / all : std::numeric_limits<double>::quiet_NaN();
}

ordered_json to_json(const ExplainedEventsReport& report) {
  ordered_json kinds = ordered_json::array(), episodes = ordered_json::array();
  for (const auto& [kind, figures] : figures_of(report)) kinds.push_back(kind_json(kind, figures));
  for (const EpisodeResult& e : report.episodes) {
    ordered_json json = {{"kind", e.kind}, {"seed", e.seed}};
    if (!e.failure.empty()) {
      json["failure"] = e.failure;
    } else {
      ordered_json ranking = ordered_json::array();
      for (const RankedEvent& one : e.ranking)
        ranking.push_back(
            {{"event", one.event}, {"probability", one.probability}, {"log_bayes_factor", one.log_bayes_factor}});
      json.update({{"first", e.first},
                   {"probability", e.probability},
                   {"interval", {e.low, e.high}},
                   {"probability_of_truth", e.of_truth},
                   {"right", e.right},
                   {"right_push_and_blow_as_one", e.nearly_right},
                   {"time_error", e.time_error >= 0.0 ? ordered_json(e.time_error) : ordered_json()},
                   {"direction_error_rad", e.direction_error >= 0.0 ? ordered_json(e.direction_error) : ordered_json()},
                   {"place_error_m", e.place_error >= 0.0 ? ordered_json(e.place_error) : ordered_json()},
                   {"place_radius_90_m", e.place_error >= 0.0 ? ordered_json(e.place_radius) : ordered_json()},
                   {"place_within_90", e.place_within},
                   {"hidden", e.hidden},
                   {"ranking", std::move(ranking)},
                   {"cpu_seconds", e.explaining},
                   {"cpu_seconds_with_tracking", e.seconds}});
    }
    episodes.push_back(std::move(json));
  }
  return {{"kinds", kinds},
          {"expected_calibration_error", null_or(expected_calibration_error(report))},
          {"episodes", episodes}};
}

std::vector<std::vector<std::string>> table_of(const ExplainedEventsReport& report) {
  std::vector<std::vector<std::string>> rows = {{"episodes", "n", "right first, %", "push = blow, %", "failed",
                                                 "time error median, s", "p90, s", "direction median, deg", "p90, deg",
                                                 "place in 90 % radius, %", "half width median, %", "p90, %",
                                                 "CPU s median", "p90, s"}};
  for (const auto& [kind, figures] : figures_of(report)) rows.push_back(figures_row(kind, figures));
  return rows;
}

}  // namespace prescene::service
