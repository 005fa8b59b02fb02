// SPDX-License-Identifier: Apache-2.0
// Depth images by Embree's coherent packets of 16 rays, as a peer in speed.
#pragma once

#include <memory>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// Pixels x_first <= x <= x_last, y alike.
struct PixelWindow {
  int x_first = 0, y_first = 0, x_last = -1, y_last = -1;
};

/// One mesh, single precision, one thread.
class RayPackets {
 public:
  explicit RayPackets(const geometry::TriangleMesh& mesh);
  ~RayPackets();
  RayPackets(const RayPackets&) = delete;
  RayPackets& operator=(const RayPackets&) = delete;

  /// z in C (m, 0 = nothing) of the mesh at X_CM, in the window's pixels of an image of the camera's size; others stay
  /// as they are.
  void depths(const geometry::PinholeCamera& camera, const geometry::Pose& X_CM, const PixelWindow& window,
              geometry::DepthImage* depth) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::tests
