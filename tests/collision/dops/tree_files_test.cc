// SPDX-License-Identifier: Apache-2.0
// Trees come back from their files bit for bit, and files that hold something else are refused.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dop_cases.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/random.h"
#include "tests/support/paths.h"

namespace prescene::collision {
namespace {

using core::StatusCode;

template <class T>
bool same(const Array<T>& a, const Array<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.bytes()) == 0);
}

bool same(const DopTree& a, const DopTree& b) {
  return same(a.nodes(), b.nodes()) && same(a.order(), b.order()) && a.bytes() == b.bytes() && a.space() == b.space() &&
         std::equal(a.planes(0), a.planes(static_cast<std::uint32_t>(a.nodes().size())), b.planes(0));
}
bool same(const SimdopTree& a, const SimdopTree& b) {
  return same(a.nodes(), b.nodes()) && same(a.leaf_begin(), b.leaf_begin()) && same(a.order(), b.order()) &&
         same(a.single_planes(), b.single_planes()) && same(a.half_planes(), b.half_planes()) && a.space() == b.space();
}
bool same(const BvhLiteTree& a, const BvhLiteTree& b) {
  return a.node_count() == b.node_count() && same(a.order(), b.order()) && a.root_planes() == b.root_planes() &&
         std::equal(a.node(0), a.node(static_cast<std::uint32_t>(a.node_count())), b.node(0));
}
bool same(const Boxtree& a, const Boxtree& b) {
  return same(a.nodes(), b.nodes()) && same(a.order(), b.order()) && a.box().low == b.box().low &&
         a.box().high == b.box().high && a.root().index == b.root().index && a.root().triangles == b.root().triangles;
}

bool ask(const DopTree& a, const DopTree& b, const Transform& X_AB) { return collide(a, b, X_AB); }
bool ask(const Boxtree& a, const Boxtree& b, const Transform& X_AB) { return collide(a, b, X_AB); }
bool ask(const SimdopTree& a, const SimdopTree& b, const Transform& X_AB) {
  QueryScratch scratch;
  return collide(a, b, X_AB, scratch);
}
bool ask(const BvhLiteTree& a, const BvhLiteTree& b, const Transform& X_AB) {
  BvhLiteScratch scratch;
  return collide(a, b, X_AB, scratch);
}

class TreeFiles : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "tree"; }

  template <class Tree, class Options>
  void expect_kept(const Options& options) {
    for (const DopCase& pair : dop_cases()) {
      const Tree tree = Tree::build(pair.a, options, pool_);
      ASSERT_TRUE(tree.save(path()).ok());
      const auto loaded = Tree::load(path(), pair.a, options);
      ASSERT_TRUE(loaded.ok()) << loaded.status().message();
      EXPECT_TRUE(same(tree, *loaded)) << pair.name;
      const auto from_memory = Tree::from_bytes(tree.file_bytes(), pair.a, options);
      ASSERT_TRUE(from_memory.ok()) << from_memory.status().message();
      EXPECT_TRUE(same(tree, *from_memory)) << pair.name;
      Options other = options;
      other.leaf_items += 1;
      EXPECT_EQ(Tree::load(path(), pair.a, other).status().code(), StatusCode::kInvalidInput);
      EXPECT_EQ(Tree::load(path(), pair.b, options).status().code(), StatusCode::kInvalidInput);
    }
  }

  // Files whose checksum is right though their content is not: either refused, or a tree on which queries end.
  template <class Tree, class Options>
  void expect_harmless(const Options& options) {
    const DopCase& pair = dop_cases()[2];
    const Tree right = Tree::build(pair.b, options, pool_);
    const std::vector<std::uint8_t> sound = Tree::build(pair.a, options, pool_).file_bytes();
    core::RandomStream random(1, core::Purpose::kTest);
    int refused = 0;
    for (int round = 0; round < 400; ++round) {
      std::vector<std::uint8_t> damaged = sound;
      for (int i = 0; i < 1 + round % 3; ++i)
        damaged[256 + random.uniform_below(damaged.size() - 256)] ^=
            static_cast<std::uint8_t>(1U << random.uniform_below(8));
      seal_tree_file(damaged);
      const auto loaded = Tree::from_bytes(damaged, pair.a, options);
      if (!loaded.ok()) {
        ++refused;
        continue;
      }
      for (std::size_t i = 0; i < 10; ++i) static_cast<void>(ask(*loaded, right, pair.poses[i].X_AB));
    }
    EXPECT_GT(refused, 0);
  }

  core::ThreadPool pool_{2};
  tests::ScratchDir folder_;
};

