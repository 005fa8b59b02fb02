// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "evaluate_folder.h"
#include "output_files.h"
#include "prescene/core/spelling.h"
#include "prescene/core/text.h"
#include "prescene/service/evaluate/carried_cube.h"
#include "prescene/service/evaluate/cleargrasp.h"
#include "prescene/service/evaluate/credible_regions.h"
#include "prescene/service/evaluate/cube_tosses.h"
#include "prescene/service/evaluate/event_episodes.h"
#include "prescene/service/evaluate/explained_events.h"
#include "prescene/service/evaluate/finding.h"
#include "prescene/service/evaluate/simulated_supports.h"
#include "prescene/service/evaluate/suite_scenes.h"
#include "prescene/service/evaluate/tracking_suite.h"
#include "prescene/service/evaluate/ycb_video.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/training/train_proposals.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct EvaluateOptions {
  std::string name;
  std::string data;
  std::string split = "report";
  rendering::LikelihoodChoice likelihood;
  int frames = 0;  // 0 = as many as the figure's own default
  TrackingOptions tracking;
  std::string keep;
  ExplainedEventsOptions explain;
  std::string proposals;
  std::string train;
  EvaluateFolderOptions own;
  const CLI::App* verb = nullptr;
};

const std::vector<std::string>& known_names() {
  static const std::vector<std::string> kNames = {"cube_tosses", "ycb_video", "cleargrasp", "credible_regions",
                                                  "finding",     "tracking",  "explain"};
  return kNames;
}

bool is_known(const std::string& name) { return std::ranges::find(known_names(), name) != known_names().end(); }

/// kInvalidInput for an option that says nothing about this figure.
core::Status check_options(const EvaluateOptions& options) {
  static const std::vector<std::pair<const char*, std::vector<std::string>>> kOptionsOf = {
      {"--split", {"cube_tosses"}},
      {"--likelihood", {"ycb_video", "finding", "tracking"}},
      {"--graphics-device", {"ycb_video", "finding", "tracking"}},
      {"--frames", {"credible_regions", "finding"}},
      {"--sequences", {"tracking"}},
      {"--kind", {"tracking"}},
      {"--rate", {"tracking"}},
      {"--keep", {"tracking"}},
      {"--episodes", {"explain"}},
      {"--event", {"explain"}},
      {"--proposals", {"finding"}},
      {"--train", {"finding"}},
      {"--data", {"cube_tosses", "ycb_video", "cleargrasp", "tracking"}},
  };
  for (const auto& [option, figures] : kOptionsOf) {
    if (options.verb->count(option) == 0 || std::ranges::find(figures, options.name) != figures.end()) continue;
    return core::invalid_input(std::string(option) + " is for " + core::comma_list(figures) + ", not for " +
                               options.name + ": leave it out");
  }
  return core::ok_status();
}

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

std::string text_of(const ClearGraspReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"frame", "pixels of", "n", "better explained as transparent, %", "nats a pixel in favour"}};
  const auto add = [&rows](const ClearGraspScore& score) {
    for (const auto& [kind, share] : {std::pair{"the mask", &score.all},
                                      {"no return", &score.missing},
                                      {"a return from behind", &score.behind},
                                      {"a return from the surface", &score.at_surface},
                                      {"a return from in front", &score.in_front},
                                      {"the painted twin", &score.painted}})
      rows.push_back({score.frame, kind, std::to_string(share->n), fixed_text(100.0 * share->share(), 1),
                      fixed_text(share->nats_per_pixel(), 2)});
  };
  for (const ClearGraspScore& score : report.frames) add(score);
  add(report.total);
  return table(rows) + std::to_string(report.total.all.n) + " of " + std::to_string(report.total.mask_pixels) +
         " mask pixels have a surface known from the painted twin\n";
}

std::string text_of(const CredibleRegionReport& report) {
  std::vector<std::vector<std::string>> rows = {{"frames", "n", "pixels", "tempering times", "truth in 90 % region, %",
                                                 "in 50 %", "in 90 % ellipsoid, %", "in 50 %"}};
  for (const CoverageRow& row : report.rows)
    for (std::size_t k = 0; k < report.factors.size(); ++k) {
      if (row.group != "all" && report.factors[k] != 1.0) continue;
      rows.push_back({row.group, std::to_string(row.n), fixed_text(row.pixels, 0), fixed_text(report.factors[k], 1),
                      fixed_text(100.0 * row.weights_90[k], 1), fixed_text(100.0 * row.weights_50[k], 1),
                      fixed_text(100.0 * row.information_90[k], 1), fixed_text(100.0 * row.information_50[k], 1)});
    }
  return table(rows);
}

