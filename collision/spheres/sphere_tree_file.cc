// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/sphere_tree_file.h"

#include <array>
#include <memory>
#include <span>
#include <utility>

#include "prescene/collision/tree_file.h"
#include "prescene/core/hash.h"

namespace prescene::collision {
namespace {

enum Section : std::size_t { kSpheres, kAnchors, kNodes, kLanes, kOrder, kRoot, kVolumes, kCounts, kSections };

TreeFileKey key_of(const Mesh& mesh, const PackingOptions& packing, const SphereTreeOptions& tree) {
  core::Hasher hasher;
  hasher.value(packing.max_spheres).value(packing.volume_share).value(packing.smallest_radius);
  hasher.value(packing.edge_fidelity).value(packing.close_holes).value(packing.layouts);
  hasher.value(tree.branching).value(tree.builder);
  return {.kind = "spheres", .layout = 1, .mesh_hash = mesh.content_hash(), .settings_hash = hasher.digest()};
}

// Packed spheres and anchors are floats without gaps, but Eigen's vectors don't count as trivially copyable.
template <class T>
inline constexpr std::size_t kFloats = sizeof(T) / sizeof(float);
static_assert(kFloats<PackedSphere> == 4 && sizeof(PackedSphere) == 4 * sizeof(float));
static_assert(kFloats<SurfaceAnchor> == 6 && sizeof(SurfaceAnchor) == 6 * sizeof(float));

template <class T>
std::span<const float> floats_of(std::span<const T> values) {
  return {reinterpret_cast<const float*>(values.data()), kFloats<T> * values.size()};
}

// The array looks at the floats, which it keeps alive.
template <class T>
core::Result<Array<T>> section_of(const TreeFile& file, std::size_t section) {
  PRESCENE_TRY(Array<float> floats, file.section<float>(section));
  const auto kept = std::make_shared<const Array<float>>(std::move(floats));
  return Array<T>({reinterpret_cast<const T*>(kept->data()), kept->size() / kFloats<T>}, kept);
}

}  // namespace

core::Status write_sphere_tree(const std::filesystem::path& path, const Mesh& mesh, const PackingOptions& packing,
                               const SphereTree& tree, const PackingReport& report) {
  const SphereTree::Parts parts = tree.parts();
  const std::array<double, 3> volumes = {report.body_volume, report.packed_volume, report.edge_gap};
  const std::array<std::int32_t, 3> counts = {report.edge_spheres, report.closed_holes, report.open_edges};
  TreeFileWriter writer(key_of(mesh, packing, tree.options()));
  writer.add(floats_of(tree.packing().spheres().span())).add(floats_of(tree.packing().anchors().span()));
  writer.add(parts.nodes.span()).add(parts.lanes.span()).add(parts.order.span());
  writer.add(floats_of(std::span<const PackedSphere>(&parts.root, 1)));
  writer.add(std::span<const double>(volumes)).add(std::span<const std::int32_t>(counts));
  return writer.write(path);
}

core::Result<KeptSphereTree> read_sphere_tree(const std::filesystem::path& path, const Mesh& mesh,
                                              const PackingOptions& packing, const SphereTreeOptions& tree) {
  PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key_of(mesh, packing, tree)));
  PRESCENE_TRY(Array<PackedSphere> spheres, section_of<PackedSphere>(file, kSpheres));
  PRESCENE_TRY(Array<SurfaceAnchor> anchors, section_of<SurfaceAnchor>(file, kAnchors));
  SphereTree::Parts parts;
  PRESCENE_TRY(parts.nodes, file.section<SphereTree::Node>(kNodes));
  PRESCENE_TRY(parts.lanes, file.section<float>(kLanes));
  PRESCENE_TRY(parts.order, file.section<std::uint32_t>(kOrder));
  PRESCENE_TRY(const Array<PackedSphere> root, section_of<PackedSphere>(file, kRoot));
  PRESCENE_TRY(const Array<double> volumes, file.section<double>(kVolumes));
  PRESCENE_TRY(const Array<std::int32_t> counts, file.section<std::int32_t>(kCounts));
  if (file.section_count() != kSections || root.size() != 1 || volumes.size() != 3 || counts.size() != 3)
    return core::data_loss(path.string() + ": it is no sphere tree; pack the mesh anew and write it there");
  parts.root = root[0];
  const auto packed = SpherePacking::make(std::move(spheres), std::move(anchors), mesh.name());
  if (!packed)
    return core::data_loss(path.string() + ": " + packed.status().message() +
                           "; pack the mesh anew and write it there");
  KeptSphereTree kept;
  auto restored = SphereTree::restore(*packed, tree, std::move(parts));
  if (!restored) return restored.status().at(path.string());
  kept.tree = *restored;
  kept.report = {.body_volume = volumes[0],
                 .packed_volume = volumes[1],
                 .edge_spheres = counts[0],
                 .edge_gap = volumes[2],
                 .closed_holes = counts[1],
                 .open_edges = counts[2]};
  return kept;
}

}  // namespace prescene::collision
