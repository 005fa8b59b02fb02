// SPDX-License-Identifier: Apache-2.0
// How the trees of this folder are kept in files and read back. What a file says is checked as far as queries rely on
// it to end and to stay inside arrays; that the volumes are right follows from the checksum.
#include <bit>
#include <filesystem>
#include <string>
#include <utility>

#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/dop_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_shape.h"
#include "prescene/core/check.h"
#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

template <class... Settings>
TreeFileKey key_of(std::string_view kind, const Mesh* mesh, Settings... settings) {
  PRESCENE_CHECK(mesh != nullptr);
  core::Hasher hasher;
  (hasher.value(settings), ...);
  return {.kind = kind, .layout = 1, .mesh_hash = mesh->content_hash(), .settings_hash = hasher.digest()};
}

TreeFileKey key_of(const Mesh* mesh, const DopTreeOptions& o) {
  return key_of("k-dops", mesh, o.k, o.builder, o.leaf_items);
}
TreeFileKey key_of(const Mesh* mesh, const SimdopOptions& o) {
  return key_of("simdop", mesh, o.k, o.branching, o.leaf_items, o.builder, o.precision, o.traversal);
}
TreeFileKey key_of(const Mesh* mesh, const BvhLiteOptions& o) {
  return key_of("bvhlite", mesh, o.k, o.bits, o.branching, o.leaf_items, o.builder);
}
TreeFileKey key_of(const Mesh* mesh, const BoxtreeOptions& o) {
  return key_of("boxtree", mesh, o.builder, o.leaf_items);
}

core::Status no_tree(const std::string& name) {
  return core::data_loss(name + ": what it holds is not a tree of the mesh; build the tree anew and save it there");
}

bool is_sound(const DopTree& tree, std::size_t planes) {
  TreeShape shape(tree.nodes().size());
  if (tree.nodes().empty() || planes != tree.nodes().size() * static_cast<std::size_t>(tree.options().k)) return false;
  for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
    const DopTree::Node& node = tree.nodes()[i];
    if (node.is_leaf()) {
      if (node.first > tree.order().size() || node.triangles > tree.order().size() - node.first) return false;
    } else if (!shape.add_children(i, node.first, 2)) {
      return false;
    }
  }
  return shape.complete() && has_all_triangles(tree.order().span(), tree.mesh());
}

bool is_sound(const SimdopTree& tree) {
  const SimdopOptions& options = tree.options();
  const std::size_t planes =
      tree.nodes().size() * static_cast<std::size_t>(options.branching) * static_cast<std::size_t>(options.k) + 16;
  const bool half = options.precision == PlanePrecision::kHalf;
  if (tree.half_planes().size() != (half ? planes : 0) || tree.single_planes().size() != (half ? 0 : planes))
    return false;
  const Array<std::uint32_t>& begin = tree.leaf_begin();
  if (begin.empty() != (options.leaf_items == 1)) return false;
  if (!begin.empty() &&
      (begin[0] != 0 || begin[begin.size() - 1] != tree.order().size() || !std::is_sorted(begin.begin(), begin.end())))
    return false;
  const std::size_t leaves = begin.empty() ? tree.order().size() : begin.size() - 1;
  TreeShape shape(tree.nodes().size());
  if (tree.nodes().empty()) return false;
  for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
    const SimdopTree::Node& node = tree.nodes()[i];
    const auto count = static_cast<std::size_t>(std::popcount(node.children));
    const auto leaf_count = static_cast<std::size_t>(std::popcount(node.leaves));
    if (count == 0 || count > static_cast<std::size_t>(options.branching) || node.children != (1U << count) - 1U ||
        (node.leaves & ~node.children) != 0 || node.first_leaf > leaves || leaf_count > leaves - node.first_leaf)
      return false;
    if (!shape.add_children(i, node.first_node, count - leaf_count)) return false;
  }
  return shape.complete() && has_all_triangles(tree.order().span(), tree.mesh());
}

