// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cube_tosses.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/service/calibration/forecast_scores.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::service {
namespace {

using geometry::Vector3d;

constexpr int kFaces = 6;
// Uniforms of a start: position, rotation, velocity, spin, friction, restitution.
constexpr int kDimensions = 14;
// Frames at the end whose mean is the true place.
constexpr std::size_t kLastFrames = 5;
constexpr double kLongest = 5.0;  // s; every toss lies still after two

double lowest_corner(const geometry::Pose& X_WO, double half_edge) {
  return X_WO.translation.z() - half_edge * X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().sum();
}

belief::WorldState perturbed_start(const belief::WorldState& mean, const CubeModel& model,
                                   std::span<const double> uniforms) {
  std::array<double, kDimensions> z;
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = core::inverse_normal_cdf(uniforms[i]);
  belief::WorldState start = mean;
  belief::ObjectState& cube = start.objects[0];
  cube.X_WO.translation += model.position_noise * Vector3d(z[0], z[1], z[2]);
  cube.X_WO.rotation = cube.X_WO.rotation * geometry::exp_rotation(model.rotation_noise * Vector3d(z[3], z[4], z[5]));
  cube.V_WO.linear += model.velocity_noise * Vector3d(z[6], z[7], z[8]);
  cube.V_WO.angular += model.spin_noise * Vector3d(z[9], z[10], z[11]);
  const double friction = std::exp(model.friction_noise * z[12]);
  cube.physical.friction *= friction;
  cube.physical.impact_friction *= friction;
  cube.physical.restitution = std::clamp(cube.physical.restitution + model.restitution_noise * z[13], 0.0, 1.0);
  return start;
}

CubeForecast make_forecast(const CubeToss& toss, const std::vector<belief::Trajectory>& runs, const CubeModel& model) {
  CubeForecast forecast;
  forecast.number = toss.number;
  forecast.true_face = geometry::face_up(toss.frames.back().X_WO.rotation);
  const std::size_t last = std::min(kLastFrames, toss.frames.size());
  for (std::size_t i = toss.frames.size() - last; i < toss.frames.size(); ++i) {
    forecast.true_place += toss.frames[i].X_WO.translation.head<2>() / static_cast<double>(last);
  }
  std::array<int, kFaces> counts{};
  std::vector<int> faces;
  std::vector<Eigen::Vector2d> places;
  for (const belief::Trajectory& run : runs) {
    const geometry::Pose& X_WO = run.final().objects[0].X_WO;
    faces.push_back(geometry::face_up(X_WO.rotation));
    places.emplace_back(X_WO.translation.head<2>());
    ++counts[static_cast<std::size_t>(faces.back())];
  }
  const std::vector<double> probabilities = probabilities_of(counts);
  std::copy(probabilities.begin(), probabilities.end(), forecast.face_probabilities.begin());
  const int mode = mode_of(probabilities);
  std::vector<double> x;
  std::vector<double> y;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (faces[i] != mode) continue;
    x.push_back(places[i].x());
    y.push_back(places[i].y());
  }
  forecast.place = {quantile(x, 0.5), quantile(y, 0.5)};
  forecast.energy_score = energy_score(places, forecast.true_place);
  forecast.region_mass =
      region_mass(density_of(places, faces, model.kernel_scale, model.kernel_floor), forecast.true_place);
  return forecast;
}

}  // namespace

core::Result<simulation::BallisticState> start_of_toss(const CubeToss& toss, const CubeModel& model,
                                                       const CubeOptions& options) {
  std::size_t contact = 0;
  while (contact < toss.frames.size() &&
         lowest_corner(toss.frames[contact].X_WO, model.half_edge) >= options.first_contact) {
    ++contact;
  }
  // Three frames at least, even of a toss that starts at the board.
  const std::size_t end = std::max<std::size_t>(3, contact > 0 ? contact - 1 : 0);
  if (end > toss.frames.size()) return core::invalid_input("toss " + std::to_string(toss.number) + " is too short");
  const std::size_t count = std::min(end, static_cast<std::size_t>(options.most_frames));
  auto fit = simulation::fit_ballistic(std::span(toss.frames).subspan(end - count, count),
                                       {0.0, 0.0, model.center_of_mass_z}, {0.0, 0.0, -model.gravity});
  if (!fit) return fit.status().at("toss " + std::to_string(toss.number));
  return fit;
}

