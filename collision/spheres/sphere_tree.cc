// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

constexpr std::size_t kAlignment = 64;  // Bytes: a cache line, and the widest vector.

struct AlignedDelete {
  void operator()(float* values) const { ::operator delete[](values, std::align_val_t{kAlignment}); }
};

std::shared_ptr<float> aligned_floats(std::size_t count) {
  return {static_cast<float*>(::operator new[](count * sizeof(float), std::align_val_t{kAlignment})), AlignedDelete()};
}

std::vector<Item> items_of(std::span<const PackedSphere> spheres) {
  std::vector<Item> items;
  items.reserve(spheres.size());
  for (const PackedSphere& sphere : spheres) {
    const Vector3f& c = sphere.centre;
    const float r = sphere.radius;
    items.push_back({.low = {c.x() - r, c.y() - r, c.z() - r},
                     .high = {c.x() + r, c.y() + r, c.z() + r},
                     .centre = {c.x(), c.y(), c.z()},
                     .weight = r * r * r});
  }
  return items;
}

std::vector<PackedSphere> in_order(const Array<PackedSphere>& spheres, std::span<const std::uint32_t> order) {
  std::vector<PackedSphere> result(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) result[i] = spheres[order[i]];
  return result;
}

int depth_of(std::span<const SphereTree::Node> nodes) {
  std::vector<int> depths(nodes.size(), 1);
  int deepest = 1;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    deepest = std::max(deepest, depths[i]);
    if (nodes[i].is_bottom()) continue;
    for (std::uint32_t k = 0; k < nodes[i].count; ++k) depths[nodes[i].first + k] = depths[i] + 1;
  }
  return deepest;
}

core::Status check(const SphereTreeOptions& options, const std::string& name) {
  if (options.branching == 4 || options.branching == 8 || options.branching == 16) return core::ok_status();
  return core::invalid_input("sphere tree of '" + name + "': a branching of " + std::to_string(options.branching) +
                             "; choose 4, 8 or 16");
}

// Each node and each sphere is the child of one node.
core::Status check(const SphereTree::Parts& parts, std::uint32_t spheres, std::size_t branching,
                   const std::string& name) {
  const auto damaged = [&](const std::string& what) {
    return core::data_loss("sphere tree of '" + name + "': " + what + "; build it anew");
  };
  const std::size_t count = parts.nodes.size();
  if (count == 0 || parts.lanes.size() != count * 4 * branching || parts.order.size() != spheres)
    return damaged("its parts are of different sizes");
  std::vector<bool> node_below(count, false);
  std::vector<bool> place_below(spheres, false);
  node_below[0] = true;
  for (std::size_t i = 0; i < count; ++i) {
    const SphereTree::Node& node = parts.nodes[i];
    std::vector<bool>& below = node.is_bottom() ? place_below : node_below;
    if (node.count == 0 || node.count > branching || node.bottom > 1 || !node_below[i] ||
        std::size_t{node.first} + node.count > below.size() || (!node.is_bottom() && node.first <= i))
      return damaged("node " + std::to_string(i) + " is out of range");
    for (std::size_t k = node.first; k < std::size_t{node.first} + node.count; ++k) {
      if (below[k]) return damaged("node " + std::to_string(i) + " has a child of another node");
      below[k] = true;
    }
  }
  std::vector<bool> placed(spheres, false);
  for (const std::uint32_t sphere : parts.order) {
    if (sphere >= spheres || placed[sphere]) return damaged("its order is not one of the spheres");
    placed[sphere] = true;
  }
  if (std::find(node_below.begin(), node_below.end(), false) != node_below.end() ||
      std::find(place_below.begin(), place_below.end(), false) != place_below.end())
    return damaged("a node or sphere is missing");
  const auto finite = [](float x) { return std::abs(x) <= SphereTree::kUnusedCentre; };
  if (!std::all_of(parts.lanes.begin(), parts.lanes.end(), finite) || !parts.root.centre.allFinite() ||
      !finite(parts.root.radius))
    return damaged("a bounding sphere is not finite");
  return core::ok_status();
}

void set_lane(float* lanes, std::size_t branching, std::size_t lane, const PackedSphere& sphere) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    lanes[axis * branching + lane] = sphere.centre[static_cast<Eigen::Index>(axis)];
  lanes[3 * branching + lane] = sphere.radius;
}

using Eigen::Vector3d;

struct Reach {
  double distance = 0.0;
  std::size_t index = 0;
};

// The sphere with the point that is farthest from `centre`.
Reach farthest_reach(std::span<const PackedSphere> spheres, const Vector3d& centre) {
  Reach farthest;
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const double distance = (spheres[i].centre.cast<double>() - centre).norm() + static_cast<double>(spheres[i].radius);
    if (distance > farthest.distance) farthest = {distance, i};
  }
  return farthest;
}

