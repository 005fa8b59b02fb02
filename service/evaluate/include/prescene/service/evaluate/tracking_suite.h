// SPDX-License-Identifier: Apache-2.0
// How well the tracker does where the truth is known: simulated sequences of everyday situations, tracked as recordings
// are, and real frames of a cube in a robot's hand.
//
//   PRESCENE_TRY(TrackingReport report, evaluate_tracking(dir, {}, seed, threads, sink, nullptr));
//   ... report.simulated.wrong
#pragma once

#include <array>
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

/// An estimate is right if it is within 2 cm and, up to the model's symmetry, 15 degrees of the truth.
inline constexpr double kRightPosition = 0.02;  // m
inline constexpr double kRightTurn = 0.2618;    // rad

/// Over the frames of some sequences. Shares are NaN where there is nothing to divide by.
struct TrackingFigures {
  int sequences = 0;
  int frames = 0;          ///< Steps of the tracker.
  int visible = 0;         ///< Estimates of objects of which at least half is seen; the counts below are of these ...
  int tracked = 0;         ///< ... in state tracked.
  int believed = 0;        ///< Estimates in state tracked, whatever is seen of the object ...
  int wrong = 0;           ///< ... that are not right, or of an object that is not there, ...
  int surely_wrong = 0;    ///< ... and of these, those with a confidence of at least 0.9.
  int hidden = 0;          ///< Estimates, not lost, of objects that are there and of which less than 10 % is seen, ...
  int hidden_covered = 0;  ///< ... whose 90 % ellipsoid of the position holds the truth.
  int sure = 0;            ///< Estimates with a confidence of at least 0.99, ...
  int sure_right = 0;      ///< ... and those of them that are right.
  /// By confidence in ten equal bins: how many, and how many right.
  std::array<int, 10> by_confidence{};
  std::array<int, 10> right_by_confidence{};
  double cpu_seconds = 0.0;             ///< Of replaying, all of it.
  std::vector<double> position_errors;  ///< m, of those that are visible and tracked.
  std::vector<double> turn_errors;      ///< rad
  std::vector<double> still_shifts;  ///< m, how far the estimate moves in a frame in which the visible object does not.
  std::vector<double> still_turns;   ///< rad

  void add(const TrackingFigures& more);
};

struct TrackingRow {
  std::string kind;  ///< As suite_kinds(), or "carried_cube".
  TrackingFigures figures;
};

struct TrackingOptions {
  int sequences = 5;               ///< Of each kind.
  std::vector<std::string> kinds;  ///< Of suite_kinds(), or "carried_cube"; empty = all.
  double rate = 30.0;              ///< Frames a second.
  /// Folder for the recordings and scene files, where whole ones of the same scene, seed and rate are used again, and
  /// others replaced; empty = they are removed.
  std::filesystem::path keep;
  rendering::LikelihoodChoice likelihood;
};

struct TrackingReport {
  std::uint64_t seed = 0;  ///< Of the first sequence of each kind.
  double rate = 0.0;       ///< Simulated frames a second.
  std::vector<TrackingRow> rows;
  TrackingFigures simulated;  ///< The sum over simulated kinds.
};

/// `data`: folder that holds carried_cube; empty = simulated sequences only. Sequence k of a kind has seed `seed` + k,
/// for the scene, the camera's noise and the tracker. The camera's noise differs from what the tracker assumes
/// (suite_camera). Errors of files (of `data` before anything is simulated); kInvalidInput for kinds that are none, and
/// for "carried_cube" without `data`.
core::Result<TrackingReport> evaluate_tracking(const std::filesystem::path& data, const TrackingOptions& options,
                                               std::uint64_t seed, core::ThreadPool& threads,
                                               const core::ProgressSink& progress,
                                               const core::Cancellation* cancellation);
nlohmann::ordered_json to_json(const TrackingReport& report);
/// One row a kind, for people.
std::vector<std::vector<std::string>> table_of(const TrackingReport& report);

}  // namespace prescene::service
