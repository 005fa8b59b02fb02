// SPDX-License-Identifier: Apache-2.0
#include "tests/peers/ray_caster.h"

#include <embree3/rtcore.h>

#include "embree_mesh.h"

namespace prescene::tests {

struct RayCaster::Impl {
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene scene = rtcNewScene(device);
  bool committed = true;

  Impl() { rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST); }
  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

RayCaster::RayCaster() : impl_(std::make_unique<Impl>()) {}
RayCaster::~RayCaster() = default;

void RayCaster::add(const geometry::TriangleMesh& mesh) {
  attach_mesh(mesh, impl_->device, impl_->scene);
  impl_->committed = false;
}

std::optional<RayHit> RayCaster::cast(const geometry::Vector3d& origin, const geometry::Vector3d& direction,
                                      double t_near, double t_far) const {
  if (!impl_->committed) {
    rtcCommitScene(impl_->scene);
    impl_->committed = true;
  }
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin.x());
  query.ray.org_y = static_cast<float>(origin.y());
  query.ray.org_z = static_cast<float>(origin.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());
  query.ray.tnear = static_cast<float>(t_near);
  query.ray.tfar = static_cast<float>(t_far);
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(impl_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const geometry::Vector3d normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
  return RayHit{static_cast<double>(query.ray.tfar), static_cast<int>(query.hit.geomID), normal.normalized()};
}

}  // namespace prescene::tests
