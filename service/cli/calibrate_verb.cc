// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "output_files.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/calibration/object_calibration.h"
#include "prescene/service/evaluate/cube_calibration.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct CalibrateOptions {
  std::string name;
  std::string data;
  std::string output;
  std::string learned;
  std::vector<std::string> keep;
  std::optional<std::string> start;
  std::optional<int> samples;
  std::optional<int> max_evaluations;
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

/// cube_tosses: the model that evaluate forecasts with.
core::Status run_cube(const CalibrateOptions& options, VerbContext& context) {
  const std::map<std::string, CubeModel> starts = {
      {"measured", measured_cube_model()}, {"described", described_cube_model()}, {"shipped", shipped_cube_model()}};
  if (!options.output.empty() || !options.learned.empty() || !options.keep.empty())
    return core::invalid_input("cube_tosses takes none of -o, --learned and --keep: its model is part of the program");
  const std::string from = options.start.value_or("measured");
  const CubeModel& start = starts.at(from);
  CalibrationOptions search;
  search.samples = options.samples.value_or(search.samples);
  search.max_evaluations = options.max_evaluations.value_or(search.max_evaluations);
  const std::filesystem::path folder = std::filesystem::path(options.data) / options.name;
  PRESCENE_TRY(const std::vector<CubeToss> all, read_cube_tosses(folder));
  const std::vector<CubeToss> tosses = select(all, CubeSplit::kCalibrate);
  PRESCENE_TRY(CubeCalibration found,
               calibrate_cube(tosses, start, context.options().seed, context.pool(),
                              context.progress("calibrating " + options.name), &context.cancellation(), search));
  found.model.provenance = "found by prescene calibrate " + options.name + " --from " + from;
  bool better = found.cost < found.start_cost;

  nlohmann::ordered_json document;
  document["n"] = tosses.size();
  document["evaluations"] = found.evaluations;
  document["widened"] = found.widened;
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

const char* unit_of(simulation::MotionParameter parameter) {
  switch (parameter) {
    case simulation::MotionParameter::kFriction:
    case simulation::MotionParameter::kImpactFriction:
    case simulation::MotionParameter::kRestitution:
      return "1";
    case simulation::MotionParameter::kInertiaSize:
      return "ln factor";
    default:
      return "m";
  }
}

std::string text_of(const ObjectCalibration& found) {
  std::vector<std::vector<std::string>> rows = {{"", "unit", "value", "+-", "before", "+-", "left of prior"}};
  for (const simulation::CalibratedParameter& p : found.motion.parameters) {
    const simulation::MotionBelief& prior = found.prior[static_cast<std::size_t>(p.parameter)];
    rows.push_back({to_string(p.parameter), unit_of(p.parameter), fixed_text(p.value, 5),
                    fixed_text(p.standard_error, 5), fixed_text(prior.mean, 5), fixed_text(prior.deviation, 5),
                    fixed_text(100.0 * p.left_of_prior, 0) + " %"});
  }
  std::string text = table(rows) + "\n" + std::to_string(found.flights) + " recordings begin in flight, " +
                     std::to_string(found.slides) + " on a support; " + std::to_string(found.motion.evaluations) +
                     " models tried\n";
  text += "throws differ as if a tracker with a noise of " + fixed_text(1e3 * found.throws.position, 2) + " mm and " +
          fixed_text(1e3 * found.throws.rotation, 1) + " mrad had seen their starts, and in friction by " +
          fixed_text(100.0 * found.throws.friction, 1) + " %\n";
  if (found.held_out) {
    const TossScores& scores = found.held_out->scores;
    text += "of " + std::to_string(scores.n) + " recordings that the parameters were not fitted to, " +
            fixed_text(100.0 * scores.coverage[2].held.value, 1) + " +- " +
            fixed_text(100.0 * scores.coverage[2].held.standard_error, 1) +
            " % end in their 90 % region; Brier score of the side " + fixed_text(scores.brier.value, 3) + " +- " +
            fixed_text(scores.brier.standard_error, 3) + ", median position error " +
            fixed_text(1e3 * scores.median_error.value, 1) + " +- " +
            fixed_text(1e3 * scores.median_error.standard_error, 1) + " mm\n";
  }
  for (const std::string& remark : found.remarks) text += remark + "\n";
  return text;
}

/// A folder with recordings of somebody's own object.
core::Status run_folder(const CalibrateOptions& options, VerbContext& context) {
  if (options.output.empty() && options.learned.empty())
    return core::invalid_input("-o is missing: name the model file to write, or with --learned a learned file");
  PRESCENE_TRY(const MotionDataset dataset, read_motion_dataset(options.name, context.log()));
  PRESCENE_RETURN_IF_ERROR(check_output("-o", options.output, dataset.inputs));
  PRESCENE_RETURN_IF_ERROR(check_apart("--learned", options.learned, "-o", options.output));
  TrackerSettings earlier;
  PRESCENE_RETURN_IF_ERROR(take_learned(options.learned, dataset.inputs, earlier));
  BackendSettings settings;
  settings.stepper = Stepper::kAutomatic;
  Backends backends(context.pool(), settings);
  ObjectCalibrationOptions fit;
  fit.seed = context.options().seed;
  fit.max_evaluations = options.max_evaluations.value_or(fit.max_evaluations);
  fit.samples = options.samples.value_or(fit.samples);
  fit.keep = options.keep;
  PRESCENE_TRY(const ObjectCalibration found,
               calibrate_object(dataset, backends, fit, context.progress("calibrating"), &context.cancellation()));
  context.end_progress();
  std::string wrote;
  if (!options.output.empty()) {
    const std::filesystem::path output = options.output;
    PRESCENE_TRY(const std::string yaml, calibrated_yaml(dataset, found, output.parent_path()));
    PRESCENE_RETURN_IF_ERROR(interfaces::write_file(output, std::string_view(yaml)));
    wrote += "wrote " + options.output + "\n";
  }
  if (!options.learned.empty()) {
    interfaces::LearnedFile learned;
    if (!earlier.learned.empty()) {
      PRESCENE_TRY(learned, interfaces::parse_learned(earlier.learned, options.learned));
    }
    const std::string yaml = interfaces::learned_yaml(with_calibrated(std::move(learned), dataset, found));
    PRESCENE_RETURN_IF_ERROR(interfaces::write_file(options.learned, std::string_view(yaml)));
    wrote += "wrote " + options.learned + "\n";
  }
  nlohmann::ordered_json document = to_json(found);
  document["output"] = options.output;
  document["learned"] = options.learned;
  context.print(document, text_of(found) + wrote);
  return core::ok_status();
}

core::Status run(const CalibrateOptions& options, VerbContext& context) {
  if (options.name == "cube_tosses" && !options.data.empty()) return run_cube(options, context);
  if (!options.data.empty()) return core::invalid_input("--data goes with cube_tosses only; give the folder itself");
  if (options.name == "cube_tosses" && !std::filesystem::exists(options.name))
    return core::invalid_input("cube_tosses takes --data: name the folder that holds the data sets' folders");
  if (options.start)
    return core::invalid_input("--from goes with cube_tosses only; a folder's scene.yaml is the start");
  return run_folder(options, context);
}

}  // namespace

