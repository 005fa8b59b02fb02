// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "prescene/service/evaluate/cube_tosses.h"
#include "prescene/service/evaluate/ycb_video.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct Options {
  std::string name;
  std::string data;
  std::string split = "report";
};

core::Status run(const Options& options, VerbContext& context) {
  const std::filesystem::path folder = std::filesystem::path(options.data) / options.name;
  const core::ProgressSink progress = context.progress("evaluating " + options.name);
  nlohmann::ordered_json document;
  if (options.name == "ycb_video") {
    PRESCENE_TRY(const YcbReport report,
                 evaluate_ycb_video(folder, context.options().seed, context.pool(), progress, &context.cancellation()));
    document = to_json(report);
  } else {
    const CubeSplit split = options.split == "calibrate" ? CubeSplit::kCalibrate
                            : options.split == "all"     ? CubeSplit::kAll
                                                         : CubeSplit::kReport;
    PRESCENE_TRY(const CubeReport report, evaluate_cube_tosses(folder, split, context.options().seed, context.pool(),
                                                               progress, &context.cancellation()));
    document = to_json(report);
  }
  context.print(document, document.dump(2) + "\n");
  return core::ok_status();
}

}  // namespace

Verb add_evaluate_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("evaluate", "Figures on real data (docs/accuracy.md)");
  auto options = std::make_shared<Options>();
  verb->add_option("NAME", options->name, "cube_tosses or ycb_video")
      ->required()
      ->check(CLI::IsMember({"cube_tosses", "ycb_video"}));
  verb->add_option("--data", options->data, "Folder that holds the data sets' folders")->required();
  verb->add_option("--split", options->split, "Of cube_tosses: calibrate (even places in the list), report (odd), all")
      ->check(CLI::IsMember({"calibrate", "report", "all"}))
      ->capture_default_str();
  verb->footer("Example: prescene evaluate ycb_video --data data --json");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
