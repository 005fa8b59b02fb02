// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "hierarchy_splitter.h"
#include "prescene/core/check.h"
#include "principal_axes.h"

namespace prescene::collision {
namespace {

using Eigen::Matrix3f;

constexpr int kBranching = 16;
constexpr float kSteps = 253.0F;
// Of a sum of three products of numbers below one, with room to spare.
constexpr float kRounding = 8.0F * std::numeric_limits<float>::epsilon();

struct Bounds {
  Vector3f low = Vector3f::Constant(std::numeric_limits<float>::infinity());
  Vector3f high = Vector3f::Constant(-std::numeric_limits<float>::infinity());
  void add(const Vector3f& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  void add(const Bounds& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
};

/// CornerIndices of the triangles in the order of the leaves: three a triangle.
using CornerIndices = std::vector<Vector3f>;

struct ChildRange {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

/// Rows are the axes, so that R_NM * p is in the frame N.
Bounds bounds_in(const Matrix3f& R_NM, const Vector3f& origin, const CornerIndices& corners, ChildRange range) {
  Bounds bounds;
  for (std::size_t i = std::size_t{3} * range.begin; i < std::size_t{3} * range.end; ++i)
    bounds.add(R_NM * (corners[i] - origin));
  return bounds;
}

float area(const Bounds& bounds) {
  const Vector3f size = bounds.high - bounds.low;
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

bool principal_axes(const CornerIndices& corners, ChildRange range, Matrix3f* R_NM) {
  PointMoments moments(corners[std::size_t{3} * range.begin]);
  for (std::size_t i = std::size_t{3} * range.begin; i < std::size_t{3} * range.end; ++i) moments.add(corners[i]);
  return moments.principal_axes(R_NM);
}

float cost_of(const Matrix3f& R_NM, const Vector3f& origin, const CornerIndices& corners,
              std::span<const ChildRange> children) {
  float cost = 0.0F;
  for (const ChildRange& child : children) cost += area(bounds_in(R_NM, origin, corners, child));
  return cost;
}

/// Sets the frame and the children's boxes.
void fit(const Matrix3f& R_NM, const CornerIndices& corners, std::span<const ChildRange> children,
         TriangleTreeNode* node) {
  // The low corner is rounded when it is put into the mesh's frame, so boxes are measured from what it became.
  const Vector3f& reference = corners[std::size_t{3} * children[0].begin];
  Bounds all;
  for (const ChildRange& child : children) all.add(bounds_in(R_NM, reference, corners, child));
  const float scale = reference.cwiseAbs().maxCoeff() + (all.high - all.low).stableNorm();
  const Vector3f margin = Vector3f::Constant(kRounding * scale);
  const Vector3f origin = reference + R_NM.transpose() * (all.low - margin);

  std::array<Bounds, kBranching> boxes;
  Bounds from_origin;
  for (std::size_t i = 0; i < children.size(); ++i) {
    boxes[i] = bounds_in(R_NM, origin, corners, children[i]);
    from_origin.add(boxes[i]);
  }
  const float pad = kRounding * (from_origin.high.cwiseAbs().maxCoeff() + std::numeric_limits<float>::min());
  Vector3f diagonal;
  for (int k = 0; k < 3; ++k) {
    const auto axis = static_cast<std::size_t>(k);
    const float half_extent =
        std::max(0.5F * (from_origin.high[k] + 2.0F * pad), 128.0F * std::numeric_limits<float>::min()) *
        (1.0F + kRounding);
    const float step = 2.0F * half_step(half_extent);
    node->axes_x[k] = R_NM(k, 0);
    node->axes_y[k] = R_NM(k, 1);
    node->axes_z[k] = R_NM(k, 2);
    node->steps_per_metre[k] = 1.0F / step;
    node->half_extent[k] = half_extent;
    node->origin[k] = origin[k];
    diagonal[k] = 2.0F * half_extent;
    for (std::size_t i = 0; i < children.size(); ++i) {
      const float low = std::floor((boxes[i].low[k] - pad) / step);
      const float high = std::ceil((boxes[i].high[k] + pad) / step);
      PRESCENE_DCHECK(high <= kSteps);
      node->low[axis][i] = static_cast<std::uint8_t>(1.0F + std::clamp(low, 0.0F, kSteps));
      node->high[axis][i] = static_cast<std::uint8_t>(1.0F + std::clamp(high, 0.0F, kSteps));
    }
  }
  node->diagonal = diagonal.stableNorm();  // Squares of tiny lengths vanish.
}

TriangleTreeNode make_node(const CornerIndices& corners, std::span<const ChildRange> children, bool rotated_frames) {
  TriangleTreeNode node{};
  Matrix3f R_NM = Matrix3f::Identity();
  Matrix3f principal;
  const ChildRange all{children.front().begin, children.back().end};
  if (rotated_frames && principal_axes(corners, all, &principal)) {
    const Vector3f& origin = corners[std::size_t{3} * all.begin];
    if (cost_of(principal, origin, corners, children) < cost_of(R_NM, origin, corners, children)) R_NM = principal;
  }
  fit(R_NM, corners, children, &node);
  return node;
}

TriangleBlock make_block(const CornerIndices& corners, ChildRange leaf) {
  TriangleBlock block;
  for (std::uint32_t lane = 0; lane < 4; ++lane) {
    const std::uint32_t triangle = std::min(leaf.begin + lane, leaf.end - 1);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      for (int k = 0; k < 3; ++k) block.corners[corner][k][lane] = corners[std::size_t{3} * triangle + corner][k];
    }
  }
  return block;
}

TriangleReferences make_references(const std::vector<std::uint32_t>& order, ChildRange leaf) {
  TriangleReferences references;
  for (std::uint32_t lane = 0; lane < 4; ++lane)
    references[lane] = leaf.begin + lane < leaf.end ? order[leaf.begin + lane] : kNoTriangle;
  return references;
}

/// How many nodes before each are of its own kind.
std::vector<std::uint32_t> ranks(const Hierarchy& shape) {
  std::vector<std::uint32_t> rank(shape.nodes.size());
  std::array<std::uint32_t, 2> count = {0, 0};
  for (std::size_t i = 0; i < shape.nodes.size(); ++i) rank[i] = count[shape.nodes[i].is_leaf() ? 1 : 0]++;
  return rank;
}

/// A node of the hierarchy with children, and where its children are among their own kinds.
TriangleTreeNode make_inner_node(const Hierarchy& shape, const Hierarchy::Node& from,
                                 const std::vector<std::uint32_t>& rank, const CornerIndices& corners,
                                 bool rotated_frames) {
  std::array<ChildRange, kBranching> children;
  std::uint32_t leaf_mask = 0;
  std::array<std::uint32_t, 2> first = {0, 0};
  for (std::uint32_t c = from.child_count; c-- > 0;) {
    const Hierarchy::Node& child = shape.nodes[from.first_child + c];
    children[c] = {child.begin, child.end};
    first[child.is_leaf() ? 1 : 0] = rank[from.first_child + c];
    if (child.is_leaf()) leaf_mask |= 1U << c;
  }
  TriangleTreeNode node = make_node(corners, std::span(children).first(from.child_count), rotated_frames);
  node.children_word = TriangleTreeNode::kWordBit | from.child_count << 16U | leaf_mask;
  node.first_child_word = TriangleTreeNode::kWordBit | first[0];
  node.first_leaf_word = TriangleTreeNode::kWordBit | first[1];
  return node;
}

/// What a tree consists of.
struct MeshParts {
  std::vector<TriangleTreeNode> nodes;
  std::vector<TriangleBlock> blocks;
  std::vector<TriangleReferences> references;
};

MeshParts make_parts(const Hierarchy& shape, const CornerIndices& corners, bool rotated_frames,
                     core::ThreadPool& pool) {
  const std::vector<std::uint32_t> rank = ranks(shape);
  const auto leaves = static_cast<std::size_t>(
      std::count_if(shape.nodes.begin(), shape.nodes.end(), [](auto& n) { return n.is_leaf(); }));
  MeshParts parts;
  parts.nodes.resize(shape.nodes.size() - leaves);
  parts.blocks.resize(leaves);
  parts.references.resize(leaves);
  constexpr std::size_t kNodesAtOnce = 64;
  pool.for_blocks(shape.nodes.size(), kNodesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Hierarchy::Node& from = shape.nodes[i];
      if (from.is_leaf()) {
        parts.blocks[rank[i]] = make_block(corners, {from.begin, from.end});
        parts.references[rank[i]] = make_references(shape.order, {from.begin, from.end});
      } else {
        parts.nodes[rank[i]] = make_inner_node(shape, from, rank, corners, rotated_frames);
      }
    }
  });
  return parts;
}

/// A lone leaf gets a root above it, so that every tree begins with a node.
void ensure_root(Hierarchy* shape) {
  if (!shape->nodes[0].is_leaf()) return;
  Hierarchy::Node root = shape->nodes[0];
  root.first_child = 1;
  root.child_count = 1;
  shape->nodes.insert(shape->nodes.begin(), root);
}

Hierarchy shape_of(const Mesh& mesh, const TriangleTreeOptions& options, core::ThreadPool& pool) {
  const HierarchyOptions shape = {.builder = options.builder, .branching = kBranching, .leaf_items = 4};
  if (!options.rotated_frames || options.builder != Builder::kSurfaceAreaHeuristic)
    return build_hierarchy(triangle_items(mesh), shape, pool);
  return grow_hierarchy(*turned_surface_area_splitter(mesh, shape, pool), mesh.triangle_count(), shape, pool);
}

}  // namespace

TriangleTree TriangleTree::build(std::shared_ptr<const Mesh> mesh, const TriangleTreeOptions& options,
                                 core::ThreadPool& pool) {
  PRESCENE_CHECK(mesh != nullptr);
  Hierarchy shape = shape_of(*mesh, options, pool);
  ensure_root(&shape);

  constexpr std::size_t kTrianglesAtOnce = 4096;
  CornerIndices corners(3 * shape.order.size());
  pool.for_blocks(shape.order.size(), kTrianglesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const TriangleIndices& t = mesh->triangles()[shape.order[i]];
      for (std::size_t corner = 0; corner < 3; ++corner) corners[3 * i + corner] = mesh->vertices()[t[corner]];
    }
  });

  MeshParts parts = make_parts(shape, corners, options.rotated_frames, pool);
  TriangleTree tree;
  tree.radius_ = radius_of(*mesh);
  tree.mesh_ = std::move(mesh);
  tree.options_ = options;
  tree.nodes_ = Array<TriangleTreeNode>(std::move(parts.nodes));
  tree.blocks_ = Array<TriangleBlock>(std::move(parts.blocks));
  tree.references_ = Array<TriangleReferences>(std::move(parts.references));
  return tree;
}

float TriangleTree::radius_of(const Mesh& mesh) {
  float radius = 0.0F;
  for (const TriangleIndices& triangle : mesh.triangles()) {
    for (const std::uint32_t index : triangle) radius = std::max(radius, mesh.vertices()[index].stableNorm());
  }
  return radius;
}

TriangleTreeMemory TriangleTree::memory() const { return {nodes_.bytes(), references_.bytes(), blocks_.bytes()}; }

}  // namespace prescene::collision
