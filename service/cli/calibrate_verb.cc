// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/core/text.h"
#include "prescene/service/evaluate/cube_calibration.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct Options {
  std::string name;
  std::string data;
  std::string start = "measured";
  CalibrationOptions search;
};

/// How a model does on the tosses that it is fitted to, with as many samples as forecasts have.
struct Judgement {
  double cost = 0.0;
  CubeReport report;
};

core::Result<Judgement> judge(const std::vector<CubeToss>& tosses, const CubeModel& model, VerbContext& context) {
  PRESCENE_TRY(std::vector<CubeForecast> forecasts,
               forecast_cube_tosses(tosses, model, context.options().seed, context.pool()));
  const double cost = calibration_cost(forecasts);
  return Judgement{cost, report_of(std::move(forecasts))};
}

nlohmann::ordered_json to_json(const Judgement& judgement) {
  nlohmann::ordered_json json = to_json(judgement.report);
  json["cost"] = judgement.cost;
  return json;
}

std::string text_of(const nlohmann::ordered_json& start, const nlohmann::ordered_json& found) {
  std::vector<std::vector<std::string>> rows = {{"", "start", "found"}};
  for (const auto& [key, value] : start.items()) {
    if (value.is_number()) {
      rows.push_back({key, fixed_text(value.get<double>(), 5), fixed_text(found[key].get<double>(), 5)});
    }
  }
  return table(rows);
}

core::Status run(const Options& options, VerbContext& context) {
  const std::map<std::string, CubeModel> starts = {
      {"measured", measured_cube_model()}, {"described", described_cube_model()}, {"shipped", shipped_cube_model()}};
  const CubeModel& start = starts.at(options.start);
  const std::filesystem::path folder = std::filesystem::path(options.data) / options.name;
  PRESCENE_TRY(const std::vector<CubeToss> all, read_cube_tosses(folder));
  const std::vector<CubeToss> tosses = select(all, CubeSplit::kCalibrate);
  PRESCENE_TRY(CubeCalibration found, calibrate_cube(tosses, start, context.options().seed, context.pool(),
                                                     context.progress("calibrating " + options.name),
                                                     &context.cancellation(), options.search));
  found.model.provenance = "found by prescene calibrate " + options.name + " --from " + options.start;
  bool better = found.cost < found.start_cost;

  nlohmann::ordered_json document;
  document["n"] = tosses.size();
  document["evaluations"] = found.evaluations;
  document["stopped"] = found.stopped;
  document["search_cost"] = {{"start", found.start_cost}, {"found", found.cost}};
  document["start"]["model"] = to_json(start);
  document["found"]["model"] = to_json(found.model);
  std::string text = text_of(to_json(start), to_json(found.model)) + "\n";
  // The search is on few samples; whoever stops it does not want to wait for many.
  if (!found.stopped) {
    PRESCENE_TRY(const Judgement at_start, judge(tosses, start, context));
    PRESCENE_TRY(const Judgement at_end, judge(tosses, found.model, context));
    document["start"]["scores"] = to_json(at_start);
    document["found"]["scores"] = to_json(at_end);
    text += text_of(document["start"]["scores"], document["found"]["scores"]) + "\n";
    better = at_end.cost < at_start.cost;
  }
  document["better"] = better ? "found" : "start";
  text += std::to_string(found.evaluations) + " evaluations" + (found.stopped ? ", then stopped" : "") +
          (better ? "; what was found is better than the start on the tosses it was fitted to\n"
                  : "; nothing better than the start was found\n");
  context.print(document, text);
  return core::ok_status();
}

}  // namespace

Verb add_calibrate_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "calibrate", "Fits a model to recorded motion (docs/accuracy.md); Ctrl-C ends the search with the best so far");
  auto options = std::make_shared<Options>();
  verb->add_option("NAME", options->name, "cube_tosses")->required()->check(CLI::IsMember({"cube_tosses"}));
  verb->add_option("--data", options->data, "Folder that holds the data sets' folders")->required();
  verb->add_option("--from", options->start,
                   "Where the search starts: measured (read off the recordings), described (by the data set), shipped")
      ->check(CLI::IsMember({"measured", "described", "shipped"}))
      ->capture_default_str();
  verb->add_option("--samples", options->search.samples, "Simulated starts a toss in the search")
      ->check(CLI::Range(2, 4096))
      ->capture_default_str();
  verb->add_option("--max-evaluations", options->search.max_evaluations, "Models tried at most")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  verb->footer("Example: prescene calibrate cube_tosses --data data --json");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
