// SPDX-License-Identifier: Apache-2.0
// Meshes in Embree.
#pragma once

#include <embree3/rtcore.h>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// Adds a mesh to a scene that is to be committed, in single precision.
inline void attach_mesh(const geometry::TriangleMesh& mesh, RTCDevice device, RTCScene scene) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices.size()));
  for (const geometry::Vector3d& vertex : mesh.vertices)
    for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(vertex[k]);
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle) *indices++ = index;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

}  // namespace prescene::tests
