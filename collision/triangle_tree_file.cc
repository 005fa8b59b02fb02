// SPDX-License-Identifier: Apache-2.0
// TriangleTree in files.
#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_shape.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/check.h"
#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

constexpr std::string_view kKind = "triangle tree";
constexpr std::uint32_t kLayout = 1;

TreeFileKey key_of(const Mesh* mesh, const TriangleTreeOptions& options) {
  PRESCENE_CHECK(mesh != nullptr);
  const std::uint64_t settings = core::Hasher().value(options.builder).value(options.rotated_frames).digest();
  return {.kind = kKind, .layout = kLayout, .mesh_hash = mesh->content_hash(), .settings_hash = settings};
}

core::Status damaged(const std::string& what) {
  return core::data_loss("the tree in it is damaged: " + what + "; build the tree anew and save it there");
}

/// Nodes and leaves are those of a tree, so that a descent ends and stays inside of the arrays.
core::Status check_nodes(std::span<const TriangleTreeNode> nodes, std::size_t blocks) {
  if (nodes.empty()) return damaged("it has no nodes");
  TreeShape shape(nodes.size());
  std::vector<bool> seen(blocks);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const TriangleTreeNode& node = nodes[i];
    const std::uint32_t leaves = node.leaf_mask();
    const auto leaf_count = static_cast<std::size_t>(std::popcount(leaves));
    bool sound = node.child_count() >= 1 && node.child_count() <= 16 && (leaves & ~node.child_mask()) == 0 &&
                 shape.add_children(i, node.first_child(), node.child_count() - leaf_count);
    for (std::size_t leaf = node.first_leaf(); sound && leaf < node.first_leaf() + leaf_count; ++leaf) {
      sound = leaf < blocks && !seen[leaf];
      if (sound) seen[leaf] = true;
    }
    if (!sound) return damaged("node " + std::to_string(i) + " has children that do not exist or are another's");
  }
  if (!shape.complete() || std::find(seen.begin(), seen.end(), false) != seen.end())
    return damaged("a part of it is nobody's child");
  return core::ok_status();
}

bool same_corners(const TriangleBlock& block, std::size_t lane, const std::array<Vector3f, 3>& corners) {
  for (std::size_t corner = 0; corner < 3; ++corner) {
    for (int k = 0; k < 3; ++k) {
      if (block.corners[corner][k][lane] != corners[corner][k]) return false;
    }
  }
  return true;
}

/// Every triangle of the mesh is in one block, as it is in the mesh.
core::Status check_blocks(std::span<const TriangleBlock> blocks, std::span<const TriangleReferences> references,
                          const Mesh& mesh) {
  if (blocks.size() != references.size()) return damaged("a leaf lacks its triangles");
  std::vector<bool> seen(mesh.triangle_count());
  std::size_t count = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    std::uint32_t last = kNoTriangle;
    for (std::size_t lane = 0; lane < 4; ++lane) {
      const std::uint32_t triangle = references[i][lane];
      if (triangle == kNoTriangle ? last == kNoTriangle : triangle >= mesh.triangle_count() || seen[triangle])
        return damaged("leaf " + std::to_string(i) + " names a triangle that does not exist or is in another");
      if (triangle != kNoTriangle) {
        last = triangle;
        seen[triangle] = true;
        ++count;
      }
      if (!same_corners(blocks[i], lane, mesh.corners(last)))
        return damaged("leaf " + std::to_string(i) + " differs from the mesh");
    }
  }
  if (count != mesh.triangle_count()) return damaged("triangles are missing");
  return core::ok_status();
}

}  // namespace

core::Status TriangleTree::save(const std::filesystem::path& path) const {
  return TreeFileWriter(key_of(mesh_.get(), options_))
      .add(nodes_.span())
      .add(blocks_.span())
      .add(references_.span())
      .write(path);
}

std::vector<std::uint8_t> TriangleTree::bytes() const {
  return TreeFileWriter(key_of(mesh_.get(), options_))
      .add(nodes_.span())
      .add(blocks_.span())
      .add(references_.span())
      .bytes();
}

core::Result<TriangleTree> TriangleTree::from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                                   const TriangleTreeOptions& options) {
  TriangleTree tree;
  PRESCENE_TRY(tree.nodes_, file.section<TriangleTreeNode>(0));
  PRESCENE_TRY(tree.blocks_, file.section<TriangleBlock>(1));
  PRESCENE_TRY(tree.references_, file.section<TriangleReferences>(2));
  PRESCENE_RETURN_IF_ERROR(check_nodes(tree.nodes_.span(), tree.blocks_.size()).at(file.name()));
  PRESCENE_RETURN_IF_ERROR(check_blocks(tree.blocks_.span(), tree.references_.span(), *mesh).at(file.name()));
  tree.radius_ = radius_of(*mesh);
  tree.mesh_ = std::move(mesh);
  tree.options_ = options;
  return tree;
}

core::Result<TriangleTree> TriangleTree::load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                              const TriangleTreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh.get(), options)));
  return from_file(file, std::move(mesh), options);
}

core::Result<TriangleTree> TriangleTree::from_bytes(std::span<const std::uint8_t> bytes,
                                                    std::shared_ptr<const Mesh> mesh,
                                                    const TriangleTreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::from_bytes(bytes, key_of(mesh.get(), options), "tree"));
  return from_file(file, std::move(mesh), options);
}

}  // namespace prescene::collision
