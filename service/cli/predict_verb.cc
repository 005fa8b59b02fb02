// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/pictures/heat_map_picture.h"
#include "prescene/service/pictures/prediction_report.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct PredictOptions {
  std::string scene;
  std::string report;
  std::string stepper = "automatic";
  std::string step;
  std::string heat_map;
  belief::Effort effort;
  double max_seconds = 0.0;
  std::string budget;
  bool outcomes_only = false;
  bool model_error = false;
  double duration = 0.0;
};

std::optional<double> step_of(const std::string& text) {
  double step = 0.0;
  if (!interfaces::parse_number(text, &step) || step < 1e-5 || step > 0.02) return std::nullopt;
  return step;
}

nlohmann::ordered_json document_of(const belief::Scene& scene, std::uint64_t seed, const belief::Answer& answer) {
  nlohmann::ordered_json document = {{"scene", scene.name}, {"seed", seed}};
  document.update(belief::to_json(answer).at("predict"));
  return document;
}

/// "where is decided by carton: position x (57 +-4 %), ...": inputs whose share is surely more than nothing.
std::string deciding_text(const belief::DecidingInputs& inputs, int instances) {
  constexpr std::size_t kShown = 3;
  std::string text;
  std::size_t shown = 0;
  for (const belief::InputShare& input : inputs.inputs) {
    if (shown == kShown || input.share < 0.02 || input.share < 2.0 * input.standard_error) break;
    text += (shown++ > 0 ? ", " : "") + input.input + " (" + fixed_text(100.0 * input.share, 0) + " +-" +
            fixed_text(std::ceil(100.0 * input.standard_error), 0) + " %)";  // rather too large, and never 0
  }
  const std::string about = inputs.about + " is decided by ";
  if (text.empty()) return about + "no single uncertain input that " + std::to_string(instances) + " instances show\n";
  text = about + text;
  if (!inputs.by_several)
    return text + "; the rest is unexplained (" + std::to_string(instances) + " instances are too few to say)\n";
  if (*inputs.by_several > 0.02)
    text += "; by several together, or by differences too fine for these instances, about " +
            fixed_text(100.0 * *inputs.by_several, 0) + " %";
  return text + "\n";
}

std::string cost_text(const belief::PredictAnswer& predicted) {
  std::string text = counted(static_cast<std::size_t>(predicted.instances), "instance") + ", ";
  if (predicted.step > 0.0) text += fixed_text(predicted.simulated_seconds / predicted.step, 0) + " steps, ";
  text += fixed_text(predicted.simulated_seconds, 0) + " simulated seconds, " + fixed_text(predicted.cpu_seconds, 1) +
          " s of processor time, " + fixed_text(predicted.wall_seconds, 1) + " s";
  if (const belief::CertificateSummary& use = predicted.certificates; use.used)
    text += "; " + fixed_text(100.0 * use.certified / std::max(1, predicted.instances), 0) + " % ended when decided (" +
            std::to_string(use.audited) + " audited, " + std::to_string(use.mismatches) + " otherwise)";
  return text + (predicted.converged ? "\n" : "; not all intervals reached the tolerance\n");
}

/// "slide ends at 0.213 m (90 %: 0.187 to 0.244)".
std::string joint_text(const belief::JointForecast& joint) {
  const bool hinge = joint.type == belief::JointType::kHinge;
  const auto number = [&](double value) {
    return hinge ? fixed_text(value * geometry::kDegreesPerRadian, 1) : fixed_text(value, 3);
  };
  return joint.joint + " ends at " + number(joint.middle) + (hinge ? " degrees" : " m") +
         " (90 %: " + number(joint.low) + " to " + number(joint.high) + ")\n";
}

/// Each stepper has a limit of its own (docs/reference/simulation.md).
std::string hull_note(const belief::PredictAnswer& predicted) {
  if (predicted.hull_error <= 0.0) return "";
  const std::string error = fixed_text(1e3 * predicted.hull_error, 2) + " mm";
  if (predicted.stepper == "bullet")
    return "Note: Bullet's stepper simplifies hulls of more than 1500 vertices, here by up to " + error + ".\n";
  return "Note: Hulls of more than 64 vertices, or 16 corners a side, are simplified, here by up to " + error +
         "; '--stepper bullet' takes those of up to 1500 vertices as they are.\n";
}

