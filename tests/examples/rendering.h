// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering take for granted.
#pragma once

#include <memory>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/renderer.h"

namespace prescene::rendering::given_rendering {

extern const geometry::TriangleMesh triangle_mesh;
extern const MeshHandle mesh;
extern const SurfaceMaterial material;
extern const geometry::PinholeCamera camera;
extern const geometry::Pose X_CO, X_WC, X_WM;
extern const RenderScene scene;
extern const std::unique_ptr<Renderer> renderer;

}  // namespace prescene::rendering::given_rendering
