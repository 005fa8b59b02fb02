// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/frame_sampling.h"

#include <algorithm>
#include <limits>

#include "prescene/rendering/sensor/pixel_grid.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::TrackState;

constexpr int kClosestSpacing = 4;          // of the full image: real cameras round edges in depth over so many
constexpr int kMostColumns = 320;           // of the reduced image
constexpr double kMostPixelsOfAll = 1.0e4;  // of the reduced image on all things together

bool is_followed(const ObjectBelief& object) {
  return !object.particles.empty() && (object.state == TrackState::kTracked || object.state == TrackState::kDoubtful);
}

/// m^2, mean over all turns.
double covered_area(const rendering::RenderMesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const rendering::Vector3f& vertex : mesh.vertices) box.extend(vertex);
  if (box.isEmpty()) return 0.0;
  const Vector3d edges = box.sizes().cast<double>();
  return 0.5 * (edges.x() * edges.y() + edges.y() * edges.z() + edges.z() * edges.x());
}

}  // namespace

FrameSampling sampled_for(const belief::Belief& belief, const belief::Observation& observation,
                          const FrameOptions& options, MeshCache& meshes) {
  FrameSampling sampling{.terms = options.terms};
  const geometry::PinholeCamera& camera = observation.frame.camera;
  if (!geometry::validate_sensor(camera).ok()) return sampling;
  const int coarse = std::max(1, options.terms.target_width);
  const Pose X_CW = observation.X_WC.inverse();
  double least = std::numeric_limits<double>::infinity(), all = 0.0;  // pixels of the full image
  for (const ObjectBelief& object : belief.objects) {
    if (!is_followed(object)) continue;
    const belief::ObjectModel& model = belief::model_of(belief, object);
    const rendering::MeshHandle mesh = meshes.get(model.visual, model.collision, MeshDetail::kLikelihood);
    const Vector3d centre_C = X_CW * (belief::heaviest(object.particles).X_WO * mesh->centre.cast<double>());
    if (!(centre_C.z() > mesh->radius)) continue;
    const Eigen::Vector2d pixel = camera.project(centre_C);
    if (!(pixel.x() > 0.0 && pixel.y() > 0.0 && pixel.x() < camera.width && pixel.y() < camera.height)) continue;
    const double pixels = covered_area(*mesh) * camera.fx * camera.fy / (centre_C.z() * centre_C.z());
    if (!(pixels > 0.0)) continue;
    least = std::min(least, pixels);
    all += pixels;
  }
  const int usual = rendering::pixel_step(camera.width, coarse);
  int step = usual;
  while (step > kClosestSpacing && least < options.enough_pixels * step * step) {
    const int finer = std::max(kClosestSpacing, step / 2);
    if (camera.width > static_cast<double>(kMostColumns) * finer || all > kMostPixelsOfAll * finer * finer) break;
    step = finer;
  }
  if (step == usual) return sampling;
  sampling.terms.target_width = std::max(coarse, camera.width / step);
  step = rendering::pixel_step(camera.width, sampling.terms.target_width);  // not quite that at unusual widths
  const double area = static_cast<double>(usual) * usual, finer_area = static_cast<double>(step) * step;
  sampling.density = area / finer_area;
  sampling.terms.tempering.weight.correlated_px2 += area - finer_area;
  sampling.terms.tempering.information.correlated_px2 += area - finer_area;
  return sampling;
}

}  // namespace prescene::filter
