// SPDX-License-Identifier: Apache-2.0
// How good forecasts of recorded motions are: which side is up at rest, and where the object lies.
//
//   const ScoredToss toss = score_toss(motion, rest, forecast, gyration);
//   const TossScores scores = scores_of(tosses, stream);
//   ... scores.brier.value, scores.brier.standard_error
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/simulation/calibration/motion_forecast.h"
#include "prescene/simulation/calibration/recording_checks.h"

namespace prescene::service {

/// Half axes of the object's frame, of which the one nearest to the vertical is the side that is up
/// (geometry::face_up).
inline constexpr std::array<const char*, 6> kSides = {"+x", "-x", "+y", "-y", "+z", "-z"};

/// What was forecast of one recording, and what came.
struct ScoredToss {
  std::string name;
  std::size_t group = 0;                       ///< Tosses of the same number are twins.
  int fold = -1;                               ///< -1: of no fold.
  std::array<double, 6> side_probabilities{};  ///< In the order of kSides.
  std::size_t true_side = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  ///< m, in W: median of the samples with the likeliest side.
  Eigen::Vector2d true_place = Eigen::Vector2d::Zero();
  double region_mass = 0.0;  ///< Of the densest region that just holds the true place: see service::region_mass().
  double brier = 0.0;
  double log_score = 0.0;
  double rest_time = 0.0;  ///< s after the recording's first frame.
  int moving = 0;          ///< Of the samples: see simulation::MotionForecast.
  int lost = 0;

  double error() const { return (place - true_place).norm(); }  ///< m
};
/// `radius_of_gyration`, m: sizes the kernels of the place's density. Needs one end at least in the forecast.
ScoredToss score_toss(const simulation::RecordedMotion& motion, const simulation::RecordedRest& rest,
                      const simulation::MotionForecast& forecast, double radius_of_gyration);

struct ScoreValue {
  double value = 0.0;
  double standard_error = 0.0;  ///< Over tosses, twins counted as one.
};
struct CoverageValue {
  double level = 0.0;
  ScoreValue held;  ///< Share of tosses that ended inside their region of that mass.
};
/// Of all probabilities of a side within [low, high): a forecast that means what it says has mean == observed.
struct ReliabilityRow {
  double low = 0.0;
  double high = 0.0;
  int n = 0;
  double mean = 0.0;
  double observed = 0.0;
};
struct TossScores {
  int n = 0;
  int independent = 0;  ///< Twins counted as one.
  ScoreValue right_side;
  ScoreValue brier;
  ScoreValue log_score;
  ScoreValue median_error;                  ///< m
  ScoreValue p90_error;                     ///< m
  std::array<ScoreValue, 2> mean_error{};   ///< m, true less forecast, along x and y of W.
  std::array<CoverageValue, 4> coverage{};  ///< 50, 80, 90 and 95 %.
  std::vector<ReliabilityRow> reliability;  ///< Rows that nothing falls into are left out.
};
/// Errors of shares and means from sums over groups of twins, those of quantiles by resampling groups [Efron 1979].
/// `tosses` is not empty.
TossScores scores_of(std::span<const ScoredToss> tosses, core::RandomStream stream);

/// One key a member; lengths in metres.
nlohmann::ordered_json to_json(const TossScores& scores);
nlohmann::ordered_json to_json(const ScoredToss& toss);

}  // namespace prescene::service
