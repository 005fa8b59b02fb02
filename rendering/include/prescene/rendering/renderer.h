// SPDX-License-Identifier: Apache-2.0
// The contract of renderers that make images: depth, labels and, on request, normals of scenes seen by pinhole cameras.
//
//   RenderedView view;
//   PRESCENE_RETURN_IF_ERROR(renderer->render(scene, camera, X_WC, {}, &view));
#pragma once

#include <span>
#include <string>

#include "prescene/core/status.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

/// Light of pictures: some from everywhere, the rest from one side, in linear light.
struct Lighting {
  geometry::Vector3d towards_light_W = {0.35, -0.45, 0.82};  ///< Any length but 0.
  double ambient = 0.35;                                     ///< Share of a surface's own colour in shadow ...
  double direct = 0.65;                                      ///< ... and what is added where it faces the light.
  geometry::Rgb background = {236, 238, 240};                ///< sRGB.
};

/// What is drawn of each view. Surfaces outside [near_depth, far_depth] (z in C, metres) are cut away; both sides of a
/// triangle are drawn.
struct RenderOptions {
  double near_depth = 0.02;
  double far_depth = 20.0;
  bool normals = false;
  bool color = false;
  Lighting lighting;
};

/// The images of one view, all of the camera's size. A pixel shows the nearest surface on the ray through its centre.
struct RenderedView {
  geometry::DepthImage depth;   ///< z in C, metres; 0 = nothing.
  geometry::LabelImage labels;  ///< 1 + index of the instance; 0 = nothing.
  /// Unit, in C, of the flat triangle, turned towards the camera; empty unless asked.
  geometry::Image<Vector3f> normals;
  geometry::ColorImage color;  ///< sRGB: the surface's own colour (MeshLook, else the material's) by Lambert's law from
                               ///< the flat triangle's normal; empty unless asked.
};

/// One view to render; `scene` must outlive the call.
struct RenderJob {
  const RenderScene* scene = nullptr;
  geometry::PinholeCamera camera;
  geometry::Pose X_WC;
};

/// The kInvalidInput cases of Renderer::render; for backends.
core::Status validate(const RenderJob& job, const RenderOptions& options);

/// What a renderer is and promises.
struct RendererInfo {
  std::string name;                 ///< "reference", "egl".
  std::string device;               ///< "cpu", or the driver's own name.
  bool deterministic_bits = false;  ///< The same input gives the same bits on this machine; otherwise within tolerance.
  double depth_tolerance = 0.0;     ///< Largest error away from silhouettes, metres, besides 1e-4 of the depth.
  int max_image_size = 0;           ///< Largest width and height, pixels.
};

/// Draws scenes. May be called from several threads; a renderer that can't work in parallel makes callers wait.
class Renderer {
 public:
  virtual ~Renderer() = default;

  virtual RendererInfo info() const = 0;

  /// Renders jobs[i] into views[i], reusing the memory of images that have the right size already. Fails with
  /// kInvalidInput (camera or clip range not valid, more than 65535 instances), kUnsupported (image too large) or
  /// kUnavailable (the device was lost); the views are then unspecified.
  virtual core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options,
                              std::span<RenderedView> views) = 0;

  /// One view.
  core::Status render(const RenderScene& scene, const geometry::PinholeCamera& camera, const geometry::Pose& X_WC,
                      const RenderOptions& options, RenderedView* view) {
    const RenderJob job{&scene, camera, X_WC};
    return render(std::span(&job, 1), options, std::span(view, 1));
  }

  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

 protected:
  Renderer() = default;
};

}  // namespace prescene::rendering
