// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_tree.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "prescene/collision/tree_file.h"
#include "prescene/geometry/primitives.h"
#include "prescene/tests/support/collision_meshes.h"
#include "prescene/tests/support/paths.h"

namespace prescene::collision {
namespace {

using ::testing::HasSubstr;

std::shared_ptr<const Mesh> mesh_of(const geometry::TriangleMesh& mesh) {
  auto made = Mesh::make(mesh, "mesh");
  EXPECT_TRUE(made.ok());
  return *made;
}

std::shared_ptr<const Mesh> bottle() {
  return mesh_of(geometry::make_lathe({{0.03, 0.0}, {0.035, 0.1}, {0.013, 0.18}, {0.013, 0.21}}, 40));
}

TriangleTree build(const std::shared_ptr<const Mesh>& mesh, int threads = 1) {
  core::ThreadPool pool(threads);
  return TriangleTree::build(mesh, {}, pool);
}

template <class T>
bool same_bits(const Array<T>& a, const Array<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.bytes()) == 0;
}

bool same_bits(const TriangleTree& a, const TriangleTree& b) {
  return same_bits(a.nodes(), b.nodes()) && same_bits(a.blocks(), b.blocks()) &&
         same_bits(a.references(), b.references()) && a.radius() == b.radius();
}

TEST(TriangleTree, IsTheSameForAnyNumberOfThreads) {
  const auto mesh = mesh_of(tests::make_bumpy_sphere(0.1, 80000));
  const TriangleTree one = build(mesh, 1);
  for (const int threads : {2, 3, 8}) EXPECT_TRUE(same_bits(one, build(mesh, threads))) << threads;
}

TEST(TriangleTree, SurvivesAFileBitForBit) {
  const tests::ScratchDir folder;
  const TriangleTree tree = build(bottle());
  const auto path = folder.path() / "bottle.tree";
  ASSERT_TRUE(tree.save(path).ok());
  const auto loaded = TriangleTree::load(path, bottle(), {});
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_TRUE(same_bits(tree, *loaded));
}

TEST(TriangleTree, RefusesTheFileOfAnotherMeshOrOtherOptions) {
  const tests::ScratchDir folder;
  const auto path = folder.path() / "bottle.tree";
  ASSERT_TRUE(build(bottle()).save(path).ok());
  EXPECT_THAT(TriangleTree::load(path, mesh_of(geometry::make_mesh(geometry::Sphere{0.1})), {}).status().message(),
              HasSubstr("mesh"));
  EXPECT_FALSE(TriangleTree::load(path, bottle(), {.rotated_frames = false}).ok());
  EXPECT_EQ(TriangleTree::load(folder.path() / "cup.tree", bottle(), {}).status().code(), core::StatusCode::kNotFound);
}

// Behind a checksum that is right again, each byte of the structure is turned: no such file may crash a query later, so
// it is either refused or has children and triangles that exist.
TEST(TriangleTree, ChecksWhatTheChecksumLetsThrough) {
  const auto mesh = mesh_of(geometry::make_mesh(geometry::Sphere{0.1}, 12));
  const std::vector<std::uint8_t> good = build(mesh).bytes();
  int refused = 0;
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::vector<std::uint8_t> bytes = good;
    bytes[i] ^= 0x5A;
    seal_tree_file(bytes);
    const auto tree = TriangleTree::from_bytes(bytes, mesh, {});
    if (!tree) {
      ++refused;
      continue;
    }
    for (std::size_t n = 0; n < tree->nodes().size(); ++n) {
      const TriangleTreeNode& node = tree->nodes()[n];
      const auto leaves = static_cast<std::size_t>(std::popcount(node.leaf_mask()));
      ASSERT_LE(node.child_count(), 16U);
      if (leaves > 0) {
        ASSERT_LE(node.first_leaf() + leaves, tree->blocks().size());
      }
      if (leaves < node.child_count()) {
        ASSERT_GT(node.first_child(), n);
        ASSERT_LE(node.first_child() + node.child_count() - leaves, tree->nodes().size());
      }
    }
  }
  EXPECT_GT(refused, static_cast<int>(good.size()) / 2);
}

TEST(TriangleTree, TakesAnyMesh) {
  // A single triangle; all the same; all without area; in a plane; far from the origin; tiny.
  geometry::TriangleMesh one{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  geometry::TriangleMesh same = one;
  same.triangles.assign(100, {0, 1, 2});
  geometry::TriangleMesh point = one;
  point.triangles.assign(100, {1, 1, 1});
  const geometry::TriangleMesh far = geometry::transformed(geometry::make_mesh(geometry::Sphere{0.1}),
                                                           geometry::Pose::from_translation({1e6, -1e6, 1e6}));
  const geometry::TriangleMesh tiny = geometry::scaled(geometry::make_mesh(geometry::Sphere{0.1}), 1e-30);
  for (const geometry::TriangleMesh& mesh : {one, same, point, far, tiny}) {
    const TriangleTree tree = build(mesh_of(mesh));
    std::size_t triangles = 0;
    for (const TriangleReferences& leaf : tree.references())
      triangles += 4 - static_cast<std::size_t>(std::count(leaf.begin(), leaf.end(), kNoTriangle));
    EXPECT_EQ(triangles, mesh.triangles.size());
  }
}

}  // namespace
}  // namespace prescene::collision