bool is_sound(const BvhLiteTree& tree) {
  TreeShape shape(tree.node_count());
  for (std::uint32_t i = 0; i < tree.node_count(); ++i) {
    const std::uint32_t reference = tree.reference(i);
    const std::uint32_t first = reference & BvhLiteTree::kNumber;
    if ((reference & BvhLiteTree::kLeaf) != 0) {
      if (first >= tree.order().size()) return false;
      continue;
    }
    for (std::uint32_t child = first;; ++child) {
      if (child - first == static_cast<std::uint32_t>(tree.options().branching) || !shape.add_child(i, child))
        return false;
      if ((tree.reference(child) & BvhLiteTree::kLastSibling) != 0) break;
    }
  }
  return shape.complete() && has_all_triangles(tree.order().span(), tree.mesh(), ~BvhLiteTree::kLastTriangle) &&
         (tree.order()[tree.order().size() - 1] & BvhLiteTree::kLastTriangle) != 0;
}

bool is_sound(const Boxtree& tree) {
  const bool one_a_leaf = tree.options().leaf_items == 1;
  const std::size_t places = tree.mesh().triangle_count();
  if (one_a_leaf != tree.order().empty()) return false;
  if (!one_a_leaf && !has_all_triangles(tree.order().span(), tree.mesh())) return false;
  const auto is_place = [&](const Boxtree::Child& leaf) {
    return leaf.index < places && leaf.triangles <= places - leaf.index;
  };
  if (tree.root().triangles > 0) return tree.nodes().empty() && is_place(tree.root());
  TreeShape shape(tree.nodes().size());
  if (tree.nodes().empty() || tree.root().index != 0) return false;
  for (std::uint32_t i = 0; i < tree.nodes().size(); ++i) {
    if ((tree.nodes()[i].header & 3U) == Boxtree::kTrims) {
      if (!shape.add_continuation(i, i + 1) || (tree.nodes()[i + 1].header & 3U) == Boxtree::kTrims) return false;
      continue;
    }
    for (const Boxtree::Child& child : tree.children({i, 0})) {
      if (child.triangles > 0 ? !is_place(child) : !shape.add_child(i, child.index)) return false;
    }
  }
  return shape.complete();
}

}  // namespace

TreeFileWriter DopTree::file() const {
  TreeFileWriter writer(key_of(mesh_.get(), options_));
  return writer.add(nodes_.span()).add(planes_.span()).add(order_.span());
}

core::Result<DopTree> DopTree::from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                         const DopTreeOptions& options) {
  DopTree tree;
  PRESCENE_TRY(tree.nodes_, file.section<Node>(0));
  PRESCENE_TRY(tree.planes_, file.section<float>(1));
  PRESCENE_TRY(tree.order_, file.section<std::uint32_t>(2));
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  tree.mesh_ = std::move(mesh);
  if (!is_sound(tree, tree.planes_.size())) return no_tree(file.name());
  return tree;
}

core::Status DopTree::save(const std::filesystem::path& path) const { return file().write(path); }
std::vector<std::uint8_t> DopTree::file_bytes() const { return file().bytes(); }

core::Result<DopTree> DopTree::load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                    const DopTreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh.get(), options)));
  return from_file(file, std::move(mesh), options);
}

core::Result<DopTree> DopTree::from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                          const DopTreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::from_bytes(bytes, key_of(mesh.get(), options), "tree"));
  return from_file(file, std::move(mesh), options);
}

TreeFileWriter SimdopTree::file() const {
  TreeFileWriter writer(key_of(mesh_.get(), options_));
  writer.add(nodes_.span()).add(leaf_begin_.span()).add(order_.span());
  return writer.add(single_planes_.span()).add(half_planes_.span());
}

core::Result<SimdopTree> SimdopTree::from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                               const SimdopOptions& options) {
  SimdopTree tree;
  PRESCENE_TRY(tree.nodes_, file.section<Node>(0));
  PRESCENE_TRY(tree.leaf_begin_, file.section<std::uint32_t>(1));
  PRESCENE_TRY(tree.order_, file.section<std::uint32_t>(2));
  PRESCENE_TRY(tree.single_planes_, file.section<float>(3));
  PRESCENE_TRY(tree.half_planes_, file.section<std::uint16_t>(4));
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  tree.mesh_ = std::move(mesh);
  if (!is_sound(tree)) return no_tree(file.name());
  return tree;
}

core::Status SimdopTree::save(const std::filesystem::path& path) const { return file().write(path); }
std::vector<std::uint8_t> SimdopTree::file_bytes() const { return file().bytes(); }

