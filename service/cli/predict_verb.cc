// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/prediction_report.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct Options {
  std::string scene;
  std::string report;
  std::string stepper = "bullet";
  belief::Effort effort;
  double max_seconds = 0.0;
  double duration = 0.0;
};

nlohmann::ordered_json document_of(const belief::Scene& scene, std::uint64_t seed, const belief::Answer& answer) {
  nlohmann::ordered_json document = {{"scene", scene.name}, {"seed", seed}};
  document.update(belief::to_json(answer).at("predict"));
  return document;
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
    text = "The scene names no outcomes to judge (docs/scene_files.md); mean final positions:\n";
    for (const belief::FinalPoses& poses : predicted.final_poses) {
      const geometry::Vector3d& p = poses.mean_position;
      text += "  " + poses.object + ": " + fixed_text(p.x(), 3) + " " + fixed_text(p.y(), 3) + " " +
              fixed_text(p.z(), 3) + " m\n";
    }
  }
  return text + std::to_string(predicted.instances) + " instances, " + fixed_text(predicted.simulated_seconds, 0) +
         " simulated seconds, " + fixed_text(predicted.wall_seconds, 1) + " s" +
         (predicted.converged ? "" : "; not all intervals reached the tolerance") + "\n";
}

core::Status run(const Options& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.scene}));
  PRESCENE_TRY(const auto scene, load_scene(options.scene, context.log()));
  BackendSettings settings;
  if (options.stepper == "automatic") settings.stepper = Stepper::kAutomatic;
  if (options.stepper == "lockstep") settings.stepper = Stepper::kLockstep;
  Backends backends(context.pool(), settings);
  belief::PredictQuery question;
  question.effort = options.effort;
  if (options.max_seconds > 0.0) question.effort.max_seconds = options.max_seconds;
  if (options.duration > 0.0) question.duration = options.duration;
  queries::QueryContext query_context = backends.query_context(context.pool());
  query_context.cancellation = &context.cancellation();
  query_context.progress = context.progress("predicting");
  const belief::Answer answer = queries::answer(scene, context.options().seed, {"predict", question}, query_context);
  context.end_progress();
  if (!answer.error.empty()) return status_of_error(options.scene + ": ", answer.error);

  if (!options.report.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_prediction_report(options.report, *scene, answer, backends));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  context.print(document_of(*scene, context.options().seed, answer),
                text_of(std::get<belief::PredictAnswer>(answer.what), options.effort.confidence));
  if (context.cancellation().requested()) return core::cancelled("stopped on request; what was done is printed");
  return core::ok_status();
}

}  // namespace

Verb add_predict_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("predict", "What happens in a scene: probabilities of its outcomes, with intervals");
  auto options = std::make_shared<Options>();
  verb->add_option("SCENE", options->scene, "Scene file (docs/scene_files.md)")->required();
  verb->add_option("--tolerance", options->effort.tolerance, "Half width of the intervals to reach")
      ->check(number_between(1e-4, 0.5))
      ->capture_default_str();
  verb->add_option("--confidence", options->effort.confidence, "Of the intervals")
      ->check(number_between(0.5, 0.9999))
      ->capture_default_str();
  verb->add_option("--max-instances", options->effort.max_instances, "Most simulated instances")
      ->check(CLI::Range(1, 1 << 22))
      ->capture_default_str();
  verb->add_option("--max-seconds", options->max_seconds,
                   "Wall time, s, after which no more instances begin; the answer then depends on the machine's speed")
      ->check(positive_number());
  verb->add_option("--duration", options->duration, "Longest simulated time, s, instead of the scene's")
      ->check(positive_number());
  verb->add_option(
          "--stepper", options->stepper,
          "Who simulates: bullet, or in lockstep, 3 to 7 times faster, what it can (automatic) or all (lockstep; "
          "docs/simulation.md says which scenes)")
      ->check(CLI::IsMember({"bullet", "automatic", "lockstep"}))
      ->capture_default_str();
  verb->add_option("--report", options->report, "Write an HTML page with pictures, tables and timelines");
  verb->footer("Example: prescene predict scenarios/milk_on_bin.yaml --json --seed 1");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