std::string text_of(const belief::PredictAnswer& predicted, double confidence) {
  std::vector<std::vector<std::string>> rows = {
      {"outcome", "probability", core::rounded_text(100.0 * confidence) + " % interval"}};
  std::string group;
  for (const belief::OutcomeProbability& outcome : predicted.outcomes) {
    if (outcome.group != group && !outcome.group.empty()) rows.push_back({outcome.group + ":", "", ""});
    group = outcome.group;
    rows.push_back({(group.empty() ? "" : "  ") + outcome.name, fixed_text(outcome.probability, 3),
                    fixed_text(outcome.low, 3) + " to " + fixed_text(outcome.high, 3)});
  }
  std::string text = table(rows) + "\n";
  if (predicted.outcomes.empty()) {
    text = "The scene names no outcomes to judge (docs/reference/scene_files.md); mean final positions:\n";
    for (const belief::FinalPoses& poses : predicted.final_poses) {
      const geometry::Vector3d& p = poses.mean_position;
      text += "  " + poses.object + ": " + fixed_text(p.x(), 3) + " " + fixed_text(p.y(), 3) + " " +
              fixed_text(p.z(), 3) + " m\n";
    }
  }
  for (const belief::JointForecast& joint : predicted.joints) text += joint_text(joint);
  for (const belief::DecidingInputs& inputs : predicted.inputs) {
    // Of what hardly varies it is idle to ask what decides it.
    const bool open = std::any_of(predicted.outcomes.begin(), predicted.outcomes.end(), [&](const auto& outcome) {
      return (outcome.group.empty() ? outcome.name : outcome.group) == inputs.about && outcome.probability > 0.02 &&
             outcome.probability < 0.98;
    });
    if (open) text += deciding_text(inputs, predicted.instances);
  }
  text += cost_text(predicted);
  text += hull_note(predicted);
  if (!predicted.not_lockstep.empty())
    text += "Note: Simulated by Bullet's stepper, which is 2.4 to 7 times slower than the lockstep stepper, because " +
            predicted.not_lockstep + ".\n";
  for (const std::string& remark : predicted.remarks) text += "Note: " + remark + "\n";
  return text;
}

/// "0.1s", "100ms", "2 min": seconds; nothing where it is no time above 0.
std::optional<double> seconds_of(const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {  // the standard library's way of saying that it is no number
    return std::nullopt;
  }
  std::string unit = text.substr(used);
  unit.erase(0, unit.find_first_not_of(' '));
  double factor = 0.0;
  if (unit == "s" || unit.empty()) factor = 1.0;
  if (unit == "ms") factor = 1e-3;
  if (unit == "min") factor = 60.0;
  const double seconds = factor * value;
  return belief::check_number(seconds, belief::kWallSeconds).ok() ? std::optional(seconds) : std::nullopt;
}

/// What is printed and drawn decides what is asked for; what is not shown is not worked out.
belief::PredictDetail detail_of(const PredictOptions& options, bool json) {
  belief::PredictDetail detail;
  const bool pictures = !options.report.empty() || !options.heat_map.empty();
  const bool full = (json && !options.outcomes_only) || pictures;
  detail.final_poses = detail.typical_runs = full;
  detail.inputs = true;
  detail.contacts = full;
  // These take more instances than the estimate itself does, so a limit on time leaves them out.
  const bool unlimited = options.max_seconds <= 0.0 && options.budget.empty();
  detail.chaos = unlimited || options.model_error;
  detail.model_error = options.model_error;
  detail.paths = pictures ? 48 : 0;
  return detail;
}

