// SPDX-License-Identifier: Apache-2.0
// How well known objects are found in real RGB-D frames (YCB-Video), and whether the error measures are the published
// ones.
//
//   PRESCENE_TRY(YcbReport report, evaluate_ycb_video(dir, seed, threads, sink));
//   ... report.disturbed.share_adds_below_2cm
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/rendering/gpu/likelihood_choice.h"

namespace prescene::service {

struct YcbOptions {
  int draws = 20;                          ///< Disturbed starts per object.
  double shift = 0.05;                     ///< m, exactly, in a uniform direction.
  double turn = 0.5235987755982988;        ///< rad (30 degrees), exactly, about a uniform axis.
  int starts = 64;                         ///< Of the search from a disturbed pose.
  bool auc = true;                         ///< Also the evaluator's own test, which takes the longest.
  rendering::LikelihoodChoice likelihood;  ///< Who scores poses; nothing but times depend on it.
};

struct YcbObjectScore {
  std::string frame;
  std::string object;
  int n = 0;                          ///< Runs (disturbed) or 1 (amortised).
  double share_adds_below_2cm = 0.0;  ///< Share of the runs, in [0, 1].
  double median_adds_m = 0.0;         ///< Over the runs; a miss is an infinite error.
  double median_add_m = 0.0;
  bool found = false;  ///< Amortised: under its own name, ADD-S below 2 cm.
};

struct YcbSection {
  int n = 0;                          ///< Runs of all objects.
  double share_adds_below_2cm = 0.0;  ///< Share of the runs, in [0, 1].
  double share_add_below_2cm = 0.0;   ///< The same of ADD, for which front and back are not alike.
  double median_adds_m = 0.0;
  double median_add_m = 0.0;
  double ms_per_object = 0.0;  ///< Wall time per run and object, on the given threads, ms.
  std::vector<YcbObjectScore> objects;
  int found = 0;             ///< Amortised: objects found (YcbObjectScore::found).
  int false_detections = 0;  ///< Amortised: accepted poses that are not where the object is.
};

struct YcbAucRow {
  std::string method;
  std::string object;  ///< Or "ALL".
  /// Area under the share of poses whose ADD is below a threshold, for thresholds from 0 to 10 cm, in percent of what
  /// it would be if all errors were zero (stepwise_auc, pose_auc.h).
  double add = 0.0;
  double adds = 0.0;           ///< The same of ADD-S.
  double expected_add = 0.0;   ///< What the published evaluator says of the same poses, in the same unit.
  double expected_adds = 0.0;  ///< The same of ADD-S.
};

struct YcbReport {
  YcbSection disturbed;
  YcbSection amortised;
  std::vector<YcbAucRow> auc;
};

/// `dir` is the ycb_video folder. The same seed gives the same report (times aside) for any number of threads. Fails
/// with kNotFound or kInvalidInput naming the file, kCancelled when asked to stop.
core::Result<YcbReport> evaluate_ycb_video(const std::filesystem::path& dir, std::uint64_t seed,
                                           core::ThreadPool& threads, const core::ProgressSink& progress = {},
                                           const core::Cancellation* cancellation = nullptr,
                                           const YcbOptions& options = {});

/// Its parts, for tests; errors as above.
core::Result<YcbSection> evaluate_disturbed(const std::filesystem::path& dir, std::uint64_t seed,
                                            core::ThreadPool& threads, const YcbOptions& options = {},
                                            const core::ProgressSink& progress = {},
                                            const core::Cancellation* cancellation = nullptr);
core::Result<YcbSection> evaluate_amortised(const std::filesystem::path& dir, std::uint64_t seed,
                                            core::ThreadPool& threads, const YcbOptions& options = {},
                                            const core::ProgressSink& progress = {},
                                            const core::Cancellation* cancellation = nullptr);
core::Result<std::vector<YcbAucRow>> evaluate_auc(const std::filesystem::path& dir, core::ThreadPool& threads,
                                                  const core::ProgressSink& progress = {},
                                                  const core::Cancellation* cancellation = nullptr);

/// {"disturbed": {...}, "amortised": {...}, "auc": [...]} with the keys of `disturbed` at the top level too; errors
/// that are infinite (nothing found) are null.
nlohmann::ordered_json to_json(const YcbReport& report);

}  // namespace prescene::service
