// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/learn_colors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "prescene/filter/operators/track_state.h"
#include "prescene/filter/proposals/learned_colors.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::filter {
namespace {

constexpr double kLeastConfidence = 0.9;  // belief::ObjectEstimate::confidence from which a frame is learned from
constexpr double kLeastMatching = 0.8;    // share of the visible pixels that must match
constexpr int kFewestColorPixels = 12;    // inside the outline
constexpr int kColorWidth = 160;          // the image is sampled every round(width / this) pixels
// Mean nats of an object's pixels by the colours learned so far: less, and it may well be another thing of its shape.
constexpr double kLeastColorEvidence = -0.5;

/// The colours of one frame at its sampled pixels.
struct SampledView {
  geometry::PinholeCamera camera;
  int step = 1;
  int offset = 0;
  rendering::RenderedView rendered;
  std::vector<std::size_t> label_of_object;  ///< 0 = not drawn.
};

/// What is believed to be in view.
core::Status render_belief(const FilterFrame& frame, const geometry::PinholeCamera& full, const FilterTools& tools,
                           const belief::Belief& belief, SampledView* view) {
  view->step = rendering::pixel_step(full.width, kColorWidth);
  view->offset = rendering::pixel_offset(view->step, full.width, full.height);
  view->camera = full.subsampled(view->step, view->offset);
  const BeliefView drawn = render_scene(belief, MeshDetail::kLikelihood, *tools.meshes);
  for (const belief::ObjectBelief& object : belief.objects) {
    std::size_t label = 0;
    for (std::size_t i = 0; i < drawn.names.size() && label == 0; ++i)
      if (drawn.kinds[i] == InstanceKind::kObject && drawn.names[i] == object.name) label = i + 1;
    view->label_of_object.push_back(label);
  }
  return tools.renderer->render(drawn.scene, view->camera, frame.X_WC, {}, &view->rendered);
}

/// Whether the pixel and its neighbours all show the label, or all don't.
bool is_inside(const geometry::LabelImage& labels, int x, int y, std::size_t label, bool shows) {
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u) {
      const bool within = u >= 0 && v >= 0 && u < labels.width() && v < labels.height();
      if (within && (labels(u, v) == label) != shows) return false;
      if (!within && shows) return false;
    }
  return true;
}

/// Mean log ratio of the pixels; 0 until there is something to compare them with.
double mean_evidence(const rendering::ColorHistogram& object, const belief::LearnedColors& colors,
                     const ColorLearningOptions& options) {
  if (!colors.shares || colors.frames < options.frames) return 0.0;
  const rendering::ColorModel model = model_of(colors, options.model);
  double sum = 0.0;
  for (std::size_t bin = 0; bin < object.counts().size(); ++bin)
    sum += object.counts()[bin] * static_cast<double>(model.log_ratio[bin]);
  return sum / object.total();
}

}  // namespace

bool surely_seen(const belief::ObjectBelief& object, const belief::ObjectModel& model, const WeightReport& report,
                 const ColorLearningOptions& options) {
  if (object.state != belief::TrackState::kTracked || model.surface != belief::SurfaceKind::kOpaque) return false;
  const ParticleWeight& heaviest = report.particles[static_cast<std::size_t>(report.heaviest)];
  return !heaviest.hidden && report.evidence_per_pixel >= options.min_evidence &&
         report.visible_share >= options.min_visible_share && heaviest.evidence.hit_share() >= kLeastMatching &&
         belief::estimate(object, model.symmetry).confidence >= kLeastConfidence;
}

void learn_colors(const FilterFrame& frame, const belief::Observation& observation,
                  std::span<const WeightReport> reports, const ColorLearningOptions& options, const FilterTools& tools,
                  belief::Belief& belief) {
  if (!observation.frame.color) return;
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    const belief::ObjectModel& model = belief.scene->models[static_cast<std::size_t>(belief.objects[i].model)];
    if (learns(belief, belief.objects[i], options) && is_shown_by(belief.objects[i], observation.camera) &&
        surely_seen(belief.objects[i], model, reports[i], options))
      seen.push_back(i);
  }
  SampledView view;
  // The camera was checked when the frame was prepared, so a failure is a lost device: nothing is learned,
  // and the filter's WatchedRenderer knows of it.
  if (seen.empty() || !render_belief(frame, observation.frame.camera, tools, belief, &view).ok()) return;
  const geometry::LabelImage& labels = view.rendered.labels;
  for (const std::size_t i : seen) {
    const std::size_t label = view.label_of_object[i];
    rendering::ColorHistogram object, rest;
    for (int y = 0; y < labels.height(); ++y)
      for (int x = 0; x < labels.width(); ++x) {
        const bool shows = labels(x, y) == label;
        if (!is_inside(labels, x, y, label, shows)) continue;
        const int full_x = view.offset + view.step * x, full_y = view.offset + view.step * y;
        if (shows) {
          const double d = view.rendered.depth(x, y), z = (*observation.frame.depth)(full_x, full_y);
          if (!(std::abs(z - d) < 3.0 * frame.terms.model.hit_sigma(d, 1.0))) continue;
        }
        (shows ? object : rest).add((*observation.frame.color)(full_x, full_y));
      }
    if (label == 0 || object.total() < kFewestColorPixels || !(rest.total() > 0.0)) continue;
    belief::LearnedColors& colors = colors_by(observation.camera, belief.objects[i]);
    if (mean_evidence(object, colors, options) < kLeastColorEvidence) continue;
    blend(object, rest, options, colors);
  }
}

}  // namespace prescene::filter
