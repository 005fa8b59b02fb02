// SPDX-License-Identifier: Apache-2.0
// The default tree against brute force by exact predicates and against FCL, on 10,000 configurations of each of a dozen
// pairs of meshes: scattered ones, and ones around poses that just touch; the trees of k-DOPs and boxes on every tenth
// of them. FCL decides in double precision on B's vertices before they are rounded, with tolerances of its own; where
// it says something else, the exact reference has the word.
#include <gmock/gmock.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/collision/batch_queries.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/geometry/primitives.h"
#include "tests/peers/mesh_collision.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/contact_configurations.h"
#include "tests/support/target_test.h"

namespace prescene::collision::triangle_queries_reference_test {
namespace {

using tests::PlacementMethod;

constexpr int kScattered = 4000;
constexpr int kTouching = 240;
constexpr int kAround = 25;  // each of the touching ones
// Brute force for all configurations of pairs with fewer triangles than this, else for every hundredth.
constexpr std::uint32_t kFewTriangles = 3000;

struct Compared {
  int configurations = 0;
  int colliding = 0;
  int by_brute_force = 0;
  int fcl_differs = 0;
  int wrong = 0;           ///< Answers of the tree that brute force refutes.
  int batch_differs = 0;   ///< Configurations that a batch answers otherwise than a single query.
  int trees_differ = 0;    ///< Answers of other trees, to every tenth configuration, that are not the default tree's.
  int targets_differ = 0;  ///< Configurations that instruction sets answer differently.
};

std::vector<Transform> make_configurations(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b,
                                           tests::MeshPairPeer* fcl) {
  tests::ContactConfigurations make(a, b,
                                    {[fcl](const Transform& X_AB) { return fcl->collide(X_AB); },
                                     [fcl](const Transform& X_AB) { return *fcl->distance(X_AB); }},
                                    1);
  std::vector<Transform> configurations = make.scattered(kScattered);
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    for (const Transform& X_AB : make.at_distance(0.0, kTouching / 2, method)) {
      const std::vector<Transform> around = make.around(X_AB, kAround);
      configurations.insert(configurations.end(), around.begin(), around.end());
    }
  }
  return configurations;
}

std::vector<bool> answers(const TriangleTree& a, const TriangleTree& b, const std::vector<Transform>& configurations) {
  QueryScratch scratch;
  std::vector<bool> collides;
  collides.reserve(configurations.size());
  for (const Transform& X_AB : configurations) collides.push_back(collide(a, b, X_AB, scratch));
  return collides;
}

/// The same sixteen at a time: those around one touching pose come after each other.
std::vector<bool> answers_of_batches(const TriangleTree& a, const TriangleTree& b,
                                     const std::vector<Transform>& configurations) {
  QueryScratch scratch;
  std::vector<bool> collides;
  for (std::size_t begin = 0; begin < configurations.size(); begin += 16) {
    const std::size_t count = std::min<std::size_t>(16, configurations.size() - begin);
    std::array<bool, 16> touching = {};
    collide(a, b, std::span(configurations).subspan(begin, count), std::span(touching).first(count), scratch);
    collides.insert(collides.end(), touching.begin(), touching.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return collides;
}

int differences(const std::vector<bool>& a, const std::vector<bool>& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i] ? 1 : 0;
  return count;
}

/// How often another kind of tree answers every tenth configuration differently.
template <class Tree, class Options, class Ask>
int differences_of_tree(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b,
                        const Options& options, const std::vector<Transform>& configurations,
                        const std::vector<bool>& expected, const Ask& ask) {
  constexpr std::size_t kStep = 10;
  core::ThreadPool pool(1);
  const Tree tree_a = Tree::build(a, options, pool), tree_b = Tree::build(b, options, pool);
  int count = 0;
  for (std::size_t i = 0; i < configurations.size(); i += kStep)
    count += ask(tree_a, tree_b, configurations[i]) != expected[i] ? 1 : 0;
  return count;
}

int differences_of_trees(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b,
                         const std::vector<Transform>& configurations, const std::vector<bool>& expected) {
  QueryScratch scratch;
  BvhLiteScratch bvhlite_scratch;
  const auto plain = [](const auto& tree_a, const auto& tree_b, const Transform& X_AB) {
    return collide(tree_a, tree_b, X_AB);
  };
  const auto simdop = [&](const SimdopTree& tree_a, const SimdopTree& tree_b, const Transform& X_AB) {
    return collide(tree_a, tree_b, X_AB, scratch);
  };
  const auto bvhlite = [&](const BvhLiteTree& tree_a, const BvhLiteTree& tree_b, const Transform& X_AB) {
    return collide(tree_a, tree_b, X_AB, bvhlite_scratch);
  };
  int count = differences_of_tree<DopTree>(a, b, DopTreeOptions{}, configurations, expected, plain);
  count += differences_of_tree<Boxtree>(a, b, BoxtreeOptions{}, configurations, expected, plain);
  for (const PlanePrecision precision : {PlanePrecision::kSingle, PlanePrecision::kHalf})
    count +=
        differences_of_tree<SimdopTree>(a, b, SimdopOptions{.precision = precision}, configurations, expected, simdop);
  return count + differences_of_tree<BvhLiteTree>(a, b, BvhLiteOptions{.bits = 4}, configurations, expected, bvhlite);
}

Compared compare(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b) {
  core::ThreadPool pool(1);
  const TriangleTree tree_a = TriangleTree::build(a, {}, pool), tree_b = TriangleTree::build(b, {}, pool);
  const std::unique_ptr<tests::MeshPairPeer> fcl = tests::make_fcl_pair(a, b, tests::FclVolume::kObbRss);
  const bool few = a->triangle_count() + b->triangle_count() < kFewTriangles;
  const std::vector<Transform> configurations = make_configurations(a, b, fcl.get());
  const std::vector<bool> by_tree = answers(tree_a, tree_b, configurations);
  Compared compared;
  for (std::size_t i = 0; i < configurations.size(); ++i) {
    const bool by_fcl = fcl->collide(configurations[i]);
    compared.fcl_differs += by_tree[i] != by_fcl ? 1 : 0;
    compared.colliding += by_tree[i] ? 1 : 0;
    if (few || i % 100 == 0 || by_tree[i] != by_fcl) {
      ++compared.by_brute_force;
      compared.wrong += by_tree[i] != tests::collide_by_brute_force(*a, *b, configurations[i]) ? 1 : 0;
    }
  }
  compared.trees_differ = differences_of_trees(a, b, configurations, by_tree);
  compared.configurations = static_cast<int>(configurations.size());
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const UseTarget only(target);
    compared.targets_differ += differences(answers(tree_a, tree_b, configurations), by_tree);
    compared.batch_differs += differences(answers_of_batches(tree_a, tree_b, configurations), by_tree);
  }
  return compared;
}

void expect_same_answers(const std::shared_ptr<const Mesh>& a, const std::shared_ptr<const Mesh>& b) {
  const Compared compared = compare(a, b);
  std::printf(
      "compared: %s and %s (%u and %u triangles): %d configurations with FCL, %d of them with brute force; %d collide; "
      "FCL differs in %d\n",
      a->name().c_str(), b->name().c_str(), a->triangle_count(), b->triangle_count(), compared.configurations,
      compared.by_brute_force, compared.colliding, compared.fcl_differs);
  EXPECT_EQ(compared.wrong, 0);
  EXPECT_EQ(compared.trees_differ, 0);
  EXPECT_EQ(compared.targets_differ, 0);
  EXPECT_EQ(compared.batch_differs, 0);
  EXPECT_EQ(compared.configurations, kScattered + kTouching * kAround);
  // Both answers are frequent.
  EXPECT_GT(compared.colliding, compared.configurations / 10);
  EXPECT_LT(compared.colliding, compared.configurations * 9 / 10);
  // FCL errs on the verge of contact only.
  EXPECT_LT(compared.fcl_differs, compared.configurations / 50);
}

struct Files {
  std::string_view a;
  std::string_view b;
};

class RecordedPairs : public testing::TestWithParam<Files> {};

TEST_P(RecordedPairs, AnswerAsBruteForceAndFcl) {
  const std::shared_ptr<const Mesh> a = tests::read_collision_mesh(GetParam().a),
                                    b = tests::read_collision_mesh(GetParam().b);
  if (a == nullptr || b == nullptr) GTEST_SKIP() << tests::missing_meshes_message();
  expect_same_answers(a, b);
}

INSTANTIATE_TEST_SUITE_P(TriangleQueries, RecordedPairs,
                         testing::Values(Files{"household/milk_carton.ply", "household/cereal_box.ply"},
                                         Files{"household/drinking_glass.ply", "household/plate_8in.ply"},
                                         Files{"household/lemon.ply", "robot/panda_finger_visual.ply"},
                                         Files{"household/dustbin.ply",
                                               "household/ycb_power_drill_collision_parts.ply"},
                                         Files{"robot/allegro_finger_tip.ply", "robot/robotiq_2f85_driver.ply"},
                                         Files{"household/ycb_mug.ply", "household/ycb_spoon.ply"},
                                         Files{"robot/robotiq_2f85_base.ply", "robot/iiwa14_link7.ply"},
                                         Files{"scans/happy_buddha.ply", "scans/spot_cow.ply"}),
                         [](const testing::TestParamInfo<Files>& files) {
                           return std::filesystem::path(files.param.a).stem().string() + "_" +
                                  std::filesystem::path(files.param.b).stem().string();
                         });

class MadePairs : public testing::TestWithParam<int> {};
constexpr std::array<const char*, 4> kMadePairs = {"closed", "open", "flat", "large"};

TEST_P(MadePairs, AnswerAsBruteForceAndFcl) {
  const auto mesh = [](const geometry::TriangleMesh& made, const char* name) {
    return tests::collision_mesh(made, name);
  };
  switch (GetParam()) {
    case 0:
      return expect_same_answers(mesh(tests::make_bumpy_sphere(0.1, 1500), "bumpy_sphere"),
                                 mesh(tests::make_knot(0.1, 1200), "knot"));
    case 1:
      return expect_same_answers(mesh(tests::make_wavy_sheet(0.2, 1000), "wavy_sheet"),
                                 mesh(tests::make_wavy_sheet(0.1, 1000), "small_wavy_sheet"));
    case 2:
      // Coplanar faces and shared edges in plenty.
      return expect_same_answers(mesh(geometry::make_open_bin({0.1, 0.15, 0.05}, 0.005), "bin"),
                                 mesh(geometry::make_mesh(geometry::BoxShape{{0.05, 0.05, 0.05}}), "box"));
    default:
      return expect_same_answers(mesh(tests::make_bumpy_sphere(0.1, 60'000), "bumpy_sphere"),
                                 mesh(tests::make_knot(0.1, 40'000), "knot"));
  }
}

INSTANTIATE_TEST_SUITE_P(TriangleQueries, MadePairs, testing::Range(0, 4), [](const testing::TestParamInfo<int>& pair) {
  return std::string(kMadePairs[static_cast<std::size_t>(pair.param)]);
});

}  // namespace
}  // namespace prescene::collision::triangle_queries_reference_test
