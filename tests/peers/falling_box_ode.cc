// SPDX-License-Identifier: Apache-2.0
#include <ode/ode.h>

#include <array>
#include <mutex>

#include "tests/peers/falling_box.h"

namespace prescene::tests {
namespace {

struct Contacts {
  dWorldID world;
  dJointGroupID joints;
  double friction;
};

void on_near(void* data, dGeomID a, dGeomID b) {
  const auto* contacts = static_cast<const Contacts*>(data);
  std::array<dContact, 16> found;
  const int count = dCollide(a, b, static_cast<int>(found.size()), &found[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    dSurfaceParameters& surface = found[static_cast<std::size_t>(i)].surface;
    surface = dSurfaceParameters{};
    surface.mode = dContactApprox1;  // a friction pyramid that follows the normal force
    surface.mu = contacts->friction;
    const dJointID joint = dJointCreateContact(contacts->world, contacts->joints, &found[static_cast<std::size_t>(i)]);
    dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
  }
}

}  // namespace

geometry::Pose fall_by_ode(const FallingBox& box) {
  static std::once_flag once;
  std::call_once(once, [] { dInitODE2(0); });
  const dWorldID world = dWorldCreate();
  dWorldSetGravity(world, 0, 0, -9.81);
  dWorldSetERP(world, 0.2);
  const dSpaceID space = dSimpleSpaceCreate(nullptr);
  dCreatePlane(space, 0, 0, 1, 0);
  const dBodyID body = dBodyCreate(world);
  dMass mass;
  dMassSetBoxTotal(&mass, box.mass, box.size.x(), box.size.y(), box.size.z());
  dBodySetMass(body, &mass);
  const dGeomID geom = dCreateBox(space, box.size.x(), box.size.y(), box.size.z());
  dGeomSetBody(geom, body);
  const geometry::Vector3d& p = box.X_WB.translation;
  const geometry::Quaterniond& q = box.X_WB.rotation;
  const dQuaternion rotation = {q.w(), q.x(), q.y(), q.z()};
  dBodySetPosition(body, p.x(), p.y(), p.z());
  dBodySetQuaternion(body, rotation);
  dBodySetLinearVel(body, box.V_WB.linear.x(), box.V_WB.linear.y(), box.V_WB.linear.z());
  dBodySetAngularVel(body, box.V_WB.angular.x(), box.V_WB.angular.y(), box.V_WB.angular.z());
  const dJointGroupID joints = dJointGroupCreate(0);
  Contacts contacts{world, joints, box.friction};
  for (double t = 0.0; t < box.duration; t += box.step) {
    dSpaceCollide(space, &contacts, on_near);
    dWorldStep(world, box.step);
    dJointGroupEmpty(joints);
  }
  const dReal* end_p = dBodyGetPosition(body);
  const dReal* end_q = dBodyGetQuaternion(body);
  geometry::Pose end;
  end.translation = {end_p[0], end_p[1], end_p[2]};
  end.rotation = geometry::Quaterniond(end_q[0], end_q[1], end_q[2], end_q[3]).normalized();
  dJointGroupDestroy(joints);
  dSpaceDestroy(space);
  dWorldDestroy(world);
  return end;
}

}  // namespace prescene::tests
