// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_tree.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "prescene/collision/distance_queries.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/paths.h"

namespace prescene::collision::triangle_tree_test {
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

/// Queries that end and stay inside of arrays, whatever they answer.
void query(const TriangleTree& damaged, const TriangleTree& sound) {
  QueryScratch scratch;
  std::vector<TrianglePair> pairs;
  for (const float x : {0.0F, 0.05F, 0.19F, 0.3F}) {
    Transform X;
    X.translation = {x, 0.01F, 0.02F};
    static_cast<void>(collide(damaged, sound, X, scratch));
    static_cast<void>(collide(sound, damaged, X, scratch));
    pairs.clear();
    all_pairs(damaged, sound, X, 1000, &pairs, scratch);
    static_cast<void>(distance(damaged, sound, X, {}, scratch));
    static_cast<void>(distance(sound, damaged, X, {}, scratch));
    const Ray ray{.origin = {-1.0, static_cast<double>(x), 0.01}, .direction = {1.0, 0.01, 0.02}};
    static_cast<void>(nearest_hit(damaged, ray, scratch));
  }
}

// Behind a checksum that is right again, each byte is turned, and some bits at random: such files are either refused or
// have trees on which queries do no harm.
TEST(TriangleTree, ChecksWhatTheChecksumLetsThrough) {
  const auto mesh = mesh_of(geometry::make_mesh(geometry::Sphere{0.1}, 12));
  const TriangleTree sound = build(mesh);
  const std::vector<std::uint8_t> good = sound.bytes();
  core::RandomStream random(1, core::Purpose::kTest);
  std::size_t refused = 0;
  for (std::size_t round = 0; round < 2 * good.size(); ++round) {
    std::vector<std::uint8_t> bytes = good;
    if (round < good.size()) {
      bytes[round] ^= 0x5A;
    } else {
      for (std::size_t i = 0; i < 1 + round % 3; ++i)
        bytes[random.uniform_below(bytes.size())] ^= static_cast<std::uint8_t>(1U << random.uniform_below(8));
    }
    seal_tree_file(bytes);
    const auto tree = TriangleTree::from_bytes(bytes, mesh, {});
    if (tree) {
      query(*tree, sound);
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, good.size());
}

// Children that several nodes share would be visited as often as there are ways to them: 16 to the power of the depth.
TEST(TriangleTree, RefusesChildrenOfTwoNodes) {
  const auto mesh = mesh_of(tests::make_bumpy_sphere(0.1, 2000));
  const TriangleTree tree = build(mesh);
  std::vector<std::uint8_t> bytes = tree.bytes();
  std::uint32_t moved = 0;
  for (std::uint32_t i = 0; i < tree.nodes().size(); ++i) {
    TriangleTreeNode node = tree.nodes()[i];
    const std::uint32_t children = node.child_count() - static_cast<std::uint32_t>(std::popcount(node.leaf_mask()));
    if (children == 0 || node.first_child() == i + 1 || i + 1 + children > tree.nodes().size()) continue;
    const auto* as_bytes = reinterpret_cast<const std::uint8_t*>(&tree.nodes()[i]);
    const auto at = std::search(bytes.begin(), bytes.end(), as_bytes, as_bytes + sizeof node);
    ASSERT_NE(at, bytes.end());
    node.first_child_word = TriangleTreeNode::kWordBit | (i + 1);
    std::memcpy(&*at, &node, sizeof node);
    ++moved;
  }
  ASSERT_GT(moved, 0U);
  seal_tree_file(bytes);
  EXPECT_EQ(TriangleTree::from_bytes(bytes, mesh, {}).status().code(), core::StatusCode::kDataLoss);
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
}  // namespace prescene::collision::triangle_tree_test
