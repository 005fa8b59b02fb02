// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cleargrasp.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "prescene/filter/proposals/segmentation.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/rendering/sensor/local_surface.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;

constexpr double kClearGraspUnit = 1e-4;  // of the depth images

/// The painted twin without what is not of the mask.
geometry::DepthImage painted_objects(const ClearGraspFrame& frame) {
  geometry::DepthImage depth = frame.painted;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      if (frame.mask(x, y) == 0) depth(x, y) = 0.0f;
  return depth;
}

/// Distances to the nearest pixel that is not of the mask.
geometry::Image<float> distance_to_outline(const geometry::LabelImage& mask) {
  geometry::Image<std::uint8_t> outside(mask.width(), mask.height());
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x) outside(x, y) = mask(x, y) == 0 ? 1 : 0;
  return rendering::distance_to_marked(outside);
}

void add(double log_ratio, ClearGraspShare* share) {
  ++share->n;
  share->transparent_better += log_ratio > 0.0 ? 1 : 0;
  share->log_ratio += log_ratio;
}

void add(const ClearGraspShare& more, ClearGraspShare* share) {
  share->n += more.n;
  share->transparent_better += more.transparent_better;
  share->log_ratio += more.log_ratio;
}

/// What a measurement says for the transparent material against the opaque one.
class Comparison {
 public:
  Comparison(const rendering::SensorModel& model, const rendering::PixelGeometry& pixel,
             const rendering::AbsentMixture& absent)
      : model_(model),
        absent_(absent),
        transparent_(model.mixture(rendering::SurfaceMaterial::transparent(), pixel)),
        opaque_(model.mixture(rendering::SurfaceMaterial::opaque(), pixel)) {
    // Both are compared with the same.
    if (absent_.missing < 0.0) absent_.missing = opaque_.missing;
  }

  double operator()(double z) const {
    const rendering::SensorModelOptions& options = model_.options();
    const double cut = z > 0.0 ? std::clamp(z, options.min_depth, options.max_depth) : 0.0;
    return model_.log_ratio(transparent_, cut, absent_) - model_.log_ratio(opaque_, cut, absent_);
  }
  double sigma() const { return opaque_.sigma; }

 private:
  const rendering::SensorModel& model_;
  rendering::AbsentMixture absent_;
  rendering::PixelMixture transparent_;
  rendering::PixelMixture opaque_;
};

/// What is known of the background of each pixel: the plane that most of the frame lies on.
std::optional<rendering::FrameTerms> background(const ClearGraspFrame& frame, const rendering::SensorModel& model,
                                                std::uint64_t seed) {
  const filter::SegmentationOptions segmentation;
  const auto plane = filter::find_support_plane(filter::sample_depth(frame.transparent, frame.camera, segmentation),
                                                segmentation, core::RandomStream(seed, core::Purpose::kDetection));
  if (!plane) return std::nullopt;
  rendering::FrameTermsInput input;
  input.camera = frame.camera;
  input.depth = frame.transparent.view();
  input.supports = std::span(&plane->region, 1);
  rendering::FrameTermsOptions options;
  options.target_width = frame.camera.width;  // every pixel
  rendering::FrameTerms terms;
  if (!make_frame_terms(input, options, model, &terms).ok()) return std::nullopt;
  return terms;
}

core::Result<ClearGraspFrame> read_cleargrasp_frame(const fs::path& folder) {
  ClearGraspFrame frame;
  frame.name = folder.filename().string();
  PRESCENE_TRY(frame.transparent, interfaces::read_png_depth(folder / "depth_transparent.png", kClearGraspUnit));
  PRESCENE_TRY(frame.painted, interfaces::read_png_depth(folder / "depth_opaque.png", kClearGraspUnit));
  PRESCENE_TRY(frame.mask, interfaces::read_png_label(folder / "mask.png"));
  for (const auto& [width, height] :
       {std::pair{frame.painted.width(), frame.painted.height()}, {frame.mask.width(), frame.mask.height()}})
    if (width != frame.transparent.width() || height != frame.transparent.height())
      return core::invalid_input(folder.string() +
                                 ": depth_transparent.png, depth_opaque.png and mask.png differ in size");
  // The data set's camera, the same in all of its frames.
  frame.camera = {frame.mask.width(), frame.mask.height(), 921.0, 921.0, 642.0, 359.0};
  return frame;
}

nlohmann::ordered_json share_json(const ClearGraspShare& share) {
  return {{"n", share.n}, {"transparent_better", share.share()}, {"nats_per_pixel", share.nats_per_pixel()}};
}

