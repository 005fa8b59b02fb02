// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/dops/bvhlite_tree.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Planes = BvhLiteTree::Planes;

struct Record {
  std::uint32_t reference = 0;
  std::uint16_t least = 0;
  std::uint16_t most = 0;
};
static_assert(sizeof(Record) == 8);

float step_of(const Record& record, int bits) {
  const float inverse = 1.0F / static_cast<float>((1 << bits) - 1);
  return (from_half(record.most) - from_half(record.least)) * inverse;
}

float plane_of(float parent, float least, float step, std::uint32_t q) {
  return parent - (least + static_cast<float>(q) * step);
}

std::uint32_t get_bits(const std::uint8_t* payload, std::size_t index, int bits) {
  std::uint32_t value = 0;
  for (std::size_t bit = 0; bit < static_cast<std::size_t>(bits); ++bit) {
    const std::size_t place = index * static_cast<std::size_t>(bits) + bit;
    value |= (payload[place / 8] >> place % 8 & 1U) << bit;
  }
  return value;
}

void set_bits(std::uint8_t* payload, std::size_t index, int bits, std::uint32_t value) {
  for (std::size_t bit = 0; bit < static_cast<std::size_t>(bits); ++bit) {
    const std::size_t place = index * static_cast<std::size_t>(bits) + bit;
    payload[place / 8] = static_cast<std::uint8_t>(payload[place / 8] | (value >> bit & 1U) << place % 8);
  }
}

std::uint16_t round_down_to_half(double value) {
  return value > 0.0 ? static_cast<std::uint16_t>(round_up_to_half(-value) & 0x7FFFU) : std::uint16_t{0};
}

struct Quantised {
  Record record;
  std::array<std::uint32_t, 2 * kMostDopAxes> steps = {};
};

// Both bounds are rounded inward, so that no plane comes to lie inside the exact one; where the subtractions' own
// rounding would put one there, the plane moves a step out, and if there is none, all move.
Quantised quantise(std::span<const float> exact, const Planes& parent, int bits) {
  float least = parent[0] - exact[0];
  float most = least;
  for (std::size_t p = 1; p < exact.size(); ++p) {
    least = std::min(least, parent[p] - exact[p]);
    most = std::max(most, parent[p] - exact[p]);
  }
  Quantised result;
  result.record.least = round_down_to_half(static_cast<double>(least));
  result.record.most = std::max(result.record.least, round_down_to_half(static_cast<double>(most)));
  const auto highest = static_cast<float>((1 << bits) - 1);
  for (std::size_t p = 0; p < exact.size();) {
    const float low = from_half(result.record.least);
    const float step = step_of(result.record, bits);
    const float wanted = step > 0.0F ? std::floor((parent[p] - exact[p] - low) / step) : 0.0F;
    auto q = static_cast<std::uint32_t>(std::clamp(wanted, 0.0F, highest));
    while (q > 0 && plane_of(parent[p], low, step, q) < exact[p]) --q;
    if (plane_of(parent[p], low, step, q) < exact[p]) {
      PRESCENE_CHECK(result.record.least > 0);  // The parent's own plane is not inside.
      --result.record.least;
      p = 0;
      continue;
    }
    result.steps[p++] = q;
  }
  return result;
}

class LiteBuilder {
 public:
  LiteBuilder(const BvhLiteOptions& options, const Hierarchy& shape, const std::vector<float>& fitted,
              std::size_t stride)
      : options_(options), shape_(shape), fitted_(fitted), stride_(stride), k_(static_cast<std::size_t>(options.k)) {
    nodes.resize(shape.nodes.size() * stride + 16, 0);
    order = shape.order;
  }

  // The planes of a node as they were fitted, in this tree's order.
  std::array<float, 2 * kMostDopAxes> exact(std::uint32_t node) const {
    std::array<float, 2 * kMostDopAxes> planes = {};
    for (std::size_t p = 0; p < k_; ++p) planes[p] = fitted_[node * k_ + (p % 2 == 0 ? p / 2 : k_ / 2 + p / 2)];
    return planes;
  }

  void add(std::uint32_t node, const Planes& parent, bool last_sibling) {
    const Hierarchy::Node& from = shape_.nodes[node];
    const std::array<float, 2 * kMostDopAxes> planes = exact(node);
    Quantised quantised = quantise(std::span(planes).first(k_), parent, options_.bits);
    Record& record = quantised.record;
    record.reference = from.is_leaf() ? from.begin | BvhLiteTree::kLeaf : from.first_child;
    if (last_sibling) record.reference |= BvhLiteTree::kLastSibling;
    std::uint8_t* to = &nodes[node * stride_];
    std::memcpy(to, &record, sizeof(record));
    Planes own = {};
    for (std::size_t p = 0; p < k_; ++p) {
      set_bits(to + sizeof(record), p, options_.bits, quantised.steps[p]);
      own[p] = plane_of(parent[p], from_half(record.least), step_of(record, options_.bits), quantised.steps[p]);
    }
    if (from.is_leaf()) order[from.end - 1] |= BvhLiteTree::kLastTriangle;
    for (std::uint32_t i = 0; i < from.child_count; ++i) add(from.first_child + i, own, i + 1 == from.child_count);
  }

  std::vector<std::uint8_t> nodes;
  std::vector<std::uint32_t> order;

 private:
  const BvhLiteOptions& options_;
  const Hierarchy& shape_;
  const std::vector<float>& fitted_;
  std::size_t stride_;
  std::size_t k_;
};

}  // namespace

BvhLiteTree BvhLiteTree::build(std::shared_ptr<const Mesh> mesh, const BvhLiteOptions& options,
                               core::ThreadPool& pool) {
  PRESCENE_CHECK(mesh != nullptr);
  PRESCENE_CHECK(options.bits == 4 || options.bits == 6 || options.bits == 8);
  const DopDirections& directions = DopDirections::of(options.k);
  BvhLiteTree tree;
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  const Hierarchy shape = build_hierarchy(
      triangle_items(*mesh),
      {.builder = options.builder, .branching = options.branching, .leaf_items = options.leaf_items}, pool);
  PRESCENE_CHECK(shape.nodes.size() <= kNumber);
  const std::vector<float> fitted = fit_planes(directions, tree.space_, *mesh, shape, pool);
  LiteBuilder builder(options, shape, fitted, tree.stride());
  const auto root = builder.exact(0);
  std::copy(root.begin(), root.end(), tree.root_planes_.begin());
  builder.add(0, tree.root_planes_, true);
  tree.mesh_ = std::move(mesh);
  tree.node_count_ = shape.nodes.size();
  tree.nodes_ = Array<std::uint8_t>(std::move(builder.nodes));
  tree.order_ = Array<std::uint32_t>(std::move(builder.order));
  return tree;
}

std::uint32_t BvhLiteTree::reference(std::uint32_t i) const {
  std::uint32_t reference = 0;
  std::memcpy(&reference, node(i), sizeof(reference));
  return reference;
}

BvhLiteTree::Planes BvhLiteTree::planes_below(std::uint32_t i, const Planes& parent) const {
  Record record;
  std::memcpy(&record, node(i), sizeof(record));
  const float least = from_half(record.least);
  const float step = step_of(record, options_.bits);
  Planes planes = {};
  for (std::size_t p = 0; p < static_cast<std::size_t>(options_.k); ++p)
    planes[p] = plane_of(parent[p], least, step, get_bits(node(i) + sizeof(record), p, options_.bits));
  return planes;
}

}  // namespace prescene::collision
