// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_tree_file.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/paths.h"

namespace prescene::collision::sphere_tree_file_test {
namespace {

using ::testing::HasSubstr;

class SphereTreeFile : public ::testing::Test {
 protected:
  void SetUp() override {
    packed_ = *pack_spheres(*mesh_, packing_options_, pool_);
    tree_ = *SphereTree::make(packed_.packing, tree_options_, pool_);
    ASSERT_TRUE(write_sphere_tree(path_, *mesh_, packing_options_, *tree_, packed_.report).ok());
  }

  std::vector<std::uint8_t> bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void write(const std::vector<std::uint8_t>& bytes) const {
    std::ofstream file(path_, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  core::ThreadPool pool_{2};
  std::shared_ptr<const Mesh> mesh_ = *Mesh::make(geometry::make_mesh(geometry::Cone{0.1, 0.2}), "cone");
  PackingOptions packing_options_{.max_spheres = 100, .edge_fidelity = 0.01};
  SphereTreeOptions tree_options_{.branching = 8};
  const tests::ScratchDir folder_;
  const std::filesystem::path path_ = folder_.path() / "tree";
  PackedMesh packed_;
  std::shared_ptr<const SphereTree> tree_;
};

TEST_F(SphereTreeFile, KeepsEveryBit) {
  const auto kept = read_sphere_tree(path_, *mesh_, packing_options_, tree_options_);
  ASSERT_TRUE(kept.ok()) << kept.status().message();
  const SphereTree& tree = *kept->tree;
  EXPECT_TRUE(std::ranges::equal(tree.nodes(), tree_->nodes()));
  EXPECT_TRUE(std::ranges::equal(tree.lanes(), tree_->lanes()));
  EXPECT_TRUE(std::ranges::equal(tree.order(), tree_->order()));
  EXPECT_EQ(tree.root(), tree_->root());
  EXPECT_EQ(tree.depth(), tree_->depth());
  EXPECT_EQ(tree.packing().content_hash(), tree_->packing().content_hash());
  EXPECT_EQ(tree.packing().volume(), tree_->packing().volume());
  EXPECT_EQ(kept->report, packed_.report);
  SphereScratch scratch;
  EXPECT_EQ(overlap_volume(tree, *tree_, Transform(), scratch).volume,
            overlap_volume(*tree_, *tree_, Transform(), scratch).volume);
}

TEST_F(SphereTreeFile, BelongsToItsMeshAndSettings) {
  PackingOptions other = packing_options_;
  other.max_spheres = 101;
  EXPECT_FALSE(read_sphere_tree(path_, *mesh_, other, tree_options_).ok());
  EXPECT_FALSE(read_sphere_tree(path_, *mesh_, packing_options_, {.branching = 16}).ok());
  const auto another = *Mesh::make(geometry::make_mesh(geometry::Cone{0.1, 0.3}), "cone");
  EXPECT_FALSE(read_sphere_tree(path_, *another, packing_options_, tree_options_).ok());
  EXPECT_EQ(read_sphere_tree(path_.string() + ".none", *mesh_, packing_options_, tree_options_).status().code(),
            core::StatusCode::kNotFound);
}

// Sealed again after each change, so that only what is checked behind the checksum can catch it.
TEST_F(SphereTreeFile, SurvivesAnyBytes) {
  const std::vector<std::uint8_t> good = bytes();
  core::RandomStream stream(1, core::Purpose::kTest);
  SphereScratch scratch;
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> bad = good;
    for (int k = 0; k < 3; ++k) bad[stream.uniform_below(bad.size())] = static_cast<std::uint8_t>(stream.next_u32());
    seal_tree_file(bad);
    write(bad);
    const auto kept = read_sphere_tree(path_, *mesh_, packing_options_, tree_options_);
    if (!kept) {
      ++refused;
      EXPECT_THAT(kept.status().message(), HasSubstr(path_.string()));
      continue;
    }
    overlap_volume(*kept->tree, *tree_, Transform(), scratch);
    distance(*kept->tree, *tree_, Transform(), scratch);
  }
  EXPECT_GT(refused, 30);
}

TEST(SphereTreeRestore, RefusesPartsThatAreNoTree) {
  core::ThreadPool pool(1);
  std::vector<PackedSphere> spheres(40, {Vector3f::Zero(), 0.1F});
  for (std::size_t i = 0; i < spheres.size(); ++i) spheres[i].centre.x() = static_cast<float>(i);
  const std::vector<SurfaceAnchor> anchors(40, {Vector3f::UnitX(), Vector3f::UnitX()});
  const auto packing = *SpherePacking::make(spheres, anchors, "row");
  const auto tree = *SphereTree::make(packing, {}, pool);
  const std::vector<SphereTree::Node> nodes(tree->nodes().begin(), tree->nodes().end());
  const auto status = [&](const auto& change) {
    std::vector<SphereTree::Node> changed = nodes;
    change(changed);
    SphereTree::Parts parts = tree->parts();
    parts.nodes = Array<SphereTree::Node>(changed);
    return SphereTree::restore(packing, {}, parts).status();
  };
  EXPECT_TRUE(status([](auto&) {}).ok());
  EXPECT_EQ(status([](auto& n) { n[0].count = 17; }).code(), core::StatusCode::kDataLoss);
  EXPECT_EQ(status([](auto& n) { n[0].first = 0; }).code(), core::StatusCode::kDataLoss);
  EXPECT_EQ(status([](auto& n) { n[0].first = 1000; }).code(), core::StatusCode::kDataLoss);
  EXPECT_EQ(status([](auto& n) { n[0].count -= 1; }).code(), core::StatusCode::kDataLoss);
  EXPECT_EQ(status([](auto& n) { n[1].first = n[2].first; }).code(), core::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace prescene::collision::sphere_tree_file_test
