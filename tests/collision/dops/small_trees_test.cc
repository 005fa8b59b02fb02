// SPDX-License-Identifier: Apache-2.0
// The trees that are made to be small: how small they are, and that their rounded volumes contain the exact ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dop_cases.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "tests/support/collision_meshes.h"

namespace prescene::collision {
namespace {

class SmallTrees : public ::testing::Test {
 protected:
  core::ThreadPool pool_{2};
};

using Planes = BvhLiteTree::Planes;

// The triangles below a node, all of whose vertices are found inside the node's volume.
std::vector<std::uint32_t> expect_contained(const BvhLiteTree& tree, std::uint32_t node, const Planes& planes) {
  std::vector<std::uint32_t> triangles;
  const std::uint32_t reference = tree.reference(node);
  std::uint32_t at = reference & BvhLiteTree::kNumber;
  if ((reference & BvhLiteTree::kLeaf) != 0) {
    do {
      triangles.push_back(tree.order()[at] & ~BvhLiteTree::kLastTriangle);
    } while ((tree.order()[at++] & BvhLiteTree::kLastTriangle) == 0);
  } else {
    std::uint32_t child = at;
    do {
      const auto below = expect_contained(tree, child, tree.planes_below(child, planes));
      triangles.insert(triangles.end(), below.begin(), below.end());
    } while ((tree.reference(child++) & BvhLiteTree::kLastSibling) == 0);
  }
  const DopDirections& directions = DopDirections::of(tree.options().k);
  for (const std::uint32_t triangle : triangles) {
    for (const Vector3f& corner : tree.mesh().corners(triangle)) {
      for (std::size_t s = 0; s < static_cast<std::size_t>(tree.options().k); ++s) {
        const DopAxis d = directions.direction(s % 2 == 0 ? s / 2 : directions.axes().size() + s / 2);
        double along = 0.0;
        for (std::size_t c = 0; c < 3; ++c) {
          along += d[c] *
                   (static_cast<double>(corner[static_cast<int>(c)]) - static_cast<double>(tree.space().centre[c])) *
                   static_cast<double>(tree.space().inverse_length);
        }
        EXPECT_GE(static_cast<double>(planes[s]), along - 1e-15) << "node " << node << ", plane " << s;
      }
    }
  }
  return triangles;
}

TEST_F(SmallTrees, BvhLiteVolumesContainTheirTriangles) {
  for (const DopCase& pair : dop_cases()) {
    for (const int bits : {4, 6, 8}) {
      for (const int branching : {4, 16}) {
        const BvhLiteTree tree =
            BvhLiteTree::build(pair.a, {.k = 46, .bits = bits, .branching = branching, .leaf_items = 2}, pool_);
        std::vector<std::uint32_t> triangles = expect_contained(tree, 0, tree.root_planes());
        std::sort(triangles.begin(), triangles.end());
        ASSERT_EQ(triangles.size(), pair.a->triangle_count());
        for (std::uint32_t i = 0; i < triangles.size(); ++i) ASSERT_EQ(triangles[i], i);
      }
    }
  }
}

// Against 46 planes of 32 bits and four references.
TEST_F(SmallTrees, BvhLiteNodesAreSmall) {
  const auto mesh = tests::collision_mesh(tests::make_bumpy_sphere(0.1, 1000), "bumpy sphere");
  const BvhLiteTree four = BvhLiteTree::build(mesh, {.k = 46, .bits = 4}, pool_);
  const BvhLiteTree six = BvhLiteTree::build(mesh, {.k = 46, .bits = 6}, pool_);
  constexpr double kPlainBits = 46 * 32 + 4 * 32;
  EXPECT_LE(8.0 * static_cast<double>(four.stride()) / kPlainBits, 0.16);
  EXPECT_LE(8.0 * static_cast<double>(six.stride()) / kPlainBits, 0.22);
  EXPECT_EQ(four.bytes(), four.stride() * four.node_count() + 16 + 4 * mesh->triangle_count() + sizeof(Planes));
}

void expect_contained(const Boxtree& tree, Boxtree::Child node, BoxtreeBox box, std::vector<std::uint32_t>& triangles) {
  tree.trim(node, box);
  const std::size_t before = triangles.size();
  if (node.triangles > 0) {
    for (std::uint32_t i = 0; i < node.triangles; ++i) triangles.push_back(tree.triangle(node, i));
  } else {
    const auto boxes = tree.halves(node, box);
    const auto children = tree.children(node);
    if (children[0].triangles == 0) {
      EXPECT_EQ(children[0].index, node.index + 1);
    } else if (children[1].triangles == 0) {
      EXPECT_EQ(children[1].index, node.index + 1);
    }
    expect_contained(tree, children[0], boxes[0], triangles);
    expect_contained(tree, children[1], boxes[1], triangles);
  }
  for (std::size_t i = before; i < triangles.size(); ++i) {
    for (const Vector3f& corner : tree.mesh().corners(triangles[i])) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_GE(corner[static_cast<int>(c)], box.low[c]);
        EXPECT_LE(corner[static_cast<int>(c)], box.high[c]);
      }
    }
  }
}

TEST_F(SmallTrees, BoxtreeVolumesContainTheirTriangles) {
  for (const DopCase& pair : dop_cases()) {
    for (const int leaf_items : {1, 5}) {
      const Boxtree tree = Boxtree::build(pair.a, {.leaf_items = leaf_items}, pool_);
      std::vector<std::uint32_t> triangles;
      expect_contained(tree, tree.root(), tree.box(), triangles);
      std::sort(triangles.begin(), triangles.end());
      ASSERT_EQ(triangles.size(), pair.a->triangle_count());
      for (std::uint32_t i = 0; i < triangles.size(); ++i) ASSERT_EQ(triangles[i], i);
    }
  }
}

TEST_F(SmallTrees, BoxtreesAreSmall) {
  const auto mesh = tests::collision_mesh(tests::make_bumpy_sphere(0.1, 1000), "bumpy sphere");
  const Boxtree packed = Boxtree::build(mesh, {}, pool_);
  const auto trims = static_cast<std::uint32_t>(
      std::count_if(packed.nodes().begin(), packed.nodes().end(),
                    [](const Boxtree::Node& node) { return (node.header & 3U) == Boxtree::kTrims; }));
  EXPECT_EQ(packed.bytes(), 16U * (mesh->triangle_count() - 1 + trims));
  const PlainBoxtree plain = PlainBoxtree::build(mesh, Builder::kSurfaceAreaHeuristic, pool_);
  EXPECT_EQ(plain.node_count(), 2U * mesh->triangle_count() - 1);
  const double saved = 1.0 - static_cast<double>(packed.bytes()) / static_cast<double>(plain.bytes());
  EXPECT_GE(saved, 0.71);
}

}  // namespace
}  // namespace prescene::collision
