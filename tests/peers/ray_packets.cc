// SPDX-License-Identifier: Apache-2.0
#include "tests/peers/ray_packets.h"

#include <embree3/rtcore.h>

#include "embree_mesh.h"

namespace prescene::tests {
namespace {

constexpr int kPacket = 16;

}  // namespace

struct RayPackets::Impl {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);

  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

RayPackets::RayPackets(const geometry::TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  attach_mesh(mesh, impl_->device, impl_->scene);
  rtcCommitScene(impl_->scene);
}

RayPackets::~RayPackets() = default;

void RayPackets::depths(const geometry::PinholeCamera& camera, const geometry::Pose& X_CM, const PixelWindow& window,
                        geometry::DepthImage* depth) const {
  const geometry::Pose X_MC = X_CM.inverse();
  const Eigen::Vector3f origin = X_MC.translation.cast<float>();
  const Eigen::Matrix3f R = X_MC.rotation.toRotationMatrix().cast<float>();
  const auto inverse_fx = static_cast<float>(1.0 / camera.fx), inverse_fy = static_cast<float>(1.0 / camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) RTCRayHit16 packet;
  alignas(64) int valid[kPacket];
  // Blocks of 4 x 4 pixels: their rays stay together longest.
  for (int y = window.y_first; y <= window.y_last; y += 4) {
    for (int x = window.x_first; x <= window.x_last; x += 4) {
      for (int k = 0; k < kPacket; ++k) {
        const int u = x + k % 4, v = y + k / 4;
        valid[k] = u <= window.x_last && v <= window.y_last ? -1 : 0;
        // Directions have z = 1 in C, so that lengths along them are depths.
        const Eigen::Vector3f ray = R * Eigen::Vector3f((static_cast<float>(u) - cx) * inverse_fx,
                                                        (static_cast<float>(v) - cy) * inverse_fy, 1.0f);
        packet.ray.org_x[k] = origin.x();
        packet.ray.org_y[k] = origin.y();
        packet.ray.org_z[k] = origin.z();
        packet.ray.dir_x[k] = ray.x();
        packet.ray.dir_y[k] = ray.y();
        packet.ray.dir_z[k] = ray.z();
        packet.ray.tnear[k] = 0.0f;
        packet.ray.tfar[k] = 1e6f;
        packet.ray.time[k] = 0.0f;
        packet.ray.mask[k] = ~0u;
        packet.ray.flags[k] = 0;
        packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
      }
      rtcIntersect16(valid, impl_->scene, &context, &packet);
      for (int k = 0; k < kPacket; ++k) {
        if (valid[k] == 0) continue;
        (*depth)(x + k % 4, y + k / 4) = packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? 0.0f : packet.ray.tfar[k];
      }
    }
  }
}

}  // namespace prescene::tests
