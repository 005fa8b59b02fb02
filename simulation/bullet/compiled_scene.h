// SPDX-License-Identifier: Apache-2.0
// A scene made ready for simulation: shapes, contact properties and principal axes of each body. Built once, shared
// const by all instances.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bullet_types.h"
#include "contact_finder.h"
#include "convex_core.h"
#include "prescene/belief/scene.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/shape_store.h"

namespace prescene::simulation {

/// One convex core, surface or tree of spheres of a body: exactly one of them is set.
struct Part {
  std::shared_ptr<const ConvexCore> core;
  std::shared_ptr<const SurfaceShape> surface;
  std::shared_ptr<const collision::SurfaceSpheres> spheres;
  Frame X_OS;
  Vector3d box_center, box_half_size;  // in O
};

struct CompiledBody {
  std::string name;
  std::vector<Part> parts;
  double radius = 0.0;                       ///< Farthest point of a part from O, m.
  SurfaceCoefficients surface;               ///< Objects bring theirs, but for the rolling arm.
  Pose X_WO;                                 ///< Of supports.
  Vector3d unit_moments = Vector3d::Ones();  ///< Of objects: principal moments for 1 kg, m^2.
  Matrix3d R_OP = Matrix3d::Identity();      ///< Of objects: principal axes.
  double hull_error = 0.0;                   ///< m: ConvexPolytope::left_out of its hulls, the largest.
};

struct CompiledJoint {
  belief::Joint joint;
  int child = 0;                    ///< Object.
  int parent = -1;                  ///< Body, or -1: the world.
  Vector3d across_1_P, across_2_P;  ///< With the axis an orthonormal frame.
  Vector3d anchor_C;                ///< The point of the child that is on the anchor at position 0.
  double arm = 0.1;                 ///< m: of the child's farthest point from its frame.
};

struct CompiledScene {
  belief::Scene scene;
  BulletOptions options;
  std::vector<CompiledBody> bodies;   ///< Objects, supports, robot bodies, in the scene's order.
  std::vector<CompiledJoint> joints;  ///< In the scene's order.
  std::vector<int> joint_order;       ///< Of these, parents first.
  std::uint64_t hash = 0;             ///< Of what steps depend on.
  double hull_error = 0.0;            ///< m: the largest of all bodies.
  int object_count = 0;
  int support_count = 0;
  int robot_count = 0;

  int robot_body(int robot) const { return object_count + support_count + robot; }
  /// Whether a joint joins them directly.
  bool are_jointed(int a, int b) const {
    for (const CompiledJoint& joint : joints)
      if ((joint.child == a && joint.parent == b) || (joint.child == b && joint.parent == a)) return true;
    return false;
  }
};

core::Result<std::shared_ptr<const CompiledScene>> compile_scene(const belief::Scene& scene, ShapeStore& shapes,
                                                                 const BulletOptions& options);

}  // namespace prescene::simulation
