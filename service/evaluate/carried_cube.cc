// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/carried_cube.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "cells.h"
#include "prescene/core/clock.h"
#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/geometry/sampling.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/jpeg.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/service/evaluate/tracking_counter.h"
#include "prescene/service/load_scene.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;
using geometry::Pose;

constexpr double kMetresPerDepthUnit = 0.001;
constexpr double kFramesPerSecond = 30.0;  // likely: the stamps are unknown
constexpr std::size_t kMostTextBytes = 1 << 20;
constexpr const char* kObject = "cube";

struct TrueFrame {
  std::string number;  ///< "0225"
  Pose X_CO;
};

/// All cells of a line, empty ones too.
std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(separator, begin), line.size());
    cells.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
  return cells;
}

core::Result<std::string> read_text(const fs::path& file) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(file, kMostTextBytes));
  return std::string(bytes.begin(), bytes.end());
}

/// frame, stamp, tx, ty, tz, qw, qx, qy, qz, ...
core::Result<std::vector<TrueFrame>> read_truth(const fs::path& file) {
  PRESCENE_TRY(const std::string text, read_text(file));
  std::vector<TrueFrame> frames;
  std::size_t number = 0;
  for (const std::string_view line : cells_of(text, '\n')) {
    if (++number == 1 || line.empty()) continue;
    const auto cells = cells_of(line, ',');
    double v[7];
    bool good = cells.size() >= 9 && !cells[0].empty() && cells[0].size() <= 4;
    for (std::size_t i = 0; good && i < 7; ++i) good = parse_cell(cells[2 + i], &v[i]);
    if (!good)
      return core::invalid_input(file.string() + ", line " + std::to_string(number) +
                                 ": expected a frame, its stamp, a translation and a quaternion");
    Pose X_CO;
    X_CO.translation = {v[0], v[1], v[2]};
    X_CO.rotation = geometry::Quaterniond(v[3], v[4], v[5], v[6]).normalized();
    frames.push_back({std::string(4 - cells[0].size(), '0') + std::string(cells[0]), X_CO});
  }
  if (frames.empty()) return core::data_loss(file.string() + ": no frames");
  return frames;
}

core::Result<geometry::PinholeCamera> read_camera(const fs::path& file, int width, int height) {
  PRESCENE_TRY(const std::string text, read_text(file));
  std::vector<double> values;
  for (const std::string_view line : cells_of(text, '\n'))
    for (const std::string_view cell : cells_of(line, ' ')) {
      double value = 0.0;
      if (cell.empty() || cell == "\r") continue;
      if (!parse_cell(cell, &value)) return core::invalid_input(file.string() + ": expected a matrix of 3 x 3 numbers");
      values.push_back(value);
    }
  if (values.size() != 9) return core::invalid_input(file.string() + ": expected a matrix of 3 x 3 numbers");
  return geometry::PinholeCamera{width, height, values[0], values[4], values[2], values[5]};
}

std::string digits(double value) { return core::fixed_text(value, 6); }

/// The world's frame is the camera's, which is taken to look down at 45 degrees.
std::string scene_text(const Pose& X_WO) {
  const auto& p = X_WO.translation;
  const auto& q = X_WO.rotation;
  return "name: carried_cube\n"
         "models:\n"
         "  cube:\n"
         "    mesh: {file: cube_caps.ply, use: convex_hull}\n"
         "    visual: {file: cube.ply}\n"
         "    mass: 0.37\n"
         "    symmetry: cube\n"
         "objects:\n"
         "  cube:\n"
         "    model: cube\n"
         "    pose:\n"
         "      position: [" +
         digits(p.x()) + ", " + digits(p.y()) + ", " + digits(p.z()) +
         "]\n"
         "      rotation: {quaternion_wxyz: [" +
         digits(q.w()) + ", " + digits(q.x()) + ", " + digits(q.y()) + ", " + digits(q.z()) +
         "]}\n"
         "      normal: {position: 0.01, rotation_deg: 5}\n";
}

}  // namespace

core::Status check_carried_cube(const fs::path& folder) { return read_truth(folder / "truth.csv").status(); }

core::Result<TrackingFigures> track_carried_cube(const fs::path& folder, std::uint64_t seed, Backends& backends,
                                                 const core::Cancellation& cancellation) {
  PRESCENE_TRY(const std::vector<TrueFrame> frames, read_truth(folder / "truth.csv"));
  core::RandomStream draws(seed, core::Purpose::kEvaluation);
  Pose start = frames.front().X_CO;
  start.translation += 0.01 * geometry::uniform_direction(draws);
  start.rotation =
      start.rotation * geometry::exp_rotation(5.0 * std::numbers::pi / 180.0 * geometry::uniform_direction(draws));
  PRESCENE_TRY(const auto loaded, load_scene_text(scene_text(start), folder / "scene.yaml", {}));
  auto scene = std::make_shared<belief::Scene>(*loaded);
  scene->gravity_W = unknown_scene(folder, Pose::identity())->gravity_W;

  PRESCENE_TRY(const auto likelihood, backends.make_likelihood());
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  filter::ParticleFilter filter(*likelihood, *renderer, backends.pool(), {}, backends.simulator_factory());
  TrackingCounter counter(scene);
  belief::Belief belief = filter.start(scene, seed);
  double cpu_seconds = 0.0;
  geometry::PinholeCamera camera;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (cancellation.requested()) return core::cancelled("stopped on request");
    belief::Observation observation;
    observation.stamp_ns = core::ns_of(1.0 + static_cast<double>(i) / kFramesPerSecond);
    PRESCENE_TRY(auto depth,
                 interfaces::read_png_depth(folder / "depth" / (frames[i].number + ".png"), kMetresPerDepthUnit));
    PRESCENE_TRY(auto color, interfaces::read_color(folder / "color" / (frames[i].number + ".jpg")));
    if (i == 0) {
      PRESCENE_TRY(camera, read_camera(folder / "cam_K.txt", depth.width(), depth.height()));
    }
    observation.frame.camera = camera;
    observation.frame.depth = std::make_shared<const geometry::DepthImage>(std::move(depth));
    observation.frame.color = std::make_shared<const geometry::ColorImage>(std::move(color));
    observation.X_WC = Pose::identity();
    const double begin = core::process_cpu_seconds();
    filter::StepResult step = filter.step(belief, observation, {});
    cpu_seconds += core::process_cpu_seconds() - begin;
    PRESCENE_RETURN_IF_ERROR(step.frame_status.at("frame " + frames[i].number));
    belief = std::move(step.belief);
    counter.add(summary_of(belief));
    counter.add(TruthRecord{observation.stamp_ns, {{kObject, frames[i].X_CO, 1.0}}});
  }
  TrackingFigures figures = counter.figures();
  figures.cpu_seconds = cpu_seconds;
  return figures;
}

}  // namespace prescene::service