core::Status run(const PredictOptions& options, VerbContext& context) {
  if (options.outcomes_only && (!context.options().json || !options.report.empty() || !options.heat_map.empty()))
    return core::invalid_input(
        "--outcomes-only is for --json without --report and --heat-map, which show where things end: leave it out (the "
        "text without --json works out no more than outcomes by itself)");
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_png("--heat-map", options.heat_map));
  PRESCENE_RETURN_IF_ERROR(check_output("--heat-map", options.heat_map, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_apart("--heat-map", options.heat_map, "--report", options.report));
  PRESCENE_TRY(auto scene, load_scene(options.scene, context.log()));
  if (!options.step.empty()) {
    auto with_step = std::make_shared<belief::Scene>(*scene);
    with_step->step = options.step == "auto" ? std::nullopt : step_of(options.step);
    scene = std::move(with_step);
  }
  BackendSettings settings;
  if (options.stepper == "bullet") settings.stepper = Stepper::kBullet;
  if (options.stepper == "lockstep") settings.stepper = Stepper::kLockstep;
  Backends backends(context.pool(), settings);
  belief::PredictQuery question;
  question.effort = options.effort;
  if (options.max_seconds > 0.0) question.effort.max_seconds = options.max_seconds;
  if (!options.budget.empty()) question.effort.max_seconds = seconds_of(options.budget);
  if (options.duration > 0.0) question.duration = options.duration;
  question.detail = detail_of(options, context.options().json);
  // Without outcomes, where things end is the answer.
  if (scene->outcomes.empty() && scene->exclusive_outcomes.empty()) question.detail.final_poses = true;
  queries::QueryContext query_context = backends.query_context(context.pool());
  query_context.cancellation = &context.cancellation();
  query_context.progress = context.progress("predicting");
  const belief::Answer answer = queries::answer(scene, context.options().seed, {"predict", question}, query_context);
  context.end_progress();
  PRESCENE_RETURN_IF_ERROR(answer.error.at(options.scene));

  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  if (!options.heat_map.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_heat_map(options.heat_map, *scene, predicted, backends));
    core::log(context.log(), core::LogLevel::kInfo, "heat map written to " + options.heat_map);
  }
  if (!options.report.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_prediction_report(options.report, *scene, answer, backends));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  context.print(document_of(*scene, context.options().seed, answer), text_of(predicted, options.effort.confidence));
  if (context.cancellation().requested()) return core::cancelled("stopped on request; what was done is printed");
  return core::ok_status();
}

}  // namespace

Verb add_predict_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("predict", "What happens in a scene: probabilities of its outcomes, with intervals");
  auto options = std::make_shared<PredictOptions>();
  verb->add_option("SCENE", options->scene, "Scene file (docs/reference/scene_files.md)")->required();
  verb->add_option("--tolerance", options->effort.tolerance, "Half width of the intervals to reach")
      ->check(in_range(belief::kTolerances))
      ->capture_default_str();
  verb->add_option("--confidence", options->effort.confidence, "Of the intervals")
      ->check(in_range(belief::kConfidences))
      ->capture_default_str();
  verb->add_option("--max-instances", options->effort.max_instances, "Most simulated instances")
      ->check(CLI::Range(1, belief::kMostInstances))
      ->capture_default_str();
  verb->add_option("--max-seconds", options->max_seconds,
                   "Wall time, s, after which no more instances begin; the answer then depends on the machine's speed")
      ->check(in_range(belief::kWallSeconds));
  verb->add_option("--budget", options->budget,
                   "The same with a unit, as 0.1s, 100ms or 2min (a number alone is seconds); what takes further "
                   "instances is left out")
      ->excludes("--max-seconds")
      ->check(CLI::Validator(
          [](std::string& text) {
            return seconds_of(text) ? std::string()
                                    : "'" + text +
                                          "' is no time above 0 and up to 1000000 s: give one as 0.1s, 100ms or 2min; "
                                          "a number alone is seconds";
          },
          "TIME"));
  verb->add_flag("--outcomes-only", options->outcomes_only,
                 "With --json: no final poses, typical runs and contacts, so that instances end once they are decided");
  verb->add_flag("--model-error", options->model_error,
                 "Also repeat instances at half and double step and at the ends of uncertain parameters");
  verb->add_option("--heat-map", options->heat_map, "Write a PNG picture of where objects end")->check(file_name());
  verb->add_option("--duration", options->duration, "Longest simulated time, s, instead of the scene's")
      ->check(in_range(belief::kDurations));
  verb->add_option(
          "--stepper", options->stepper,
          "Simulator. lockstep: many instances at once, 2.4 to 7 times faster, but not every scene "
          "(docs/reference/simulation.md says which; others are refused). bullet: every scene. automatic: lockstep "
          "where it can, else bullet, and the answer says why")
      ->check(one_of({"automatic", "bullet", "lockstep"}))
      ->capture_default_str();
  verb->add_option("--step", options->step,
                   "Of the simulation, s, or auto: by the size of the smallest object; instead of the scene's")
      ->check(CLI::Validator(
          [](std::string& text) {
            return text == "auto" || step_of(text)
                       ? std::string()
                       : "'" + text + "' is neither auto nor a step between 0.00001 and 0.02 s";
          },
          "auto|SECONDS"));
  verb->add_option("--report", options->report, "Write an HTML page with pictures, tables and timelines")
      ->check(file_name());
  verb->footer("Example: prescene predict scenarios/milk_on_bin.yaml --json --seed 1");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
