// SPDX-License-Identifier: Apache-2.0
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <exception>
#include <memory>
#include <utility>

#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

/// The meshes of a node and its children, moved to the root's frame. A stack of our own: nodes may nest deeply.
Status append_nodes(const aiScene& scene, const MeshReadOptions& options, RawMesh* out) {
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> stack = {{scene.mRootNode, aiMatrix4x4()}};
  std::size_t nodes = 0;
  while (!stack.empty()) {
    const auto [node, X_root_parent] = stack.back();
    stack.pop_back();
    PRESCENE_RETURN_IF_ERROR(check_triangle_count(++nodes, options));
    const aiMatrix4x4 X = X_root_parent * node->mTransformation;
    for (unsigned c = node->mNumChildren; c > 0; --c) stack.emplace_back(node->mChildren[c - 1], X);
    const bool mirrored = aiMatrix3x3(X).Determinant() < 0.0F;
    for (unsigned m = 0; m < node->mNumMeshes; ++m) {
      const aiMesh& mesh = *scene.mMeshes[node->mMeshes[m]];
      const auto first = static_cast<std::uint32_t>(out->mesh.vertices.size());
      PRESCENE_RETURN_IF_ERROR(check_triangle_count(first + std::size_t{mesh.mNumVertices}, options));
      PRESCENE_RETURN_IF_ERROR(check_triangle_count(out->mesh.triangles.size() + mesh.mNumFaces, options));
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiVector3D p = X * mesh.mVertices[v];
        out->mesh.vertices.push_back({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)});
        note_vertex(out->mesh.vertices.back(), "mesh", node->mMeshes[m], v, out);
      }
      for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices != 3) continue;  // Points and lines.
        std::array<std::uint32_t, 3> corners = {first + face.mIndices[0], first + face.mIndices[1],
                                                first + face.mIndices[2]};
        if (mirrored) std::swap(corners[1], corners[2]);
        out->mesh.triangles.push_back(corners);
      }
    }
  }
  return core::ok_status();
}

Result<RawMesh> import_scene(const std::filesystem::path& path, const MeshReadOptions& options) {
  Assimp::Importer importer;
  const bool as_in_file = options.up_axis != UpAxis::kDeclared;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, as_in_file);
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    return core::invalid_input("cannot be read: " + quote(importer.GetErrorString(), 160) +
                               "; export it again, or as PLY, OBJ or STL");
  }
  RawMesh out;
  out.up_axis = UpAxis::kY;  // assimp turns COLLADA so, glTF is so.
  PRESCENE_RETURN_IF_ERROR(append_nodes(*scene, options, &out));
  return out;
}

}  // namespace

Result<RawMesh> import_with_assimp(const std::filesystem::path& path, const MeshReadOptions& options) {
  try {
    return import_scene(path, options);
  } catch (const std::exception& error) {
    return core::invalid_input("cannot be read: " + quote(error.what(), 160) +
                               "; export it again, or as PLY, OBJ or STL");
  }
}

}  // namespace prescene::interfaces
