// SPDX-License-Identifier: Apache-2.0
#include "object_raster.h"

#include <limits>

namespace prescene::rendering {
namespace {

ScreenPoint projected(const Vector3f& p_C, float inverse_depth, const geometry::PinholeCamera& camera) {
  return snapped(static_cast<float>(camera.fx) * p_C.x() * inverse_depth + static_cast<float>(camera.cx),
                 static_cast<float>(camera.fy) * p_C.y() * inverse_depth + static_cast<float>(camera.cy));
}

/// A rotation that the compiler inlines where it is used; it does not do that with products of fixed matrices.
class Rotation {
 public:
  explicit Rotation(const geometry::Pose& X) {
    const geometry::Matrix3d R = X.rotation.toRotationMatrix();
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) entries_[row][column] = static_cast<float>(R(row, column));
  }
  Vector3f operator*(const Vector3f& p) const { return {dot(0, p), dot(1, p), dot(2, p)}; }

 private:
  float dot(int row, const Vector3f& p) const {
    return entries_[row][0] * p.x() + entries_[row][1] * p.y() + entries_[row][2] * p.z();
  }

  float entries_[3][3];
};

}  // namespace

void ObjectRaster::project(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera,
                           float near_depth, bool cut) {
  const Rotation R_CO(X_CO);
  const Vector3f p_CO = X_CO.translation.cast<float>();
  const std::size_t count = mesh.vertices.size();
  if (points_C_.size() < count) {
    points_C_.resize(count);
    projected_.resize(count);
  }
  if (cut) {
    // Corners behind the camera have no pixel: faces are projected as they are cut.
    most_inverse_depth_ = least_inverse_depth_ = 1.0f / near_depth;
    for (std::size_t i = 0; i < count; ++i) {
      points_C_[i] = R_CO * mesh.vertices[i] + p_CO;
      if (points_C_[i].z() >= near_depth)
        least_inverse_depth_ = std::min(least_inverse_depth_, 1.0f / points_C_[i].z());
    }
    rect_ = {0, 0, width_ - 1, height_ - 1};
    return;
  }
  constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
  ScreenPoint low{kFar, kFar}, high{-kFar, -kFar};
  least_inverse_depth_ = std::numeric_limits<float>::max();
  most_inverse_depth_ = 0.0f;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3f p_C = R_CO * mesh.vertices[i] + p_CO;
    const float inverse_depth = 1.0f / p_C.z();
    const ScreenPoint pixel = projected(p_C, inverse_depth, camera);
    points_C_[i] = p_C;
    projected_[i] = pixel;
    least_inverse_depth_ = std::min(least_inverse_depth_, inverse_depth);
    most_inverse_depth_ = std::max(most_inverse_depth_, inverse_depth);
    low = {std::min(low.x, pixel.x), std::min(low.y, pixel.y)};
    high = {std::max(high.x, pixel.x), std::max(high.y, pixel.y)};
  }
  rect_ = pixels_between(low, high, {0, 0, width_ - 1, height_ - 1});
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

void ObjectRaster::fill(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c, const FacePlane& plane) {
  const PixelRect box = bounding_pixels(a, b, c, rect_);
  if (box.empty()) return;
  const auto face = static_cast<std::uint32_t>(faces_.size());
  faces_.push_back(plane);
  // 1/z is linear over the image: n . ray / distance. Kept within the object's, which edge-on faces would leave.
  const float scale = 1.0f / plane.distance;
  const float along_x = plane.normal.x() * inverse_fx_ * scale;
  const float along_y = plane.normal.y() * inverse_fy_ * scale;
  const float at_centre = plane.normal.z() * scale;
  for_each_covered_pixel(a, b, c, box, [&](int x, int y) {
    const float linear = at_centre + along_x * (static_cast<float>(x) - cx_) + along_y * (static_cast<float>(y) - cy_);
    const float inverse_depth = std::max(least_inverse_depth_, std::min(most_inverse_depth_, linear));
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
  project(mesh, X_CO, camera, near_depth, cut);
  if (rect_.empty()) return;
  clear(camera);
  faces_.reserve(2 * mesh.triangles.size());  // a cut face is drawn in two

  const Rotation R_CO(X_CO);
  const Vector3f from_camera_O = (X_CO.rotation.conjugate() * X_CO.translation).cast<float>();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& triangle = mesh.triangles[i];
    const Vector3f& a = points_C_[triangle[0]];
    const Vector3f& normal_O = mesh.normals[i];
    Vector3f normal = R_CO * normal_O;
    float distance = normal_O.x() * from_camera_O.x() + normal_O.y() * from_camera_O.y() +
                     normal_O.z() * from_camera_O.z() + mesh.offsets[i];
    // Seen from behind: never visible on a closed mesh that the near plane leaves whole.
    if (distance > 0.0f) {
      if (mesh.closed && !cut) continue;
      normal = -normal;
      distance = -distance;
    }
    if (distance == 0.0f) continue;
    if (!cut) {
      fill(projected_[triangle[0]], projected_[triangle[1]], projected_[triangle[2]], {normal, distance});
      continue;
    }
    const Vector3f corners[3] = {a, points_C_[triangle[1]], points_C_[triangle[2]]};
    Vector3f polygon[4];
    const int count = clip_to_near(corners, near_depth, polygon);
    const auto corner = [&](int k) { return projected(polygon[k], 1.0f / polygon[k].z(), camera); };
    for (int k = 2; k < count; ++k) fill(corner(0), corner(k - 1), corner(k), {normal, distance});
  }
}

bool ObjectRaster::at_outline(int x, int y) const {
  // A neighbour beyond the image's border is the pixel itself.
  const float* pixel = &inverse_depth_[index(x, y)];
  const int left = x > 0 ? 1 : 0;
  const int right = x + 1 < width_ ? 1 : 0;
  const int up = y > 0 ? width_ : 0;
  const int down = y + 1 < height_ ? width_ : 0;
  return std::min(std::min(pixel[-left], pixel[right]), std::min(pixel[-up], pixel[down])) == 0.0f;
}

}  // namespace prescene::rendering
