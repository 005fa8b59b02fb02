// SPDX-License-Identifier: Apache-2.0
#include "box_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "prescene/core/check.h"

namespace prescene::geometry {

BoxTree::BoxTree(const std::vector<ItemBox>& items, std::size_t leaf_size) : order_(items.size()) {
  PRESCENE_CHECK(!items.empty() && leaf_size >= 1 && items.size() < (std::size_t{1} << 31));
  std::iota(order_.begin(), order_.end(), 0U);
  while ((items.size() + first_leaf_ - 1) / first_leaf_ > leaf_size) first_leaf_ *= 2;
  nodes_.resize(2 * static_cast<std::size_t>(first_leaf_));
  leaf_begin_.resize(first_leaf_ + 1);
  leaf_begin_.back() = static_cast<std::uint32_t>(items.size());
  build(items, 1, 0, items.size());
}

void BoxTree::build(const std::vector<ItemBox>& items, std::uint32_t node, std::size_t begin, std::size_t end) {
  constexpr double kFar = std::numeric_limits<double>::infinity();  // An empty node is nearer to nothing.
  ItemBox box{Vector3d::Constant(kFar), Vector3d::Constant(-kFar)};
  ItemBox centres = box;
  for (std::size_t i = begin; i < end; ++i) {
    const ItemBox& item = items[order_[i]];
    box.low = box.low.cwiseMin(item.low);
    box.high = box.high.cwiseMax(item.high);
    centres.low = centres.low.cwiseMin(item.low + item.high);
    centres.high = centres.high.cwiseMax(item.low + item.high);
  }
  nodes_[node].low << box.low, 0.0;
  nodes_[node].high << box.high, 0.0;
  if (node >= first_leaf_) {
    leaf_begin_[node - first_leaf_] = static_cast<std::uint32_t>(begin);
    return;
  }
  Eigen::Index axis = 0;
  (centres.high - centres.low).maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin + 1) / 2;
  const auto at = [this](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(std::min(middle, end)), at(end), [&](std::uint32_t a, std::uint32_t b) {
    const double x = items[a].low[axis] + items[a].high[axis];
    const double y = items[b].low[axis] + items[b].high[axis];
    return x != y ? x < y : a < b;
  });
  // nth_element leaves each half in an order of the library's choice; results must not depend on it.
  if (2 * node >= first_leaf_) {
    std::sort(at(begin), at(middle));
    std::sort(at(middle), at(end));
  }
  build(items, 2 * node, begin, middle);
  build(items, 2 * node + 1, middle, end);
}

}  // namespace prescene::geometry
