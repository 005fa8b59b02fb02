// SPDX-License-Identifier: Apache-2.0
// Meshes with their colours and textures in the device's memory. All calls, the destructor too, need the context to be
// current.
#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "prescene/core/status.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

/// What a vertex shader reads, by location.
enum MeshAttribute : unsigned { kPosition = 0, kNormal = 1, kColor = 2, kPlace = 3 };

/// One mesh as it is drawn: three corners of its own for each triangle, since normals belong to faces.
struct GlMesh {
  std::weak_ptr<const RenderMesh> mesh;
  unsigned vertex_array = 0;
  unsigned buffer = 0;
  unsigned texture = 0;  ///< 0 = none.
  int vertices = 0;
  bool colored = false;  ///< kColor holds the vertices' colours, sRGB.
};

class GlMeshes {
 public:
  GlMeshes() = default;
  ~GlMeshes();
  GlMeshes(const GlMeshes&) = delete;
  GlMeshes& operator=(const GlMeshes&) = delete;

  /// Uploaded when it is new. kUnsupported for a texture that is larger than the device's.
  core::Result<const GlMesh*> get(const MeshHandle& mesh);
  /// Frees the meshes that nobody else holds any more.
  void forget_unused();

 private:
  static void free(const GlMesh& mesh);

  std::map<const RenderMesh*, GlMesh> meshes_;
};

}  // namespace prescene::rendering
