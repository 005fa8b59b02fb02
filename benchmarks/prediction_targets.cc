// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/prediction_targets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/plain_runs.h"
#include "benchmarks/statistics.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/queries/query_engine.h"
#include "prescene/service/backends.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

constexpr int kTimes = 16;                // that each scene happens
constexpr double kFineStep = 1.0 / 1000;  // s
constexpr double kSure = 0.02;            // forecasts nearer to 0 or 1 than this are sure

double between(core::RandomStream& stream, double low, double high) { return low + (high - low) * stream.uniform(); }

/// A line of YAML.
template <typename... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 400> text;
  const int size = std::snprintf(text.data(), text.size(), format, values...);
  PRESCENE_CHECK(size > 0 && size < static_cast<int>(text.size()));
  return text.data() + std::string("\n");
}

/// A shape of 3 to 20 cm, and its height.
std::string random_shape(core::RandomStream& stream, double* height) {
  const double kind = stream.uniform();
  *height = between(stream, 0.03, 0.2);
  if (kind < 0.5) {
    // One declaration each: the order in which arguments are evaluated is the compiler's choice.
    const double depth = between(stream, 0.03, 0.15), width = between(stream, 0.03, 0.15);
    return line("    box: [%.4f, %.4f, %.4f]", width, depth, *height);
  }
  if (kind < 0.8) return line("    cylinder: {radius: %.4f, length: %.4f}", between(stream, 0.015, 0.06), *height);
  const double foot = between(stream, 0.02, 0.05);
  return line("    lathe: {profile: [[%.4f, %.4f], [%.4f, %.4f]], segments: 24}", foot, -0.5 * *height,
              foot * between(stream, 0.4, 1.6), 0.5 * *height);
}

std::string random_model(const char* name, core::RandomStream& stream, double* height) {
  std::string text = line("  %s:", name) + random_shape(stream, height);
  const double mass = std::exp(between(stream, std::log(0.05), std::log(1.0)));
  text += line("    mass: {normal: [%.4f, %.4f], min: 0.01}", mass, 0.15 * mass);
  const double friction = between(stream, 0.15, 0.7);
  text += line("    friction: {uniform: [%.4f, %.4f]}", 0.6 * friction, 1.4 * friction);
  return text + line("    restitution: {uniform: [0.0, %.4f]}", between(stream, 0.05, 0.5));
}

/// The thing stands, falls or slides near the edge at x = 0.3 of a table.
std::string random_scene_text(core::RandomStream& stream) {
  double height = 0.0, other_height = 0.0;
  const double second = stream.uniform();  // none, beside, below
  std::string text = "name: random\nduration: 4\nmodels:\n" + random_model("thing", stream, &height);
  if (second > 0.5) text += random_model("second", stream, &other_height);
  text += "supports:\n  floor: {ground: {size: 6}, pose: {position: [0, 0, -0.7]}}\n";
  const double restitution = between(stream, 0.3, 1.0), friction = between(stream, 0.5, 1.0);
  const double slope = stream.uniform() < 0.3 ? between(stream, -12.0, 12.0) : 0.0;
  text += line(
      "  table: {box: [0.6, 0.8, 0.04], pose: {position: [0, 0, -0.02], rotation: {euler_deg: [%.3f, 0, 0]}}, "
      "friction: %.3f, restitution: %.3f}",
      slope, friction, restitution);
  const double how = stream.uniform();  // put down, dropped, on its way
  const double x = between(stream, 0.2, 0.32);
  double z = 0.5 * height + 0.002;
  text += "objects:\n";
  if (second > 0.5) {
    const bool below = second > 0.75;
    text += line("  second: {model: second, pose: {position: [%.4f, %.4f, %.4f]}}", below ? 0.2 : x - 0.1,
                 below ? 0.0 : between(stream, -0.1, 0.1), 0.5 * other_height + 0.001);
    if (below) z += other_height + 0.002;
  }
  const double tilt = how < 0.3 ? between(stream, 0.0, 4.0) : between(stream, 0.0, 25.0);
  if (how >= 0.3) z += between(stream, 0.01, 0.15);
  const double turn_sigma_y = between(stream, 0.2, 8.0), turn_sigma_x = between(stream, 0.2, 8.0);
  const double sigma_y = between(stream, 0.001, 0.02), sigma_x = between(stream, 0.001, 0.02);
  const double about_z = between(stream, 0.0, 360.0), about_y = between(stream, -tilt, tilt);
  text += line(
      "  thing: {model: thing, pose: {position: [%.4f, 0, %.4f], rotation: {euler_deg: [%.2f, %.2f, %.2f]}, "
      "normal: {position: [%.4f, %.4f, 0.001], rotation_deg: [%.2f, %.2f, 10]}}",
      x, z, tilt, about_y, about_z, sigma_x, sigma_y, turn_sigma_x, turn_sigma_y);
  text.pop_back();
  if (how >= 0.65)
    text += line(", velocity: [{normal: [%.3f, 0.1]}, {normal: [0, 0.1]}, 0]", between(stream, 0.1, 0.8));
  if (text.back() == '\n') text.pop_back();
  return text + R"(}
exclusive_outcomes:
  ends:
    object: thing
    outcomes:
      falls: {below: -0.1}
      stands: {upright: {within_deg: 20}}
outcomes:
  moves: {object: thing, moved_more_than: 0.05}
)";
}

struct Forecast {
  double probability = 0.0;
  double happened = 0.0;  ///< Share of kTimes.
};

