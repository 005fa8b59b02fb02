// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/reference/reference_renderer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/rendering/surface_color.h"
#include "prescene/rendering/triangle_raster.h"

namespace prescene::rendering {
namespace {

using geometry::Vector3d;

constexpr int kMaxImageSize = 16384;

/// The nearest surface of each pixel while a view is drawn, in double precision.
struct ZBuffer {
  geometry::Image<double> inverse_depth;  ///< 0 = nothing.
  geometry::LabelImage* labels;
  geometry::Image<Vector3f>* normals;    ///< Null = not wanted.
  geometry::Image<std::uint32_t> faces;  ///< Of the instance's mesh; empty = not wanted.
};

/// A face as it is drawn.
struct Face {
  Vector3d corners_C[3];
  std::uint16_t label;
  std::uint32_t index;
};

ScreenPoint projected(const Vector3d& p_C, const geometry::PinholeCamera& camera) {
  const Eigen::Vector2d pixel = camera.project(p_C);
  return snapped(pixel.x(), pixel.y());
}

void draw_triangle(const Face& face, const geometry::PinholeCamera& camera, const RenderOptions& options,
                   ZBuffer* buffer) {
  const Vector3d(&corners)[3] = face.corners_C;
  Vector3d polygon[4];
  const int count = clip_to_near(corners, options.near_depth, polygon);
  if (count < 3) return;
  const PixelRect image = {0, 0, camera.width - 1, camera.height - 1};
  ScreenPoint screen[4];
  PixelRect boxes[4];
  bool covers = false;
  for (int i = 0; i < count; ++i) screen[i] = projected(polygon[i], camera);
  for (int k = 2; k < count; ++k) {
    boxes[k] = bounding_pixels(screen[0], screen[k - 1], screen[k], image);
    covers = covers || !boxes[k].empty();
  }
  if (!covers) return;
  // The face's plane n . p = k gives 1 / z = n . ray / k at each pixel: perspective-correct, and linear over the image.
  const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  const double distance = normal.dot(corners[0]);
  if (distance == 0.0 || !normal.allFinite()) return;  // seen edge-on, or no area
  double z_min = polygon[0].z();
  double z_max = polygon[0].z();
  for (int i = 1; i < count; ++i) {
    z_min = std::min(z_min, polygon[i].z());
    z_max = std::max(z_max, polygon[i].z());
  }
  const Vector3f towards_camera = (distance > 0.0 ? Vector3d(-normal) : normal).cast<float>();
  for (int k = 2; k < count; ++k) {
    for_each_covered_pixel(screen[0], screen[k - 1], screen[k], boxes[k], [&](int x, int y) {
      const double linear = normal.dot(camera.unproject(x, y, 1.0)) / distance;
      // Faces almost edge-on would leave the depths of their own corners.
      const double inverse_depth = std::clamp(linear, 1.0 / z_max, 1.0 / z_min);
      if (inverse_depth <= buffer->inverse_depth(x, y) || inverse_depth * options.far_depth < 1.0) return;
      buffer->inverse_depth(x, y) = inverse_depth;
      (*buffer->labels)(x, y) = face.label;
      if (!buffer->faces.empty()) buffer->faces(x, y) = face.index;
      if (buffer->normals != nullptr) (*buffer->normals)(x, y) = towards_camera;
    });
  }
}

void draw_instance(const RenderInstance& instance, const geometry::Pose& X_CW, const geometry::PinholeCamera& camera,
                   const RenderOptions& options, std::uint16_t label, ZBuffer* buffer) {
  const geometry::Pose X_CM = X_CW * instance.X_WM;
  std::vector<Vector3d> points_C;
  points_C.reserve(instance.mesh->vertices.size());
  for (const Vector3f& p_M : instance.mesh->vertices) points_C.push_back(X_CM * p_M.cast<double>().eval());
  for (std::size_t i = 0; i < instance.mesh->triangles.size(); ++i) {
    const auto& triangle = instance.mesh->triangles[i];
    const Face face = {
        {points_C[triangle[0]], points_C[triangle[1]], points_C[triangle[2]]}, label, static_cast<std::uint32_t>(i)};
    draw_triangle(face, camera, options, buffer);
  }
}

/// The colours of what was drawn; its normals are there.
void color_pixels(const RenderJob& job, const RenderOptions& options, const ZBuffer& buffer,
                  geometry::ColorImage* color) {
  const geometry::PinholeCamera& camera = job.camera;
  *color = geometry::ColorImage(camera.width, camera.height, options.lighting.background);
  const Vector3d towards_light = job.X_WC.rotation.conjugate() * options.lighting.towards_light_W.normalized();
  std::vector<geometry::Pose> X_MC;
  for (const RenderInstance& instance : job.scene->instances) X_MC.push_back(instance.X_WM.inverse() * job.X_WC);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const std::uint16_t label = (*buffer.labels)(x, y);
      if (label == 0) continue;
      const RenderInstance& instance = job.scene->instances[label - 1u];
      const Vector3d p_C = camera.unproject(x, y, 1.0 / buffer.inverse_depth(x, y));
      const LinearRgb own = own_color(*instance.mesh, buffer.faces(x, y), X_MC[label - 1u] * p_C, instance.material);
      const double facing = std::max(0.0, (*buffer.normals)(x, y).cast<double>().dot(towards_light));
      (*color)(x, y) = srgb(own * (options.lighting.ambient + options.lighting.direct * facing));
    }
  }
}

class ReferenceRenderer final : public Renderer {
 public:
  RendererInfo info() const override { return {"reference", "cpu", true, 1e-6, kMaxImageSize}; }

  core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options,
                      std::span<RenderedView> views) override {
    PRESCENE_CHECK(jobs.size() == views.size());
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      PRESCENE_RETURN_IF_ERROR(validate(jobs[i], options));
      draw(jobs[i], options, &views[i]);
    }
    return core::ok_status();
  }

 private:
  static void draw(const RenderJob& job, const RenderOptions& options, RenderedView* view) {
    const int width = job.camera.width;
    const int height = job.camera.height;
    view->labels = geometry::LabelImage(width, height, 0);
    const bool normals = options.normals || options.color;
    view->normals = normals ? geometry::Image<Vector3f>(width, height, Vector3f::Zero()) : geometry::Image<Vector3f>();
    ZBuffer buffer{geometry::Image<double>(width, height, 0.0), &view->labels, normals ? &view->normals : nullptr,
                   options.color ? geometry::Image<std::uint32_t>(width, height) : geometry::Image<std::uint32_t>()};
    const geometry::Pose X_CW = job.X_WC.inverse();
    for (std::size_t i = 0; i < job.scene->instances.size(); ++i)
      draw_instance(job.scene->instances[i], X_CW, job.camera, options, static_cast<std::uint16_t>(i + 1), &buffer);

    view->depth = geometry::DepthImage(width, height, 0.0f);
    for (std::size_t i = 0; i < view->depth.size(); ++i)
      if (buffer.inverse_depth.data()[i] > 0.0)
        view->depth.data()[i] = static_cast<float>(1.0 / buffer.inverse_depth.data()[i]);
    view->color = geometry::ColorImage();
    if (options.color) color_pixels(job, options, buffer, &view->color);
    if (!options.normals) view->normals = geometry::Image<Vector3f>();
  }
};

}  // namespace

std::unique_ptr<Renderer> make_reference_renderer() { return std::make_unique<ReferenceRenderer>(); }

}  // namespace prescene::rendering