nlohmann::ordered_json score_json(const ClearGraspScore& score) {
  return {{"frame", score.frame},
          {"mask_pixels", score.mask_pixels},
          {"knows_plane", score.knows_plane},
          {"all", share_json(score.all)},
          {"missing", share_json(score.missing)},
          {"behind", share_json(score.behind)},
          {"at_surface", share_json(score.at_surface)},
          {"in_front", share_json(score.in_front)},
          {"painted", share_json(score.painted)}};
}

}  // namespace

core::Result<std::vector<ClearGraspFrame>> read_cleargrasp_frames(const fs::path& dir) {
  std::error_code error;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(dir, error))
    if (fs::exists(entry.path() / "depth_transparent.png", error)) folders.push_back(entry.path());
  if (folders.empty())
    return core::not_found(dir.string() + ": no frame folders with depth_transparent.png there: --data must name the " +
                           "folder that holds cleargrasp");
  std::sort(folders.begin(), folders.end());
  std::vector<ClearGraspFrame> frames;
  for (const fs::path& folder : folders) {
    PRESCENE_TRY(ClearGraspFrame frame, read_cleargrasp_frame(folder));
    frames.push_back(std::move(frame));
  }
  return frames;
}

ClearGraspScore score_cleargrasp(const ClearGraspFrame& frame, const rendering::SensorModel& model,
                                 std::uint64_t seed) {
  ClearGraspScore score;
  score.frame = frame.name;
  const std::optional<rendering::FrameTerms> terms = background(frame, model, seed);
  score.knows_plane = terms.has_value();
  const geometry::Image<float> outline = distance_to_outline(frame.mask);
  const geometry::DepthImage objects = painted_objects(frame);
  for (int y = 0; y < frame.mask.height(); ++y) {
    for (int x = 0; x < frame.mask.width(); ++x) {
      if (frame.mask(x, y) == 0) continue;
      ++score.mask_pixels;
      const std::optional<rendering::LocalSurface> surface = rendering::local_surface(objects, frame.camera, x, y);
      if (!surface || surface->depth <= model.options().min_depth || surface->depth >= model.options().max_depth)
        continue;
      rendering::AbsentMixture absent;
      if (terms && terms->absent_peak(x, y) > 0.0f)
        absent = {static_cast<double>(terms->absent_peak(x, y)), model.options().support_sigma,
                  model.options().support_weight, -1.0};
      const Comparison comparison(model, {surface->depth, surface->cosine, static_cast<double>(outline(x, y))}, absent);
      const double z = frame.transparent(x, y);
      const double log_ratio = comparison(z);
      const double deviation = (z - surface->depth) / comparison.sigma();
      ClearGraspShare& kind = z == 0.0           ? score.missing
                              : deviation > 3.0  ? score.behind
                              : deviation < -3.0 ? score.in_front
                                                 : score.at_surface;
      add(log_ratio, &kind);
      add(log_ratio, &score.all);
      add(comparison(frame.painted(x, y)), &score.painted);
    }
  }
  return score;
}

core::Result<ClearGraspReport> evaluate_cleargrasp(const fs::path& dir, std::uint64_t seed,
                                                   const core::ProgressSink& progress,
                                                   const core::Cancellation* cancellation) {
  PRESCENE_TRY(const std::vector<ClearGraspFrame> frames, read_cleargrasp_frames(dir));
  const rendering::SensorModel model;
  ClearGraspReport report;
  report.total.frame = "all";
  report.total.knows_plane = true;
  for (const ClearGraspFrame& frame : frames) {
    if (cancellation != nullptr && cancellation->requested()) return core::cancelled("stopped on request");
    const ClearGraspScore score = score_cleargrasp(frame, model, seed);
    report.total.mask_pixels += score.mask_pixels;
    report.total.knows_plane = report.total.knows_plane && score.knows_plane;
    for (const auto part : {&ClearGraspScore::all, &ClearGraspScore::missing, &ClearGraspScore::behind,
                            &ClearGraspScore::at_surface, &ClearGraspScore::in_front, &ClearGraspScore::painted})
      add(score.*part, &(report.total.*part));
    report.frames.push_back(score);
    if (progress)
      progress(
          {static_cast<double>(report.frames.size()) / static_cast<double>(frames.size()), std::nullopt, frame.name});
  }
  return report;
}

nlohmann::ordered_json to_json(const ClearGraspReport& report) {
  nlohmann::ordered_json json = score_json(report.total);
  json["frames"] = nlohmann::ordered_json::array();
  for (const ClearGraspScore& score : report.frames) json["frames"].push_back(score_json(score));
  return json;
}

}  // namespace prescene::service