core::Result<std::vector<CubeForecast>> forecast_cube_tosses(
    const std::vector<CubeToss>& tosses, const CubeModel& model, std::uint64_t seed, core::ThreadPool& threads,
    const core::ProgressSink& progress, const core::Cancellation* cancellation, const CubeOptions& options) {
  const belief::Scene scene = make_cube_scene(model);
  simulation::ShapeStore shapes;
  PRESCENE_TRY(const auto simulator, simulation::make_lockstep_simulator(
                                         scene, shapes, simulation::LockstepOptions{make_cube_options(model)}));
  simulation::RunRequest request;
  request.stop.duration = kLongest;
  const core::RandomStream stream(seed, core::Purpose::kEvaluation);

  std::vector<CubeForecast> forecasts;
  std::vector<double> uniforms(kDimensions);
  for (std::size_t i = 0; i < tosses.size(); ++i) {
    PRESCENE_TRY(const simulation::BallisticState fit, start_of_toss(tosses[i], model, options));
    belief::WorldState mean = belief::mean_start(scene);
    mean.objects[0].X_WO = fit.X_WO;
    mean.objects[0].V_WO = fit.V_WO;
    core::RandomStream toss_stream = stream.at(static_cast<std::uint64_t>(tosses[i].number));
    const core::SobolNet net(kDimensions, toss_stream.next_u64());
    std::vector<belief::WorldState> starts;
    for (int k = 0; k < options.samples; ++k) {
      net.point(static_cast<std::uint64_t>(k), uniforms);
      starts.push_back(perturbed_start(mean, model, uniforms));
    }
    std::vector<belief::Trajectory> runs(starts.size());
    simulator->run(starts, request, toss_stream, 0, threads, runs, cancellation);
    if (cancellation && cancellation->requested())
      return core::cancelled("stopped after " + std::to_string(i) + " tosses");
    forecasts.push_back(make_forecast(tosses[i], runs, model));
    if (progress) {
      const double fraction = static_cast<double>(i + 1) / static_cast<double>(tosses.size());
      progress({fraction, std::nullopt, std::to_string(i + 1) + " of " + std::to_string(tosses.size()) + " tosses"});
    }
  }
  return forecasts;
}

CubeReport report_of(std::vector<CubeForecast> forecasts) {
  CubeReport report;
  report.n = static_cast<int>(forecasts.size());
  std::vector<double> errors;
  for (const CubeForecast& f : forecasts) {
    const double share = 1.0 / report.n;
    if (mode_of(f.face_probabilities) == f.true_face) report.right_face_share += share;
    report.brier += share * brier_score(f.face_probabilities, f.true_face);
    report.log_score += share * log_score(f.face_probabilities, f.true_face);
    if (f.region_mass < 0.5) report.coverage_50 += share;
    if (f.region_mass < 0.9) report.coverage_90 += share;
    errors.push_back((f.place - f.true_place).norm());
  }
  report.median_xy_error_m = quantile(errors, 0.5);
  report.p90_xy_error_m = quantile(errors, 0.9);
  report.forecasts = std::move(forecasts);
  return report;
}

core::Result<CubeReport> evaluate_cube_tosses(const std::filesystem::path& dir, CubeSplit split, std::uint64_t seed,
                                              core::ThreadPool& threads, const core::ProgressSink& progress,
                                              const core::Cancellation* cancellation,
                                              const std::optional<CubeModel>& model, const CubeOptions& options) {
  PRESCENE_TRY(const std::vector<CubeToss> all, read_cube_tosses(dir));
  const std::vector<CubeToss> tosses = select(all, split);
  if (tosses.empty()) return core::invalid_input(dir.string() + ": too few tosses for this split");
  PRESCENE_TRY(std::vector<CubeForecast> forecasts,
               forecast_cube_tosses(tosses, model.value_or(shipped_cube_model()), seed, threads, progress, cancellation,
                                    options));
  return report_of(std::move(forecasts));
}

nlohmann::ordered_json to_json(const CubeReport& report) {
  return {{"n", report.n},
          {"right_face_share", report.right_face_share},
          {"brier", report.brier},
          {"log_score", report.log_score},
          {"median_xy_error_m", report.median_xy_error_m},
          {"p90_xy_error_m", report.p90_xy_error_m},
          {"coverage_50", report.coverage_50},
          {"coverage_90", report.coverage_90}};
}

}  // namespace prescene::service
