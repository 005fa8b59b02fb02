// SPDX-License-Identifier: Apache-2.0
// The meshes on which collision queries are tested and measured: scans, household objects and robot links from the
// recorded data, and shapes made here, so that there are some also without the data.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// A sphere of `radius` whose surface goes in and out by a fifth of it, closed: about `triangles` triangles.
geometry::TriangleMesh make_bumpy_sphere(double radius, int triangles);
/// A tube of a sixth of `radius` along a (2, 3) torus knot of `radius`, closed: about `triangles` triangles.
geometry::TriangleMesh make_knot(double radius, int triangles);
/// An open shell: a square of `size` x `size` with waves, `triangles` of them.
geometry::TriangleMesh make_wavy_sheet(double size, int triangles);

/// Single precision; aborts on meshes that are not in order.
std::shared_ptr<const collision::Mesh> collision_mesh(const geometry::TriangleMesh& mesh, std::string_view name);
/// `file` ("scans/armadillo.ply") below the recorded meshes; nothing where the data is absent, or where the build is of
/// a part without a reader of mesh files. Tests then skip: `GTEST_SKIP() << missing_meshes_message()`.
std::optional<geometry::TriangleMesh> read_recorded_mesh(std::string_view file);
std::string missing_meshes_message();
/// The same in single precision; null where there is none.
std::shared_ptr<const collision::Mesh> read_collision_mesh(std::string_view file);

struct MeshPair {
  std::string name;
  std::shared_ptr<const collision::Mesh> a;
  std::shared_ptr<const collision::Mesh> b;
};

/// 14 pairs of recorded meshes from 100 to 100,000 triangles; none where there are none.
std::vector<MeshPair> recorded_mesh_pairs();
/// 4 pairs of shapes made here, 500 to 40,000 triangles.
std::vector<MeshPair> made_mesh_pairs();

}  // namespace prescene::tests
