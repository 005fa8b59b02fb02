// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "output_files.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/training/train_proposals.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct TrainOptions {
  std::string scene;
  std::string output;
  TrainingOptions training;
  BackendSettings backends;
};

std::string text_of(const TrainedProposals& trained) {
  std::string text = counted(trained.proposals.models.size(), "model") + ", " +
                     counted(static_cast<std::size_t>(trained.patches), "place") + "\n";
  if (trained.proposals.fit.empty())
    return text + "fits are not judged: no scene with right and wrong ones was imagined\n";
  const TrainingCheck& check = trained.check;
  return text + std::to_string(trained.candidates) + " fits judged, " + std::to_string(trained.right_candidates) +
         " of them right\nin the last scenes, which the judge had not seen: " + std::to_string(check.found) + " of " +
         std::to_string(check.expected) + " expected objects found; " + std::to_string(check.right) + " of " +
         std::to_string(check.reported) + " finds right, mean confidence " + fixed_text(check.confidence, 2) + "\n";
}

core::Status run(const TrainOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(check_output("-o", options.output, {options.scene}));
  PRESCENE_TRY(const auto scene, load_scene(options.scene, context.log()));
  Backends backends(context.pool(), options.backends);
  TrainingOptions training = options.training;
  training.seed = context.options().seed;
  const double before = core::process_cpu_seconds();
  const core::Result<TrainedProposals> trained =
      train_proposals(*scene, training, backends, context.progress("training"), &context.cancellation());
  context.end_progress();
  if (!trained) return trained.status().at(options.scene);
  PRESCENE_RETURN_IF_ERROR(write_proposals(options.output, trained->proposals));
  std::error_code none;
  const auto size = std::filesystem::file_size(options.output, none);
  nlohmann::ordered_json document = to_json(*trained);
  document["output"] = options.output;
  document["bytes"] = none ? 0 : size;
  document["seed"] = training.seed;
  document["cpu_s"] = core::process_cpu_seconds() - before;
  context.print(document, text_of(*trained) + "wrote " + options.output + "\n");
  return core::ok_status();
}

}  // namespace

Verb add_train_verb(CLI::App& app) {
  auto* verb =
      app.add_subcommand("train", "Learn to find a scene's models in single frames, by imagining scenes of them");
  auto options = std::make_shared<TrainOptions>();
  verb->add_option("SCENE", options->scene, "Scene file: its models are learned, on its supports and on others")
      ->required();
  verb->add_option("-o,--output", options->output, "File to write, for --proposals of `serve` and `replay`")
      ->required()
      ->check(file_name());
  verb->add_option("--views", options->training.views, "Pictures of each model")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  verb->add_option("--scenes", options->training.scenes,
                   "Imagined scenes; with 0 only views are learned, and fits are judged as without training")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str();
  add_likelihood_options(*verb, options->backends.likelihood);
  verb->footer("Example: prescene train scenarios/five_objects_pushed.yaml -o proposals.bin");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
