// SPDX-License-Identifier: Apache-2.0
// Spheres inside a body that touch its surface, so close to each other that together they stand for it: what packed
// bodies collide with in a simulation. A packing that fills a body (sphere_packing.h) says how deep bodies are inside
// each other; its spheres meet the surface here and there only, and between them things would sink in. Here each part
// of the surface has a sphere of its own, which knows how the surface goes on about the place where it touches.
//
//   PRESCENE_TRY(const SurfaceSpheres cup, cover_surface(mesh, {.count = 3000, .edge_fidelity = 0.001}, pool));
//   ... cup.tree, cup.patches[cup.tree->order()[place]]
//
// Faces are sampled by throwing darts, closer where they bend [Cook 1986]; the sphere at a sample is the largest that
// touches the surface there and does not leave the body (the shrinking ball of [Ma, Bae and Choi 2012]). Facets that
// meet at less than half a radian stand for a round surface, which the spheres touch in their place. Sharp edges and
// corners get small spheres that touch the faces beside them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct SurfaceSphereOptions {
  int count = 3000;  ///< Approximate number of spheres on faces, [50, 100000]. Sharp edges and corners get more.
  /// m, at most a tenth of the bounding box's diagonal; spheres of sharp edges and corners have their centres this far
  /// inside: bodies rest and tip on these edges with an error of about 0.7 of it. 0: 0.3 % of that diagonal.
  double edge_fidelity = 0.0;

  friend bool operator==(const SurfaceSphereOptions&, const SurfaceSphereOptions&) = default;
};

/// What a sphere knows of the surface, in the body's frame, m.
struct SurfacePatch {
  /// The largest sphere that touches the surface at `point` from inside. The tree holds a smaller one that touches it
  /// at the same point.
  Vector3f centre = Vector3f::Zero();
  float radius = 0.0F;
  Vector3f point = Vector3f::Zero();
  Vector3f normal = Vector3f::Zero();     ///< Outward, of unit length.
  Vector3f tangent = Vector3f::Zero();    ///< Some unit vector in the tangent plane ...
  Vector3f bitangent = Vector3f::Zero();  ///< ... and normal x tangent: with the normal a right-handed frame.
  /// b0, b1, b2, 1/m: at p, with u = tangent . (p - point) and v = bitangent . (p - point), the surface is at the
  /// height (b0 u^2 + b1 u v + b2 v^2) / 2 along the normal over its tangent plane.
  std::array<float, 3> bend = {};
  /// How far from the point the patch goes; 0 for spheres of edges and corners, which stand for themselves.
  float reach = 0.0F;
  /// Sharp edges that end it: there is nothing of it where out . (p - point) > distance.
  struct Limit {
    Vector3f out = Vector3f::Zero();
    float distance = 0.0F;
  };
  std::array<Limit, 2> limits;  ///< Unused: zero.

  bool is_edge() const { return reach == 0.0F; }
};

struct SurfaceSpheres {
  std::shared_ptr<const SphereTree> tree;  ///< Over the spheres; its packing's index is that of the patch.
  std::vector<SurfacePatch> patches;
  float longest_reach = 0.0F;  ///< Of a patch beyond its sphere, m: touching things may be that far from the sphere.
  float rise = 0.0F;           ///< Spheres leave facets by up to this where they stand for a round surface, m.
  int edge_spheres = 0;
  double spacing = 0.0;  ///< Of the spheres on flat faces, m.
};

/// The same for any number of threads of `pool`. Fails with kInvalidInput, naming the mesh, when it is open (with a
/// place and the number of open edges), turned inside out, or an option is out of range.
core::Result<SurfaceSpheres> cover_surface(const std::shared_ptr<const Mesh>& mesh, const SurfaceSphereOptions& options,
                                           core::ThreadPool& pool);

}  // namespace prescene::collision
