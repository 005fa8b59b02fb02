// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/residuals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "prescene/service/pictures/belief_overlay.h"

namespace prescene::service {
namespace {

constexpr int kColumns = 160;
constexpr double kFurthest = 0.05;  // m
constexpr std::size_t kFewestPixels = 10;

}  // namespace

std::map<std::string, double> ResidualMeter::measure(const belief::Scene& scene, const BeliefSummary& summary,
                                                     const belief::Observation& observation) {
  std::map<std::string, double> medians;
  const auto& frame = observation.frame;
  if (!frame.depth || frame.depth->width() != frame.camera.width || frame.depth->height() != frame.camera.height)
    return medians;
  if (!renderer_) {
    auto made = backends_->make_renderer();
    if (!made) return medians;
    renderer_ = *std::move(made);
  }
  std::vector<std::string> names;
  const rendering::RenderScene drawn = drawn_belief(scene, summary, observation, backends_->meshes(), &names);
  const int step = std::max(1, frame.camera.width / kColumns);
  const geometry::PinholeCamera camera = frame.camera.subsampled(step, step / 2);
  rendering::RenderedView view;
  if (!renderer_->render(drawn, camera, observation.X_WC, {}, &view).ok()) return medians;
  std::vector<std::vector<double>> differences(summary.objects.size());
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const std::size_t label = view.labels(x, y);
      if (label == 0 || label > std::min(names.size(), differences.size())) continue;
      const double measured = (*frame.depth)(step / 2 + step * x, step / 2 + step * y);
      const double difference = std::abs(measured - static_cast<double>(view.depth(x, y)));
      if (measured > 0.0 && difference < kFurthest) differences[label - 1].push_back(difference);
    }
  for (std::size_t i = 0; i < std::min(names.size(), differences.size()); ++i) {
    std::vector<double>& values = differences[i];
    if (values.size() < kFewestPixels) continue;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    medians[names[i]] = *middle;
  }
  return medians;
}

}  // namespace prescene::service
