// SPDX-License-Identifier: Apache-2.0
// How well real tosses of a cube are forecast: which face ends up, and where.
//
//   PRESCENE_TRY(CubeReport report, evaluate_cube_tosses(dir, CubeSplit::kReport, seed, threads, progress));
//   ... report.right_face_share
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/service/evaluate/cube_data.h"
#include "prescene/service/evaluate/cube_model.h"

namespace prescene::service {

struct CubeOptions {
  int samples = 64;              ///< Simulated starts a toss.
  int most_frames = 10;          ///< Of the fit.
  double first_contact = 0.006;  ///< m: frames from the first with a corner lower than this are not looked at.
};

/// What was forecast for a toss, and what came.
struct CubeForecast {
  int number = 0;
  std::array<double, 6> face_probabilities{};  ///< +x, -x, +y, -y, +z, -z
  int true_face = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< Median of the samples that show the likeliest face, m.
  Eigen::Vector2d true_place = Eigen::Vector2d::Zero();
  double energy_score = 0.0;  ///< Of the place, m.
  double region_mass = 0.0;   ///< Of the highest-density region that just holds the true place.
};

struct CubeReport {
  int n = 0;
  double right_face_share = 0.0;  ///< The likeliest face was up.
  double brier = 0.0;             ///< Mean over tosses.
  double log_score = 0.0;         ///< Mean natural logarithm, of at least 1e-3.
  double median_xy_error_m = 0.0;
  double p90_xy_error_m = 0.0;
  double coverage_50 = 0.0;  ///< Share of tosses that ended inside their region of mass 0.5.
  double coverage_90 = 0.0;
  std::vector<CubeForecast> forecasts;
};

/// The state of a toss just before its first contact, from at most `most_frames` frames before it. The last frame above
/// `first_contact` is left out, because the tracker's median over three samples mixes it with the next.
core::Result<simulation::BallisticState> start_of_toss(const CubeToss& toss, const CubeModel& model,
                                                       const CubeOptions& options = {});

/// Forecasts of all `tosses`; the same bits for any number of threads.
core::Result<std::vector<CubeForecast>> forecast_cube_tosses(const std::vector<CubeToss>& tosses,
                                                             const CubeModel& model, std::uint64_t seed,
                                                             core::ThreadPool& threads,
                                                             const core::ProgressSink& progress = {},
                                                             const core::Cancellation* cancellation = nullptr,
                                                             const CubeOptions& options = {});
/// Not empty.
CubeReport report_of(std::vector<CubeForecast> forecasts);

/// `dir` is the cube_tosses folder; `model` defaults to the shipped one. Fails with kNotFound or kInvalidInput naming
/// the file, kCancelled when asked to stop.
core::Result<CubeReport> evaluate_cube_tosses(const std::filesystem::path& dir, CubeSplit split, std::uint64_t seed,
                                              core::ThreadPool& threads, const core::ProgressSink& progress = {},
                                              const core::Cancellation* cancellation = nullptr,
                                              const std::optional<CubeModel>& model = std::nullopt,
                                              const CubeOptions& options = {});

/// {"n", "right_face_share", "brier", "log_score", "median_xy_error_m", "p90_xy_error_m", "coverage_50", "coverage_90"}
nlohmann::ordered_json to_json(const CubeReport& report);

}  // namespace prescene::service