std::string text_of(const FindingReport& report) {
  std::vector<std::vector<std::string>> rows = {
      {"objects", "looked for", "expected", "found", "found, %", "wrong", "wrong and sure"}};
  for (const FindingRow& row : report.rows)
    rows.push_back({row.group, std::to_string(row.looked_for), std::to_string(row.expected), std::to_string(row.found),
                    fixed_text(100.0 * row.found / std::max(1, row.expected), 1), std::to_string(row.wrong),
                    std::to_string(row.sure_wrong)});
  return table(rows) + std::to_string(report.frames) + " frames; median ADD-S " + metres_as_mm(report.median_adds_m) +
         " mm; mean confidence " + fixed_text(report.right_confidence, 2) + " at the right place, " +
         fixed_text(report.wrong_confidence, 2) + " elsewhere; processor time " + fixed_text(report.cpu_s, 2) +
         " s, at most " + fixed_text(report.most_cpu_s, 2) + " s, with five objects " +
         fixed_text(report.cpu_s_of_five, 2) + " s\n";
}

core::Status run_tracking(const EvaluateOptions& options, VerbContext& context) {
  TrackingOptions tracking = options.tracking;
  tracking.keep = options.keep;
  tracking.likelihood = options.likelihood;
  if (options.data.empty() && tracking.kinds.empty())
    core::log(context.log(), core::LogLevel::kInfo, "simulated sequences only: name the recorded data with --data");
  PRESCENE_TRY(const TrackingReport report,
               evaluate_tracking(options.data, tracking, context.options().seed, context.pool(),
                                 context.progress("evaluating tracking"), &context.cancellation()));
  context.print(to_json(report), table(table_of(report)));
  return core::ok_status();
}

/// What was learned of the models of finding's rooms before, or is learned now.
core::Result<filter::LearnedModels> learned_of_rooms(const EvaluateOptions& options, VerbContext& context) {
  if (options.proposals.empty() && options.train.empty()) return filter::LearnedModels();
  PRESCENE_TRY(const belief::Scene models, room_models());
  if (!options.proposals.empty()) return load_proposals(options.proposals, models);
  PRESCENE_RETURN_IF_ERROR(check_output("--train", options.train, {}));
  BackendSettings settings;
  settings.likelihood = options.likelihood;
  Backends backends(context.pool(), settings);
  PRESCENE_TRY(TrainedProposals trained,
               train_proposals(models, {}, backends, context.progress("training"), &context.cancellation()));
  PRESCENE_RETURN_IF_ERROR(write_proposals(options.train, trained.proposals));
  return filter::LearnedModels(std::make_shared<filter::LearnedProposals>(std::move(trained.proposals)));
}

