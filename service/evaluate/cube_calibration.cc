// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cube_calibration.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <sstream>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/service/calibration/forecast_scores.h"
#include "prescene/simulation/calibration/coordinate_search.h"

namespace prescene::service {
namespace {

constexpr std::size_t kLeastFlight = 8;
constexpr std::size_t kRestFrames = 5;
// Of the search's steps, each after a round without gain.
constexpr int kHalvings = 3;

/// The coordinates of the search and their way into a model.
struct Coordinate {
  const char* name;
  double CubeModel::*field;
  double step, low, high;
};
constexpr Coordinate kCoordinates[] = {
    {"sliding_friction", &CubeModel::sliding_friction, 0.008, 0.05, 0.5},
    {"impact_friction", &CubeModel::impact_friction, 0.008, 0.05, 0.5},
    {"restitution", &CubeModel::restitution, 0.02, 0.0, 0.6},
    {"unit_inertia", &CubeModel::unit_inertia, 1e-4, 1.5e-3, 4e-3},
    {"edge_radius", &CubeModel::edge_radius, 5e-4, 2e-4, 0.01},
    {"center_of_mass_z", &CubeModel::center_of_mass_z, 4e-4, -0.01, 0.01},
    {"friction_noise", &CubeModel::friction_noise, 0.02, 0.0, 0.2},
};

CubeModel with_noise(CubeModel model, double factor) {
  model.position_noise *= factor;
  model.rotation_noise *= factor;
  model.velocity_noise *= factor;
  model.spin_noise *= factor;
  return model;
}

CubeModel model_from(const CubeModel& start, std::span<const double> values) {
  CubeModel model = start;
  for (std::size_t i = 0; i < std::size(kCoordinates); ++i) model.*kCoordinates[i].field = values[i];
  return with_noise(model, values[std::size(kCoordinates)]);
}

}  // namespace

core::Result<CubeMeasurements> measure_cube(const std::vector<CubeToss>& tosses, const CubeModel& model) {
  std::vector<double> heights;
  double weight = 0.0;
  double weighted = 0.0;
  std::vector<std::pair<double, double>> estimates;
  for (const CubeToss& toss : tosses) {
    for (std::size_t i = toss.frames.size() - std::min(kRestFrames, toss.frames.size()); i < toss.frames.size(); ++i) {
      heights.push_back(toss.frames[i].X_WO.translation.z());
    }
    std::size_t flight = 0;
    const CubeOptions options;
    while (flight < toss.frames.size()) {
      const geometry::Pose& X = toss.frames[flight].X_WO;
      const double reach = model.half_edge * X.rotation.toRotationMatrix().row(2).cwiseAbs().sum();
      if (X.translation.z() - reach < options.first_contact) break;
      ++flight;
    }
    if (flight < kLeastFlight + 1) continue;
    --flight;  // the last is mixed with the first of the contact
    // z of the centre of mass = a + b s + c s^2, s centred: gravity = -2 c, and c's precision is that of the s^2 column
    // once the others are taken out of it.
    Eigen::MatrixX3d columns(static_cast<Eigen::Index>(flight), 3);
    Eigen::VectorXd z(static_cast<Eigen::Index>(flight));
    const double middle = 0.5 * (toss.frames[0].time + toss.frames[flight - 1].time);
    for (std::size_t i = 0; i < flight; ++i) {
      const double s = toss.frames[i].time - middle;
      columns.row(static_cast<Eigen::Index>(i)) << 1.0, s, s * s;
      z(static_cast<Eigen::Index>(i)) = (toss.frames[i].X_WO * geometry::Vector3d(0, 0, model.center_of_mass_z)).z();
    }
    const Eigen::Matrix3d normal = columns.transpose() * columns;
    const double c = geometry::solve_symmetric_3(normal, columns.transpose() * z)(2);
    const double precision = 1.0 / normal.inverse()(2, 2);
    weight += precision;
    weighted += precision * -2.0 * c;
    estimates.emplace_back(precision, -2.0 * c);
  }
  if (estimates.empty() || heights.empty()) {
    return core::invalid_input("no toss has eight frames before its first contact; gravity can't be measured");
  }
  CubeMeasurements result;
  result.half_edge = quantile(heights, 0.5);
  result.gravity = weighted / weight;
  double squares = 0.0;
  for (const auto& [precision, g] : estimates) squares += std::pow(precision * (g - result.gravity), 2);
  result.gravity_standard_error = std::sqrt(squares) / weight;
  return result;
}

double calibration_cost(const std::vector<CubeForecast>& forecasts) {
  double cost = 0.0;
  for (const CubeForecast& f : forecasts) {
    cost += brier_score(f.face_probabilities, f.true_face) + kPlaceWeight * f.energy_score;
  }
  return cost / static_cast<double>(forecasts.size());
}

namespace {

/// The factor on the model's noise with which regions of 90 % hold that many of the tosses; 2 at most.
core::Result<double> widening(const std::vector<CubeToss>& tosses, const CubeModel& model, std::uint64_t seed,
                              core::ThreadPool& threads, const core::Cancellation* cancellation) {
  constexpr double kStep = 1.1, kWidest = 2.0, kHeld = 0.9;
  double factor = 1.0;
  for (; factor < kWidest; factor *= kStep) {
    PRESCENE_TRY(auto forecasts,
                 forecast_cube_tosses(tosses, with_noise(model, factor), seed, threads, {}, cancellation));
    if (report_of(std::move(forecasts)).coverage_90 >= kHeld) break;
  }
  return factor;
}

}  // namespace

core::Result<CubeCalibration> calibrate_cube(const std::vector<CubeToss>& tosses, CubeModel start, std::uint64_t seed,
                                             core::ThreadPool& threads, const core::ProgressSink& progress,
                                             const core::Cancellation* cancellation,
                                             const CalibrationOptions& options) {
  PRESCENE_TRY(const CubeMeasurements measured, measure_cube(tosses, start));
  start.half_edge = measured.half_edge;
  start.gravity = measured.gravity;
  CubeOptions forecast_options;
  forecast_options.samples = options.samples;
  std::vector<simulation::SearchParameter> parameters;
  for (const Coordinate& c : kCoordinates) parameters.push_back({c.name, start.*c.field, c.step, c.low, c.high});
  parameters.push_back({"noise", 1.0, 0.2, 0.02, 5.0});

  core::Status failure;
  CubeCalibration result;
  const auto cost = [&](std::span<const double> values) {
    const auto forecasts =
        forecast_cube_tosses(tosses, model_from(start, values), seed, threads, {}, cancellation, forecast_options);
    if (forecasts) return calibration_cost(*forecasts);
    failure = forecasts.status();
    return std::numeric_limits<double>::infinity();
  };
  const auto report = [&](const simulation::SearchResult& best) {
    if (!failure.ok()) return false;
    if (best.evaluations == 1) result.start_cost = best.cost;
    if (progress) {
      std::ostringstream text;
      text << "cost " << best.cost << " after " << best.evaluations << " evaluations";
      progress({static_cast<double>(best.evaluations) / options.max_evaluations, std::nullopt, text.str()});
    }
    return true;
  };
  const simulation::SearchResult found =
      simulation::coordinate_search(parameters, cost, kHalvings, options.max_evaluations, report);
  result.stopped = failure.code() == core::StatusCode::kCancelled;
  if (!failure.ok() && !(result.stopped && found.evaluations > 1)) return failure;
  result.model = model_from(start, found.values);
  result.cost = found.cost;
  result.evaluations = found.evaluations;
  if (!result.stopped) {
    const auto widened = widening(tosses, result.model, seed, threads, cancellation);
    result.stopped = widened.status().code() == core::StatusCode::kCancelled;
    if (!widened && !result.stopped) return widened.status();
    if (widened) result.widened = *widened;
    result.model = with_noise(result.model, result.widened);
  }
  return result;
}

}  // namespace prescene::service
