// SPDX-License-Identifier: Apache-2.0
// Packings and their trees in files (tree_file.h), so that a service starts without packing anew: a file belongs to one
// mesh and the settings of its packing and tree.
//
//   auto kept = read_sphere_tree(path, *mesh, packing_options, tree_options);
//   if (!kept) {
//     PRESCENE_TRY(const PackedMesh packed, pack_spheres(*mesh, packing_options, pool));
//     PRESCENE_TRY(const auto tree, SphereTree::make(packed.packing, tree_options, pool));
//     PRESCENE_RETURN_IF_ERROR(write_sphere_tree(path, *mesh, packing_options, *tree, packed.report));
//   }
#pragma once

#include <filesystem>
#include <memory>

#include "prescene/collision/mesh.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/core/status.h"

namespace prescene::collision {

struct KeptSphereTree {
  std::shared_ptr<const SphereTree> tree;
  PackingReport report;
};

/// Of a tree over a packing of that mesh with those options (the caller's word is taken for it). Errors of
/// TreeFileWriter::write().
core::Status write_sphere_tree(const std::filesystem::path& path, const Mesh& mesh, const PackingOptions& packing,
                               const SphereTree& tree, const PackingReport& report);

/// The same bits that were written, mapped from the file. Errors of TreeFile::open(); kDataLoss when what it holds is
/// not a tree.
core::Result<KeptSphereTree> read_sphere_tree(const std::filesystem::path& path, const Mesh& mesh,
                                              const PackingOptions& packing, const SphereTreeOptions& tree);

}  // namespace prescene::collision