Verb add_calibrate_verb(CLI::App& app) {
  auto* verb =
      app.add_subcommand("calibrate", "Fit an object's model to recorded motion of it (docs/reference/calibration.md)");
  auto options = std::make_shared<CalibrateOptions>();
  verb->add_option("DATASET", options->name, "Folder with scene.yaml and tosses.csv; or cube_tosses, with --data")
      ->required();
  verb->add_option("-o,--output", options->output,
                   "Model file to write, for scenes to use; required but for cube_tosses")
      ->check(file_name());
  verb->add_option("--learned", options->learned,
                   "Learned file to put what is found into, for serve and replay; made if it is not there")
      ->check(file_name());
  std::vector<std::string> names;
  for (std::size_t i = 0; i < simulation::kMotionParameters; ++i)
    names.push_back(to_string(static_cast<simulation::MotionParameter>(i)));
  verb->add_option(
          "--keep", options->keep,
          "Parameter that stays as the scene has it; may be repeated (inertia_size is the natural logarithm of "
          "a factor)")
      ->check(one_of(names));
  verb->add_option("--samples", options->samples,
                   "Simulated starts a recording; 16, of more than 125 recordings fewer, of cube_tosses 24")
      ->check(CLI::Range(2, 4096));
  verb->add_option("--max-evaluations", options->max_evaluations,
                   "Models that the search tries at most; 1500, of cube_tosses 150")
      ->check(CLI::Range(1, 100000));
  verb->add_option("--data", options->data, "cube_tosses: folder that holds the data sets' folders");
  verb->add_option("--from", options->start,
                   "cube_tosses: where the search starts: measured (read off the recordings), described (by the data "
                   "set), shipped; default measured")
      ->check(one_of({"measured", "described", "shipped"}));
  verb->footer("Example: prescene calibrate recordings -o mug.yaml");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