core::Status run(const EvaluateOptions& options, VerbContext& context) {
  if (!is_known(options.name) && !options.data.empty())
    return core::invalid_input("--data goes with data sets that have a name; give the folder itself");
  PRESCENE_RETURN_IF_ERROR(check_options(options));
  if (!is_known(options.name)) {
    EvaluateFolderOptions own = options.own;
    own.folder = options.name;
    return evaluate_folder(own, context);
  }
  if (!options.own.model.empty() || options.own.folds || options.own.max_evaluations || options.own.each ||
      !options.own.report.empty())
    return core::invalid_input(
        "--model, --folds, --max-evaluations, --each and --report go with a folder of your own tosses, "
        "not with " +
        options.name);
  if (options.name == "tracking") return run_tracking(options, context);
  const bool simulated = options.name == "credible_regions" || options.name == "finding" || options.name == "explain";
  if (!simulated && options.data.empty())
    return core::invalid_input("evaluate " + options.name + " needs recorded data: name its folder with --data");
  const std::filesystem::path folder = std::filesystem::path(options.data) / options.name;
  const core::ProgressSink progress = context.progress("evaluating " + options.name);
  nlohmann::ordered_json document;
  std::string text;
  if (options.name == "credible_regions") {
    CredibleRegionOptions regions;
    if (options.frames > 0) regions.frames = options.frames;
    PRESCENE_TRY(const auto frames,
                 frame_posteriors(regions, context.options().seed, context.pool(), progress, &context.cancellation()));
    const CredibleRegionReport report = coverage(frames, regions.factors);
    document = to_json(report);
    text = text_of(report);
  } else if (options.name == "finding") {
    FindingOptions finding;
    finding.first = context.options().seed;
    finding.likelihood = options.likelihood;
    if (options.frames > 0) finding.frames = options.frames;
    PRESCENE_TRY(finding.learned, learned_of_rooms(options, context));
    PRESCENE_TRY(const FindingReport report,
                 evaluate_finding(finding, context.pool(), progress, &context.cancellation()));
    document = to_json(report);
    text = text_of(report);
  } else if (options.name == "explain") {
    PRESCENE_TRY(const ExplainedEventsReport report,
                 evaluate_explained_events(options.explain, context.options().seed, context.pool(), progress,
                                           &context.cancellation()));
    document = to_json(report);
    text = table(table_of(report)) + "expected calibration error " + fixed_text(expected_calibration_error(report), 3) +
           "\n";
  } else if (options.name == "cleargrasp") {
    PRESCENE_TRY(const ClearGraspReport report,
                 evaluate_cleargrasp(folder, context.options().seed, progress, &context.cancellation()));
    document = to_json(report);
    text = text_of(report);
  } else if (options.name == "ycb_video") {
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
  auto* verb = app.add_subcommand(
      "evaluate", "Figures on real data, and on simulated frames where the truth is known (docs/studies/accuracy.md)");
  auto options = std::make_shared<EvaluateOptions>();
  verb->add_option(
          "NAME", options->name,
          "Folder with scene.yaml and tosses.csv (docs/reference/calibration.md); or cube_tosses (forecasts), "
          "ycb_video (poses), cleargrasp (share of pixels of transparent things that "
          "the transparent material explains better than the opaque one), or, on simulated frames, which need "
          "no data: credible_regions (tempering), finding (objects without start poses, several supports), "
          "tracking (sequences of eleven kinds, and with --data a real cube in a robot's hand), explain (unreported "
          "events)")
      ->required()
      ->check(CLI::IsMember(known_names()) | CLI::ExistingDirectory);
  verb->add_option("--model", options->own.model,
                   "Of a folder: model file to forecast with; else the scene's own model")
      ->check(file_name());
  verb->add_option("--folds", options->own.folds,
                   "Of a folder: forecast each of so many parts with a model that is fitted to the others")
      ->check(CLI::Range(2, 1000));
  verb->add_option("--max-evaluations", options->own.max_evaluations,
                   "Of a folder, with --folds: models that each fit's search tries at most; 1500")
      ->check(CLI::Range(1, 100000));
  verb->add_flag("--each", options->own.each, "Of a folder: print a line for each toss (--json always has them)");
  verb->add_option("--report", options->own.report,
                   "Of a folder: write a page with scores, reliability and errors (HTML)")
      ->check(file_name());
  verb->add_option("--data", options->data, "Folder that holds the data sets' folders");
  verb->add_option("--split", options->split, "Of cube_tosses: calibrate (even places in the list), report (odd), all")
      ->check(one_of({"calibrate", "report", "all"}))
      ->capture_default_str();
  add_likelihood_options(*verb, options->likelihood);
  verb->add_option("--frames", options->frames,
                   "Of credible_regions (480) and finding (60, the first of them numbered by --seed): simulated frames")
      ->check(CLI::Range(1, 1'000'000));
  verb->add_option("--sequences", options->tracking.sequences, "Of tracking: sequences of each kind")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option("--kind", options->tracking.kinds,
                   "Of tracking: only sequences of this kind (may be repeated): " + core::comma_list(suite_kinds()) +
                       "; with --data also " + kCarriedCube);
  verb->add_option("--episodes", options->explain.episodes, "Of explain: episodes, all kinds in turn")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  verb->add_option(
      "--event", options->explain.kinds,
      "Of explain: only episodes of this kind (may be repeated): " + core::comma_list(event_episode_kinds()));
  verb->add_option("--rate", options->tracking.rate, "Of tracking: simulated frames a second")
      ->check(number_between(1.0, 120.0))
      ->capture_default_str();
  verb->add_option(
          "--keep", options->keep,
          "Of tracking: a folder for the recordings and their scene files; whole ones of the same scene, seed and rate "
          "that are there are used again")
      ->check(file_name());
  verb->add_option("--proposals", options->proposals,
                   "Of finding: a file that --train wrote; what it learned of the rooms' models is used")
      ->check(file_name());
  verb->add_option(
          "--train", options->train,
          "Of finding: learn the rooms' models first, as `prescene train` does with seed 1, and write this file")
      ->check(file_name())
      ->excludes("--proposals");
  options->verb = verb;
  verb->footer("Example: prescene evaluate recordings --model mug.yaml");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