core::Result<SimdopTree> SimdopTree::load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                          const SimdopOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh.get(), options)));
  return from_file(file, std::move(mesh), options);
}

core::Result<SimdopTree> SimdopTree::from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                                const SimdopOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::from_bytes(bytes, key_of(mesh.get(), options), "tree"));
  return from_file(file, std::move(mesh), options);
}

TreeFileWriter BvhLiteTree::file() const {
  TreeFileWriter writer(key_of(mesh_.get(), options_));
  return writer.add(nodes_.span()).add(order_.span()).add(std::span<const float>(root_planes_));
}

core::Result<BvhLiteTree> BvhLiteTree::from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                                 const BvhLiteOptions& options) {
  BvhLiteTree tree;
  PRESCENE_TRY(tree.nodes_, file.section<std::uint8_t>(0));
  PRESCENE_TRY(tree.order_, file.section<std::uint32_t>(1));
  PRESCENE_TRY(const Array<float> root, file.section<float>(2));
  tree.options_ = options;
  tree.space_ = DopSpace::of(*mesh);
  tree.mesh_ = std::move(mesh);
  if (root.size() != kPlanes || tree.nodes_.size() < tree.stride() + 16) return no_tree(file.name());
  if ((tree.nodes_.size() - 16) % tree.stride() != 0) return no_tree(file.name());
  std::copy(root.begin(), root.end(), tree.root_planes_.begin());
  tree.node_count_ = (tree.nodes_.size() - 16) / tree.stride();
  if (!is_sound(tree)) return no_tree(file.name());
  return tree;
}

core::Status BvhLiteTree::save(const std::filesystem::path& path) const { return file().write(path); }
std::vector<std::uint8_t> BvhLiteTree::file_bytes() const { return file().bytes(); }

core::Result<BvhLiteTree> BvhLiteTree::load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                            const BvhLiteOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh.get(), options)));
  return from_file(file, std::move(mesh), options);
}

core::Result<BvhLiteTree> BvhLiteTree::from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                                  const BvhLiteOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::from_bytes(bytes, key_of(mesh.get(), options), "tree"));
  return from_file(file, std::move(mesh), options);
}

TreeFileWriter Boxtree::file() const {
  TreeFileWriter writer(key_of(mesh_.get(), options_));
  writer.add(nodes_.span()).add(order_.span()).add(std::span<const BoxtreeBox>(&box_, 1));
  return writer.add(std::span<const Child>(&root_, 1));
}

core::Result<Boxtree> Boxtree::from_file(const TreeFile& file, std::shared_ptr<const Mesh> mesh,
                                         const BoxtreeOptions& options) {
  Boxtree tree;
  PRESCENE_TRY(tree.nodes_, file.section<Node>(0));
  PRESCENE_TRY(tree.order_, file.section<std::uint32_t>(1));
  PRESCENE_TRY(const Array<BoxtreeBox> box, file.section<BoxtreeBox>(2));
  PRESCENE_TRY(const Array<Child> root, file.section<Child>(3));
  tree.options_ = options;
  tree.mesh_ = std::move(mesh);
  if (box.size() != 1 || root.size() != 1) return no_tree(file.name());
  tree.box_ = box[0];
  tree.root_ = root[0];
  if (!is_sound(tree)) return no_tree(file.name());
  return tree;
}

core::Status Boxtree::save(const std::filesystem::path& path) const { return file().write(path); }
std::vector<std::uint8_t> Boxtree::file_bytes() const { return file().bytes(); }

core::Result<Boxtree> Boxtree::load(const std::filesystem::path& path, std::shared_ptr<const Mesh> mesh,
                                    const BoxtreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh.get(), options)));
  return from_file(file, std::move(mesh), options);
}

core::Result<Boxtree> Boxtree::from_bytes(std::span<const std::uint8_t> bytes, std::shared_ptr<const Mesh> mesh,
                                          const BoxtreeOptions& options) {
  PRESCENE_TRY(const TreeFile file, TreeFile::from_bytes(bytes, key_of(mesh.get(), options), "tree"));
  return from_file(file, std::move(mesh), options);
}

}  // namespace prescene::collision