/// Forecasts of all classes, and what happened.
std::vector<Forecast> forecasts_of(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                   core::ThreadPool& pool) {
  service::Backends backends(pool);
  const belief::Answer answer =
      queries::answer(scene, seed, {"", belief::PredictQuery{}}, backends.query_context(pool));
  PRESCENE_CHECK_MSG(answer.error.ok(), answer.error.message());
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);

  const std::vector<belief::Trajectory> runs = plain_runs(*scene, kTimes, kFineStep, seed, pool);

  std::vector<Forecast> forecasts;
  for (const simulation::Variable& variable :
       simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes)) {
    for (std::size_t c = 0; c < variable.classes.size(); ++c) {
      for (const belief::OutcomeProbability& outcome : predicted.outcomes) {
        const bool same =
            outcome.name == variable.classes[c] && (outcome.group.empty() || outcome.group == variable.name);
        if (!same) continue;
        Forecast& forecast = forecasts.emplace_back();
        forecast.probability = outcome.probability;
        for (const belief::Trajectory& run : runs)
          forecast.happened += variable.classify(run) == static_cast<int>(c) ? 1.0 / kTimes : 0.0;
      }
    }
  }
  return forecasts;
}

/// Mean over tenths of probability, weighed by their counts, of |mean forecast - share that happened|.
double expected_calibration_error(const std::vector<Forecast>& forecasts, bool without_sure, Table* table) {
  struct Tenth {
    double n = 0.0, forecast = 0.0, happened = 0.0;
  };
  std::array<Tenth, 10> tenths;
  double n = 0.0, error = 0.0;
  for (const Forecast& one : forecasts) {
    if (without_sure && std::min(one.probability, 1.0 - one.probability) < kSure) continue;
    Tenth& tenth = tenths[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * one.probability))];
    tenth.n += 1.0;
    tenth.forecast += one.probability;
    tenth.happened += one.happened;
    n += 1.0;
  }
  for (std::size_t i = 0; i < tenths.size(); ++i) {
    const Tenth& tenth = tenths[i];
    if (tenth.n == 0.0) continue;
    error += std::abs(tenth.forecast - tenth.happened) / n;
    if (table)
      table->rows.push_back({0.1 * static_cast<double>(i), static_cast<std::int64_t>(tenth.n), tenth.forecast / tenth.n,
                             tenth.happened / tenth.n});
  }
  return error;
}

}  // namespace

Table measure_prediction_calibration(int scenes, Report* report) {
  Table table{"prediction_calibration", {"from", "forecasts", "mean forecast", "happened"}, {}};
  core::ThreadPool pool(2);
  core::RandomStream stream(40'000, core::Purpose::kTest);
  std::vector<Forecast> forecasts;
  for (int i = 0; i < scenes; ++i) {
    if (i % 50 == 0) std::fprintf(stderr, "predictions, %d of %d scenes\n", i, scenes);
    const std::string text = random_scene_text(stream);
    auto read = interfaces::parse_scene(text, "random.yaml");
    PRESCENE_CHECK_MSG(read.ok(), read.status().message() + "\n" + text);
    const auto scene = std::make_shared<const belief::Scene>(*std::move(read));
    const std::vector<Forecast> found = forecasts_of(scene, static_cast<std::uint64_t>(i + 1), pool);
    PRESCENE_CHECK(!found.empty());
    forecasts.insert(forecasts.end(), found.begin(), found.end());
  }
  const double all = expected_calibration_error(forecasts, false, nullptr);
  const double unsure = expected_calibration_error(forecasts, true, &table);
  char why[160];
  std::snprintf(why, sizeof why, "%.4f of all forecasts; of each scene %d runs by Bullet's stepper at 1/1000 s", all,
                kTimes);
  report->add({.work = "predictions that are not sure (2 to 98 %): expected calibration error",
               .better = Better::kLower,
               .must = at_most(0.03),
               .aim = at_most(0.015),
               .reached = unsure,
               .unit = "",
               .n = scenes,
               .baseline = "none",
               .why = why});
  return table;
}

Table measure_stability_time(int seeds, Report* report) {
  Table table{"stability", {"object", "median s", "instances", "simulated s", "P", "half width", "stepper"}, {}};
  auto read = interfaces::read_scene(tests::source_dir() / "scenarios" / "five_objects_pushed.yaml");
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
  const auto scene = std::make_shared<const belief::Scene>(*std::move(read));
  core::ThreadPool pool(2);
  service::Backends backends(pool);
  std::vector<double> all;
  for (const belief::SceneObject& object : scene->objects) {
    belief::StabilityQuery query;
    query.object = object.name;
    query.effort.tolerance = 0.025;
    std::vector<double> times;
    belief::StabilityAnswer last;
    for (int seed = 1; seed <= seeds; ++seed) {
      const auto begin = core::Cancellation::Clock::now();
      const belief::Answer answer =
          queries::answer(scene, static_cast<std::uint64_t>(seed), {"", query}, backends.query_context(pool));
      PRESCENE_CHECK_MSG(answer.error.ok(), answer.error.message());
      times.push_back(std::chrono::duration<double>(core::Cancellation::Clock::now() - begin).count());
      last = std::get<belief::StabilityAnswer>(answer.what);
    }
    table.rows.push_back({object.name, median(times), static_cast<std::int64_t>(last.instances), last.simulated_seconds,
                          last.stable.probability, 0.5 * (last.stable.high - last.stable.low), last.stepper});
    all.insert(all.end(), times.begin(), times.end());
  }
  report->add({.work = "stability of one object among five to +-0.025, median",
               .better = Better::kLower,
               .must = at_most(0.15),
               .aim = at_most(0.05),
               .reached = median(all),
               .unit = "s",
               .n = static_cast<std::int64_t>(all.size()),
               .baseline = "none",
               .why = "wall time, two threads; making the simulator is counted"});
  return table;
}

}  // namespace prescene::benchmarks
