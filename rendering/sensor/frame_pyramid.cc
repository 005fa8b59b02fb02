// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/frame_pyramid.h"

#include <algorithm>
#include <string>

#include "prescene/core/check.h"

namespace prescene::rendering {
namespace {

/// The width that make_frame_terms makes this step of.
FrameTermsOptions options_of(int step, const FramePyramidOptions& options, const geometry::PinholeCamera& camera) {
  FrameTermsOptions result;
  result.target_width = std::max(1, camera.width / step);
  result.tempering = options.tempering;
  return result;
}

}  // namespace

double covered_pixels(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera) {
  const Eigen::Matrix3f rotation = X_CO.rotation.toRotationMatrix().cast<float>();
  const Vector3f translation = X_CO.translation.cast<float>();
  const Vector3f centre = rotation * mesh.centre + translation;
  if (!(centre.z() > mesh.radius)) return 0.0;
  std::vector<Eigen::Vector2f> places;
  places.reserve(mesh.vertices.size());
  for (const Vector3f& vertex : mesh.vertices) {
    const Vector3f p = rotation * vertex + translation;
    places.emplace_back(p.x() / p.z(), p.y() / p.z());
  }
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector2f u = places[b] - places[a], v = places[c] - places[a];
    // Counter-clockwise from outside is clockwise in an image whose y points down.
    const float area = 0.5f * (u.y() * v.x() - u.x() * v.y());
    if (area > 0.0f || !mesh.closed) sum += std::abs(area);
  }
  return sum * camera.fx * camera.fy;
}

core::Status FramePyramid::reset(const FrameTermsInput& input, const FramePyramidOptions& options,
                                 const SensorModel& model) {
  steps_.clear();
  if (options.coarsest_width < 1 || options.finest_width < 1)
    return core::invalid_input("frame pyramid: widths are " + std::to_string(options.coarsest_width) + " and " +
                               std::to_string(options.finest_width) + " pixels, give positive ones");
  if (!(options.enough_pixels > 0.0))
    return core::invalid_input("frame pyramid: enough_pixels is " + std::to_string(options.enough_pixels) +
                               ", give a positive number");
  input_ = input;
  options_ = options;
  model_ = model;
  if (terms_.empty()) terms_.resize(1);
  FrameTermsOptions coarsest;
  coarsest.target_width = options.coarsest_width;
  coarsest.tempering = options.tempering;
  PRESCENE_RETURN_IF_ERROR(make_frame_terms(input, coarsest, model, terms_.data()));
  int step = terms_.front().step;
  steps_.push_back(step);
  while (step > 1 && 2 * input.camera.width / step <= options.finest_width) steps_.push_back(step /= 2);
  terms_.resize(steps_.size());
  made_.assign(steps_.size(), false);
  made_.front() = true;
  return core::ok_status();
}

int FramePyramid::level_for(const RenderMesh& mesh, const geometry::Pose& X_CO) const {
  const double covered = covered_pixels(mesh, X_CO, input_.camera);
  for (std::size_t i = 0; i < steps_.size(); ++i)
    if (covered >= options_.enough_pixels * steps_[i] * steps_[i]) return static_cast<int>(i);
  return levels() - 1;
}

const FrameTerms& FramePyramid::level(int index) {
  PRESCENE_CHECK(index >= 0 && index < levels());
  const auto i = static_cast<std::size_t>(index);
  if (!made_[i]) {
    // What the coarsest level was made of makes the others.
    PRESCENE_CHECK(make_frame_terms(input_, options_of(steps_[i], options_, input_.camera), model_, &terms_[i]).ok());
    made_[i] = true;
  }
  return terms_[i];
}

}  // namespace prescene::rendering
