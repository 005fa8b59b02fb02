// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "prescene/core/text.h"
#include "prescene/service/evaluate/cube_tosses.h"
#include "prescene/service/evaluate/ycb_video.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct Options {
  std::string name;
  std::string data;
  std::string split = "report";
  rendering::LikelihoodChoice likelihood;
};

std::string metres_as_mm(double metres) { return fixed_text(1e3 * metres, 1); }

std::string text_of(const CubeReport& report) {
  return table(
      {{"tosses", "right face", "Brier", "log score", "median xy error, mm", "90 %, mm", "in 50 % region",
        "in 90 % region"},
       {std::to_string(report.n), fixed_text(report.right_face_share, 3), fixed_text(report.brier, 3),
        fixed_text(report.log_score, 3), metres_as_mm(report.median_xy_error_m), metres_as_mm(report.p90_xy_error_m),
        fixed_text(report.coverage_50, 3), fixed_text(report.coverage_90, 3)}});
}

std::string text_of(const YcbReport& report) {
  const auto row = [](const std::string& start, const YcbSection& section) -> std::vector<std::string> {
    return {start,
            std::to_string(section.n),
            fixed_text(100.0 * section.share_adds_below_2cm, 1) + " %",
            metres_as_mm(section.median_adds_m),
            metres_as_mm(section.median_add_m),
            fixed_text(section.ms_per_object, 0)};
  };
  double largest = 0.0;
  for (const YcbAucRow& auc : report.auc)
    largest = std::max({largest, std::abs(auc.add - auc.expected_add), std::abs(auc.adds - auc.expected_adds)});
  return table({{"start", "n", "ADD-S below 2 cm", "median ADD-S, mm", "median ADD, mm", "ms an object"},
                row("disturbed", report.disturbed),
                row("amortised", report.amortised)}) +
         "amortised: " + std::to_string(report.amortised.found) + " of " + std::to_string(report.amortised.n) +
         " found, " + std::to_string(report.amortised.false_detections) + " false\n" +
         std::to_string(report.auc.size()) + " published areas under the curve, largest difference " +
         core::rounded_text(largest) + " points\n";
}

core::Status run(const Options& options, VerbContext& context) {
  const std::filesystem::path folder = std::filesystem::path(options.data) / options.name;
  const core::ProgressSink progress = context.progress("evaluating " + options.name);
  nlohmann::ordered_json document;
  std::string text;
  if (options.name == "ycb_video") {
    YcbOptions ycb;
    ycb.likelihood = options.likelihood;
    PRESCENE_TRY(const YcbReport report, evaluate_ycb_video(folder, context.options().seed, context.pool(), progress,
                                                            &context.cancellation(), ycb));
    document = to_json(report);
    text = text_of(report);
  } else {
    const CubeSplit split = options.split == "calibrate" ? CubeSplit::kCalibrate
                            : options.split == "all"     ? CubeSplit::kAll
                                                         : CubeSplit::kReport;
    PRESCENE_TRY(const CubeReport report, evaluate_cube_tosses(folder, split, context.options().seed, context.pool(),
                                                               progress, &context.cancellation()));
    document = to_json(report);
    text = text_of(report);
  }
  context.print(document, text);
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
  add_likelihood_options(*verb, options->likelihood);
  verb->footer("Example: prescene evaluate ycb_video --data data --json");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
