// SPDX-License-Identifier: Apache-2.0
// The clustering builders: what they are for, and that every instruction set makes the same tree.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>

#include "prescene/collision/hierarchy.h"
#include "prescene/core/random.h"
#include "tests/support/target_test.h"

namespace prescene::collision::neural_gas_test {
namespace {

Item point(float x, float y, float z, float weight) {
  return {.low = {x, y, z}, .high = {x, y, z}, .centre = {x, y, z}, .weight = weight};
}

TEST(NeuralGas, FindsClustersThatAxesCannotSeparate) {
  core::RandomStream random(1, core::Purpose::kTest);
  std::vector<Item> items;
  constexpr std::size_t kEach = 300;
  for (std::size_t i = 0; i < 5 * kEach; ++i) {
    const std::size_t cluster = i % 5;  // A cross of five.
    const float x = cluster == 1 ? 1.0F : cluster == 2 ? -1.0F : 0.0F;
    const float y = cluster == 3 ? 1.0F : cluster == 4 ? -1.0F : 0.0F;
    const auto off_z = static_cast<float>(random.normal()), off_y = static_cast<float>(random.normal()),
               off_x = static_cast<float>(random.normal());
    items.push_back(point(x + 0.2F * off_x, y + 0.2F * off_y, 0.2F * off_z, 1.0F));
  }
  core::ThreadPool pool(2);
  const Hierarchy tree = build_hierarchy(items, {.builder = Builder::kNeuralGas, .branching = 5}, pool);
  ASSERT_EQ(tree.nodes[0].child_count, 5U);
  for (std::uint32_t child = 1; child <= 5; ++child) {
    std::array<std::size_t, 5> counts = {};
    for (std::uint32_t i = tree.nodes[child].begin; i < tree.nodes[child].end; ++i) ++counts[tree.order[i] % 5];
    EXPECT_GT(*std::max_element(counts.begin(), counts.end()), kEach * 95 / 100);
  }
}

TEST(NeuralGas, WeightsDrawPrototypes) {
  core::RandomStream random(2, core::Purpose::kTest);
  std::vector<Item> items;
  for (int i = 0; i < 4000; ++i) {
    const auto x = static_cast<float>(random.uniform(0.0, 1.0));
    const auto y = static_cast<float>(random.uniform(0.0, 1.0));
    items.push_back(point(x, y, 0.0F, x < 0.5F ? 20.0F : 1.0F));
  }
  core::ThreadPool pool(2);
  const auto parts_on_heavy_side = [&](Builder builder) {
    const Hierarchy tree = build_hierarchy(items, {.builder = builder, .branching = 16}, pool);
    int parts = 0;
    for (std::uint32_t child = 1; child <= tree.nodes[0].child_count; ++child) {
      double x = 0.0;
      for (std::uint32_t i = tree.nodes[child].begin; i < tree.nodes[child].end; ++i)
        x += static_cast<double>(items[tree.order[i]].centre[0]);
      parts += x / (tree.nodes[child].end - tree.nodes[child].begin) < 0.5 ? 1 : 0;
    }
    return parts;
  };
  EXPECT_NEAR(parts_on_heavy_side(Builder::kNeuralGas), 8, 1);
  EXPECT_GE(parts_on_heavy_side(Builder::kWeightedNeuralGas), 11);
}

TEST(NeuralGas, IsTheSameForEveryInstructionSet) {
  core::RandomStream random(3, core::Purpose::kTest);
  std::vector<Item> items;
  for (int i = 0; i < 3000; ++i) {
    const auto weight = static_cast<float>(random.uniform(0.0, 1.0));
    const auto z = static_cast<float>(random.normal()), y = static_cast<float>(random.normal()),
               x = static_cast<float>(random.normal());
    items.push_back(point(x, y, z, weight));
  }
  core::ThreadPool pool(2);
  const HierarchyOptions options{.builder = Builder::kWeightedNeuralGas, .branching = 11};
  const Hierarchy tree = build_hierarchy(items, options, pool);
  for (const auto target : hwy::SupportedAndGeneratedTargets()) {
    const UseTarget only(target);
    EXPECT_EQ(build_hierarchy(items, options, pool).order, tree.order) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace prescene::collision::neural_gas_test
