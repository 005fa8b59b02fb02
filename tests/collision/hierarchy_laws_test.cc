// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/hierarchy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prescene/core/random.h"

namespace prescene::collision::hierarchy_laws_test {
namespace {

std::vector<Item> random_items(std::size_t count, std::uint64_t seed) {
  core::RandomStream random(seed, core::Purpose::kTest);
  std::vector<Item> items(count);
  for (Item& item : items) {
    for (std::size_t k = 0; k < 3; ++k) {
      item.centre[k] = static_cast<float>(random.uniform(-1.0, 1.0) * (k == 1 ? 3.0 : 1.0));
      item.low[k] = item.centre[k] - static_cast<float>(random.uniform(0.0, 0.05));
      item.high[k] = item.centre[k] + static_cast<float>(random.uniform(0.0, 0.05));
    }
    item.weight = static_cast<float>(random.uniform(0.0, 1.0));
  }
  return items;
}

// Every item is in one leaf, children divide their parent's range, no node or leaf is larger than allowed.
void expect_sound(const Hierarchy& tree, std::size_t count, const HierarchyOptions& options) {
  std::vector<std::uint32_t> sorted = tree.order;
  std::sort(sorted.begin(), sorted.end());
  ASSERT_EQ(sorted.size(), count);
  for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(sorted[i], i);

  std::vector<bool> reached(tree.nodes.size(), false);
  reached[0] = true;
  ASSERT_EQ(tree.nodes[0].begin, 0U);
  ASSERT_EQ(tree.nodes[0].end, count);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const Hierarchy::Node& node = tree.nodes[i];
    ASSERT_TRUE(reached[i]);
    ASSERT_LT(node.begin, node.end);
    if (node.is_leaf()) {
      ASSERT_LE(node.end - node.begin, static_cast<std::uint32_t>(options.leaf_items));
      continue;
    }
    ASSERT_GE(node.child_count, 2U);
    ASSERT_LE(node.child_count, static_cast<std::uint32_t>(options.branching));
    ASSERT_GT(node.first_child, i);
    ASSERT_LE(node.first_child + node.child_count, tree.nodes.size());
    std::uint32_t place = node.begin;
    for (std::uint32_t k = node.first_child; k < node.first_child + node.child_count; ++k) {
      ASSERT_FALSE(reached[k]);
      reached[k] = true;
      ASSERT_EQ(tree.nodes[k].begin, place);
      place = tree.nodes[k].end;
    }
    ASSERT_EQ(place, node.end);
  }
}

bool same(const Hierarchy& a, const Hierarchy& b) {
  return a.order == b.order &&
         std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(), [](const auto& x, const auto& y) {
           return x.begin == y.begin && x.end == y.end && x.first_child == y.first_child &&
                  x.child_count == y.child_count;
         });
}

std::size_t depth(const Hierarchy& tree, std::size_t node = 0) {
  std::size_t deepest = 0;
  for (std::uint32_t k = 0; k < tree.nodes[node].child_count; ++k)
    deepest = std::max(deepest, 1 + depth(tree, tree.nodes[node].first_child + k));
  return deepest;
}

class HierarchyLaws : public ::testing::TestWithParam<Builder> {
 protected:
  core::ThreadPool pool_{2};
};

INSTANTIATE_TEST_SUITE_P(Builders, HierarchyLaws, ::testing::ValuesIn(kAllBuilders), [](const auto& builder) {
  std::string name(to_string(builder.param));
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

TEST_P(HierarchyLaws, EveryItemIsInOneLeaf) {
  for (const std::size_t count : {1U, 2U, 3U, 16U, 17U, 100U, 5000U}) {
    const std::vector<Item> items = random_items(count, count);
    for (int branching = 2; branching <= 16; ++branching) {
      for (const int leaf_items : {1, 4, 64}) {
        const HierarchyOptions options{.builder = GetParam(), .branching = branching, .leaf_items = leaf_items};
        SCOPED_TRACE(std::to_string(count) + " items, branching " + std::to_string(branching));
        expect_sound(build_hierarchy(items, options, pool_), count, options);
        if (HasFatalFailure()) return;
      }
    }
  }
}

TEST_P(HierarchyLaws, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Item> items = random_items(70'000, 3);
  for (const int branching : {2, 16}) {
    const HierarchyOptions options{.builder = GetParam(), .branching = branching, .leaf_items = 3};
    core::ThreadPool one(1);
    const Hierarchy tree = build_hierarchy(items, options, one);
    expect_sound(tree, items.size(), options);
    for (const int threads : {2, 3, 8}) {
      core::ThreadPool several(threads);
      EXPECT_TRUE(same(build_hierarchy(items, options, several), tree)) << threads << " threads";
    }
  }
}

TEST_P(HierarchyLaws, EndsWhateverTheItems) {
  const std::size_t count = 5000;
  std::vector<std::vector<Item>> inputs;
  inputs.emplace_back(count, Item{.low = {1, 2, 3}, .high = {1, 2, 3}, .centre = {1, 2, 3}, .weight = 0.0F});
  for (const float scale : {1e9F, 1e-30F, 1e-42F}) {
    inputs.push_back(random_items(count, 5));
    for (Item& item : inputs.back()) {
      for (std::size_t k = 0; k < 3; ++k) {
        item.low[k] *= scale;
        item.high[k] *= scale;
        item.centre[k] *= scale;
      }
      item.weight *= std::max(scale * scale, 0.0F);
    }
  }
  // Each twice as far as the one before: halving in the middle takes off a few items only.
  std::vector<Item>& spread = inputs.emplace_back(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float x = std::ldexp(1e9F, -static_cast<int>(i % 170));
    spread[i] = {.low = {x, 0, 0}, .high = {x, 0, 0}, .centre = {x, 0, 0}, .weight = 1.0F};
  }
  // Huge items around the same centre.
  std::vector<Item>& nested = inputs.emplace_back(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float r = static_cast<float>(i);
    nested[i] = {.low = {-r, -r, -r}, .high = {r, r, r}, .centre = {0, 0, 0}, .weight = r};
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (const int branching : {2, 5, 16}) {
      SCOPED_TRACE("input " + std::to_string(i) + ", branching " + std::to_string(branching));
      const HierarchyOptions options{.builder = GetParam(), .branching = branching, .leaf_items = 2};
      const Hierarchy tree = build_hierarchy(inputs[i], options, pool_);
      expect_sound(tree, count, options);
      if (HasFatalFailure()) return;
      EXPECT_LE(depth(tree), 64U);
    }
  }
}

TEST_P(HierarchyLaws, EndsForAMillionItems) {
  const std::vector<Item> items = random_items(1'000'000, 9);
  const HierarchyOptions options{.builder = GetParam(), .branching = 16, .leaf_items = 8};
  expect_sound(build_hierarchy(items, options, pool_), items.size(), options);
}

}  // namespace
}  // namespace prescene::collision::hierarchy_laws_test