// Not inlined: where g++ 12 sees both conversions of a vector, from double to float and back, its vectorizer drops them
// and measures from a centre that a float cannot hold.
[[gnu::noinline]] PackedSphere sphere_about(const Vector3f& centre, std::span<const PackedSphere> spheres) {
  const double exact = farthest_reach(spheres, centre.cast<double>()).distance * (1.0 + 1e-15);
  auto radius = static_cast<float>(exact);
  if (static_cast<double>(radius) < exact) radius = std::nextafter(radius, std::numeric_limits<float>::infinity());
  return {centre, radius};
}

}  // namespace

PackedSphere bounding_sphere(std::span<const PackedSphere> spheres) {
  PRESCENE_CHECK(!spheres.empty());
  if (spheres.size() == 1) return spheres[0];
  Eigen::AlignedBox3d box;
  for (const PackedSphere& sphere : spheres) {
    const Vector3d reach = Vector3d::Constant(static_cast<double>(sphere.radius));
    box.extend(sphere.centre.cast<double>() - reach);
    box.extend(sphere.centre.cast<double>() + reach);
  }
  // Towards the farthest sphere by shrinking steps [Badoiu and Clarkson 2003].
  constexpr int kSteps = 120;
  constexpr double kShrink = 0.94;
  Vector3d centre = box.center();
  Vector3d best = centre;
  double best_radius = std::numeric_limits<double>::infinity();
  double step = 0.25 * box.sizes().maxCoeff();
  for (int i = 0; i < kSteps; ++i) {
    const Reach farthest = farthest_reach(spheres, centre);
    if (farthest.distance < best_radius) {
      best_radius = farthest.distance;
      best = centre;
    }
    const Vector3d away = spheres[farthest.index].centre.cast<double>() - centre;
    const double length = away.norm();
    if (length == 0.0) break;
    centre += away * (std::min(step, length) / length);
    step *= kShrink;
  }
  return sphere_about(best.cast<float>(), spheres);
}

core::Result<std::shared_ptr<const SphereTree>> SphereTree::restore(std::shared_ptr<const SpherePacking> packing,
                                                                    const SphereTreeOptions& options, Parts parts) {
  PRESCENE_CHECK(packing != nullptr);
  PRESCENE_RETURN_IF_ERROR(check(options, packing->name()));
  PRESCENE_RETURN_IF_ERROR(check(parts, packing->size(), static_cast<std::size_t>(options.branching), packing->name()));
  std::shared_ptr<SphereTree> tree(new SphereTree());
  tree->packing_ = std::move(packing);
  tree->options_ = options;
  tree->depth_ = depth_of(parts.nodes.span());
  tree->nodes_ = std::move(parts.nodes);
  tree->lanes_ = std::move(parts.lanes);
  tree->order_ = std::move(parts.order);
  tree->root_ = parts.root;
  return std::shared_ptr<const SphereTree>(std::move(tree));
}

core::Result<std::shared_ptr<const SphereTree>> SphereTree::make(std::shared_ptr<const SpherePacking> packing,
                                                                 const SphereTreeOptions& options,
                                                                 core::ThreadPool& pool) {
  PRESCENE_CHECK(packing != nullptr);
  PRESCENE_RETURN_IF_ERROR(check(options, packing->name()));
  const auto branching = static_cast<std::size_t>(options.branching);
  std::shared_ptr<SphereTree> tree(new SphereTree());
  tree->packing_ = std::move(packing);
  tree->options_ = options;
  Hierarchy shape = build_hierarchy(
      items_of(tree->packing_->spheres().span()),
      {.builder = options.builder, .branching = options.branching, .leaf_items = options.branching}, pool);
  const std::vector<PackedSphere> spheres = in_order(tree->packing_->spheres(), shape.order);

  std::vector<Node> nodes(shape.nodes.size());
  const std::size_t floats_a_node = 4 * branching;
  const std::shared_ptr<float> lanes = aligned_floats(nodes.size() * floats_a_node);
  pool.for_blocks(nodes.size(), 16, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Hierarchy::Node& node = shape.nodes[i];
      const bool bottom = node.is_leaf();
      const std::uint32_t count = bottom ? node.end - node.begin : node.child_count;
      nodes[i] = {bottom ? node.begin : node.first_child, static_cast<std::uint16_t>(count),
                  static_cast<std::uint16_t>(bottom ? 1 : 0)};
      for (std::size_t k = 0; k < branching; ++k) {
        PackedSphere lane{Vector3f::Constant(kUnusedCentre), 0.0F};
        if (k < count && bottom) lane = spheres[node.begin + k];
        if (k < count && !bottom) {
          const Hierarchy::Node& child = shape.nodes[node.first_child + k];
          lane = bounding_sphere(std::span(spheres).subspan(child.begin, child.end - child.begin));
        }
        set_lane(lanes.get() + i * floats_a_node, branching, k, lane);
      }
    }
  });
  tree->root_ = bounding_sphere(spheres);
  tree->depth_ = depth_of(nodes);
  tree->lanes_ = Array<float>(std::span<const float>(lanes.get(), nodes.size() * floats_a_node), lanes);
  tree->nodes_ = Array<Node>(std::move(nodes));
  tree->order_ = Array<std::uint32_t>(std::move(shape.order));
  return std::shared_ptr<const SphereTree>(std::move(tree));
}

}  // namespace prescene::collision