TEST_F(TreeFiles, KeepTreesBitForBit) {
  expect_kept<DopTree>(DopTreeOptions{.k = 18, .leaf_items = 2});
  expect_kept<SimdopTree>(SimdopOptions{});
  expect_kept<SimdopTree>(
      SimdopOptions{.k = 14, .branching = 4, .leaf_items = 3, .precision = PlanePrecision::kSingle});
  expect_kept<BvhLiteTree>(BvhLiteOptions{});
  expect_kept<BvhLiteTree>(BvhLiteOptions{.bits = 4, .branching = 16, .leaf_items = 4});
  expect_kept<Boxtree>(BoxtreeOptions{});
  expect_kept<Boxtree>(BoxtreeOptions{.leaf_items = 4});
}

TEST_F(TreeFiles, DamageDoesNoHarm) {
  expect_harmless<DopTree>(DopTreeOptions{.k = 6});
  expect_harmless<SimdopTree>(SimdopOptions{.k = 6, .branching = 4, .leaf_items = 2});
  expect_harmless<BvhLiteTree>(BvhLiteOptions{.k = 6, .bits = 4, .leaf_items = 2});
  expect_harmless<Boxtree>(BoxtreeOptions{});
  expect_harmless<Boxtree>(BoxtreeOptions{.leaf_items = 3});
}

/// Triangles along a line, each a half as far out as the next, and in the end 2^18 of which half are always twice as
/// far out as the others: as long as the middle is cut, each cut takes one triangle off; then all cuts are into equal
/// parts, and after each a box is far too wide. No mesh makes deeper trees.
std::shared_ptr<const Mesh> mesh_of_deep_trees() {
  constexpr int kDoubled = 18, kSingle = 48;
  std::vector<Vector3f> vertices;
  std::vector<TriangleIndices> triangles;
  const auto add = [&](int exponent) {
    const float x = std::ldexp(1.0F, exponent);
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vector3f& p : {Vector3f(x, x, x), Vector3f(1.01F * x, x, x), Vector3f(x, 1.01F * x, x)})
      vertices.push_back(p);
    triangles.push_back({first, first + 1, first + 2});
  };
  add(-80);
  for (int i = 0; i < kDoubled; ++i) {
    for (std::size_t more = triangles.size(); more > 0; --more) add(i - 79);
  }
  for (int i = 0; i < kSingle; ++i) add(kDoubled + i - 79);
  auto made = Mesh::make(std::move(vertices), std::move(triangles), "deep");
  EXPECT_TRUE(made.ok());
  return *made;
}

TEST_F(TreeFiles, KeepTheDeepestTrees) {
  const auto mesh = mesh_of_deep_trees();
  const auto expect_kept = [&]<class Tree>(const Tree& tree) {
    ASSERT_TRUE(tree.save(path()).ok());
    const auto loaded = Tree::load(path(), mesh, tree.options());
    EXPECT_TRUE(loaded.ok()) << loaded.status().message();
  };
  expect_kept(Boxtree::build(mesh, {.builder = Builder::kMiddle}, pool_));
  expect_kept(DopTree::build(mesh, {.k = 6, .builder = Builder::kMiddle}, pool_));
  expect_kept(SimdopTree::build(mesh, {.k = 6, .branching = 2, .builder = Builder::kMiddle}, pool_));
  expect_kept(BvhLiteTree::build(mesh, {.k = 6, .bits = 4, .branching = 2, .builder = Builder::kMiddle}, pool_));
  expect_kept(TriangleTree::build(mesh, {.builder = Builder::kMiddle}, pool_));
}

TEST_F(TreeFiles, SaysWhatIsMissing) {
  const DopCase& pair = dop_cases().front();
  EXPECT_EQ(SimdopTree::load(path(), pair.a, {}).status().code(), StatusCode::kNotFound);
  const Boxtree tree = Boxtree::build(pair.a, {}, pool_);
  EXPECT_EQ(tree.save(folder_.path() / "no" / "tree").code(), StatusCode::kNotFound);
  ASSERT_TRUE(tree.save(path()).ok());
  EXPECT_EQ(SimdopTree::load(path(), pair.a, {}).status().code(), StatusCode::kInvalidInput);
}

}  // namespace
}  // namespace prescene::collision
