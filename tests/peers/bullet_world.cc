// SPDX-License-Identifier: Apache-2.0
#include "tests/peers/bullet_world.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <btBulletCollisionCommon.h>

namespace prescene::tests {
namespace {

using geometry::Matrix3d;
using geometry::Pose;
using geometry::Vector3d;

constexpr double kMargin = 2e-4;

btVector3 bullet(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
btTransform bullet(const Pose& X) {
  const auto& q = X.rotation;
  return btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()), bullet(X.translation));
}

/// A body's shapes, in its frame of principal axes about the centre of mass.
struct Shape {
  std::vector<std::unique_ptr<btCollisionShape>> parts;
  std::vector<btScalar> vertices;
  std::vector<int> indices;
  std::unique_ptr<btTriangleIndexVertexArray> triangles;
  std::unique_ptr<btCollisionShape> whole;
  Pose X_BP;  // principal frame
};

void add_hulls(const BulletBody& body, Shape& shape) {
  auto compound = std::make_unique<btCompoundShape>();
  for (const geometry::TriangleMesh& part : body.parts) {
    auto hull = std::make_unique<btConvexHullShape>();
    for (const Vector3d& v : part.vertices) hull->addPoint(bullet(shape.X_BP.inverse() * v), false);
    hull->recalcLocalAabb();
    hull->setMargin(kMargin);
    compound->addChildShape(btTransform::getIdentity(), hull.get());
    shape.parts.push_back(std::move(hull));
  }
  shape.whole = std::move(compound);
}

void add_gimpact(const BulletBody& body, Shape& shape) {
  const geometry::TriangleMesh& mesh = body.parts.front();
  for (const Vector3d& v : mesh.vertices) {
    const Vector3d p = shape.X_BP.inverse() * v;
    shape.vertices.insert(shape.vertices.end(), {p.x(), p.y(), p.z()});
  }
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t i : t) shape.indices.push_back(static_cast<int>(i));
  shape.triangles = std::make_unique<btTriangleIndexVertexArray>(
      static_cast<int>(mesh.triangles.size()), shape.indices.data(), static_cast<int>(3 * sizeof(int)),
      static_cast<int>(mesh.vertices.size()), shape.vertices.data(), static_cast<int>(3 * sizeof(btScalar)));
  auto whole = std::make_unique<btGImpactMeshShape>(shape.triangles.get());
  whole->setMargin(kMargin);
  whole->updateBound();
  shape.whole = std::move(whole);
}

}  // namespace

struct BulletWorld::Impl {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<BulletBody> given;
  std::vector<Shape> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

BulletWorld::BulletWorld(const std::vector<BulletBody>& bodies) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.given = bodies;
  btGImpactCollisionAlgorithm::registerAlgorithm(&m.dispatcher);
  m.world.setGravity(btVector3(0.0, 0.0, -9.81));
  m.shapes.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BulletBody& body = bodies[i];
    Shape& shape = m.shapes[i];
    btVector3 moments(0.0, 0.0, 0.0);
    if (body.mass.mass > 0.0) {
      const geometry::PrincipalInertia principal = geometry::principal_inertia(body.mass);
      shape.X_BP = Pose{geometry::Quaterniond(principal.R_BP), body.mass.p_BoBcm};
      moments = bullet(principal.moments);
    }
    if (body.parts.empty()) {
      shape.whole = std::make_unique<btBoxShape>(bullet(0.5 * body.box));
      shape.whole->setMargin(kMargin);
    } else {
      body.gimpact ? add_gimpact(body, shape) : add_hulls(body, shape);
    }
    btRigidBody::btRigidBodyConstructionInfo info(body.mass.mass, nullptr, shape.whole.get(), moments);
    info.m_friction = 0.7;
    m.bodies.push_back(std::make_unique<btRigidBody>(info));
    m.bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    m.world.addRigidBody(m.bodies.back().get());
  }
  reset();
}

BulletWorld::~BulletWorld() {
  for (const auto& body : impl_->bodies) impl_->world.removeRigidBody(body.get());
}

void BulletWorld::reset() {
  Impl& m = *impl_;
  for (std::size_t i = 0; i < m.bodies.size(); ++i) {
    const btTransform start = bullet(m.given[i].start * m.shapes[i].X_BP);
    m.bodies[i]->setWorldTransform(start);
    m.bodies[i]->setInterpolationWorldTransform(start);
    m.bodies[i]->setLinearVelocity(btVector3(0.0, 0.0, 0.0));
    m.bodies[i]->setAngularVelocity(btVector3(0.0, 0.0, 0.0));
    m.bodies[i]->clearForces();
  }
}

void BulletWorld::step(double dt) { impl_->world.stepSimulation(dt, 0); }

Pose BulletWorld::pose(std::size_t body) const {
  const btTransform& X = impl_->bodies[body]->getWorldTransform();
  const btQuaternion q = X.getRotation();
  const Pose X_WP{geometry::Quaterniond(q.w(), q.x(), q.y(), q.z()),
                  Vector3d(X.getOrigin().x(), X.getOrigin().y(), X.getOrigin().z())};
  return X_WP * impl_->shapes[body].X_BP.inverse();
}

}  // namespace prescene::tests
