// SPDX-License-Identifier: Apache-2.0
#include "object_raster.h"

#include <limits>

namespace prescene::rendering {
namespace {

ScreenPoint<float> projected(const Vector3f& p_C, const geometry::PinholeCamera& camera) {
  const float scale = 1.0f / p_C.z();
  return {static_cast<float>(camera.fx) * p_C.x() * scale + static_cast<float>(camera.cx),
          static_cast<float>(camera.fy) * p_C.y() * scale + static_cast<float>(camera.cy)};
}

}  // namespace

void ObjectRaster::project(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera,
                           bool cut) {
  const Eigen::Matrix3f R_CO = X_CO.rotation.toRotationMatrix().cast<float>();
  const Vector3f p_CO = X_CO.translation.cast<float>();
  const std::size_t count = mesh.vertices.size();
  if (points_C_.size() < count) {
    points_C_.resize(count);
    pixels_.resize(count);
  }
  if (cut) {
    // Corners behind the camera have no pixel: faces are projected as they are cut.
    for (std::size_t i = 0; i < count; ++i) points_C_[i] = R_CO * mesh.vertices[i] + p_CO;
    rect_ = {0, 0, width_ - 1, height_ - 1};
    return;
  }
  constexpr float kFar = std::numeric_limits<float>::max();
  float x_min = kFar, x_max = -kFar, y_min = kFar, y_max = -kFar;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3f p_C = R_CO * mesh.vertices[i] + p_CO;
    const ScreenPoint<float> pixel = projected(p_C, camera);
    points_C_[i] = p_C;
    pixels_[i] = pixel;
    x_min = std::min(x_min, pixel.x);
    x_max = std::max(x_max, pixel.x);
    y_min = std::min(y_min, pixel.y);
    y_max = std::max(y_max, pixel.y);
  }
  const auto limited = [](float value, int size) { return std::clamp(value, -1.0f, static_cast<float>(size)); };
  rect_.x_first = std::max(0, static_cast<int>(std::ceil(limited(x_min, width_))));
  rect_.x_last = std::min(width_ - 1, static_cast<int>(std::floor(limited(x_max, width_))));
  rect_.y_first = std::max(0, static_cast<int>(std::ceil(limited(y_min, height_))));
  rect_.y_last = std::min(height_ - 1, static_cast<int>(std::floor(limited(y_max, height_))));
}

void ObjectRaster::clear(const geometry::PinholeCamera& camera) {
  const std::size_t size = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (inverse_depth_.size() < size) {
    inverse_depth_.resize(size);
    face_of_pixel_.resize(size);
  }
  // One pixel more on each side, for at_outline.
  const int x_first = std::max(0, rect_.x_first - 1);
  const int x_last = std::min(width_ - 1, rect_.x_last + 1);
  for (int y = std::max(0, rect_.y_first - 1); y <= std::min(height_ - 1, rect_.y_last + 1); ++y)
    std::fill(inverse_depth_.begin() + static_cast<std::ptrdiff_t>(index(x_first, y)),
              inverse_depth_.begin() + static_cast<std::ptrdiff_t>(index(x_last, y)) + 1, 0.0f);
}

void ObjectRaster::fill(const Vector3f& a, const Vector3f& b, const Vector3f& c, ScreenPoint<float> pa,
                        ScreenPoint<float> pb, ScreenPoint<float> pc) {
  // 1/z is linear over the image: n . ray / distance. Kept between the corners' own, which edge-on faces would leave.
  const FacePlane& plane = faces_.back();
  const auto face = static_cast<std::uint32_t>(faces_.size() - 1);
  const float scale = 1.0f / plane.distance;
  const float along_x = plane.normal.x() * inverse_fx_ * scale;
  const float along_y = plane.normal.y() * inverse_fy_ * scale;
  const float at_centre = plane.normal.z() * scale;
  const auto [z_min, z_max] = std::minmax({a.z(), b.z(), c.z()});
  const float low = 1.0f / z_max;
  const float high = 1.0f / z_min;
  for_each_covered_pixel(pa, pb, pc, rect_, [&](int x, int y) {
    const float linear = at_centre + along_x * (static_cast<float>(x) - cx_) + along_y * (static_cast<float>(y) - cy_);
    const float inverse_depth = std::clamp(linear, low, high);
    const std::size_t i = index(x, y);
    if (inverse_depth <= inverse_depth_[i]) return;
    inverse_depth_[i] = inverse_depth;
    face_of_pixel_[i] = face;
  });
}

void ObjectRaster::draw(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera,
                        float near_depth) {
  width_ = camera.width;
  height_ = camera.height;
  inverse_fx_ = static_cast<float>(1.0 / camera.fx);
  inverse_fy_ = static_cast<float>(1.0 / camera.fy);
  cx_ = static_cast<float>(camera.cx);
  cy_ = static_cast<float>(camera.cy);
  faces_.clear();
  rect_ = PixelRect{};
  const auto centre_z = static_cast<float>((X_CO * mesh.centre.cast<double>().eval()).z());
  if (mesh.triangles.empty() || centre_z + mesh.radius <= near_depth) return;
  const bool cut = centre_z - mesh.radius < near_depth;
  project(mesh, X_CO, camera, cut);
  if (rect_.empty()) return;
  clear(camera);
  faces_.reserve(mesh.triangles.size());

  const Eigen::Matrix3f R_CO = X_CO.rotation.toRotationMatrix().cast<float>();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& triangle = mesh.triangles[i];
    const Vector3f& a = points_C_[triangle[0]];
    const Vector3f& b = points_C_[triangle[1]];
    const Vector3f& c = points_C_[triangle[2]];
    Vector3f normal = R_CO * mesh.normals[i];
    float distance = normal.dot(a);
    // Seen from behind: never visible on a closed mesh that the near plane leaves whole.
    if (distance > 0.0f) {
      if (mesh.closed && !cut) continue;
      normal = -normal;
      distance = -distance;
    }
    if (distance == 0.0f) continue;
    if (!cut) {
      faces_.push_back({normal, distance});
      fill(a, b, c, pixels_[triangle[0]], pixels_[triangle[1]], pixels_[triangle[2]]);
      continue;
    }
    const Vector3f corners[3] = {a, b, c};
    Vector3f polygon[4];
    const int count = clip_to_near(corners, near_depth, polygon);
    if (count < 3) continue;
    faces_.push_back({normal, distance});
    for (int k = 2; k < count; ++k)
      fill(polygon[0], polygon[k - 1], polygon[k], projected(polygon[0], camera), projected(polygon[k - 1], camera),
           projected(polygon[k], camera));
  }
}

bool ObjectRaster::at_outline(int x, int y) const {
  const float* pixel = &inverse_depth_[index(x, y)];
  return (x > 0 && pixel[-1] == 0.0f) || (x + 1 < width_ && pixel[1] == 0.0f) || (y > 0 && pixel[-width_] == 0.0f) ||
         (y + 1 < height_ && pixel[width_] == 0.0f);
}

}  // namespace prescene::rendering
