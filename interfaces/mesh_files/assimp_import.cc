// SPDX-License-Identifier: Apache-2.0
// glTF and COLLADA through assimp, which crashes, hangs or uses up the memory on some files: it runs in a child process
// with limits, may open files of the model's folder only, and what it answers is checked.
#include <assimp/config.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <exception>
#include <new>
#include <sstream>
#include <utility>
#include <vector>

#include "confined_files.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/mesh_files/import_reply.h"
#include "prescene/interfaces/mesh_files/limited_child.h"
#include "raw_mesh.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

constexpr const char* kConvert = "; convert it to PLY, OBJ or STL, for instance with MeshLab or Blender";

/// Whether it has colours that nothing here reads.
bool has_look(const aiScene& scene) {
  const auto is_colored = [](const aiMesh* mesh) { return mesh->HasVertexColors(0); };
  const auto is_textured = [](const aiMaterial* material) {
    return material->GetTextureCount(aiTextureType_DIFFUSE) > 0 ||
           material->GetTextureCount(aiTextureType_BASE_COLOR) > 0;
  };
  return std::any_of(scene.mMeshes, scene.mMeshes + scene.mNumMeshes, is_colored) ||
         std::any_of(scene.mMaterials, scene.mMaterials + scene.mNumMaterials, is_textured);
}

/// The triangles of one mesh, moved to the root's frame.
Status append_mesh(const aiMesh& mesh, unsigned number, const aiMatrix4x4& X, const MeshReadOptions& options,
                   RawMesh* out) {
  const auto first = static_cast<std::uint32_t>(out->mesh.vertices.size());
  PRESCENE_RETURN_IF_ERROR(check_triangle_count(first + std::size_t{mesh.mNumVertices}, options));
  PRESCENE_RETURN_IF_ERROR(check_triangle_count(out->mesh.triangles.size() + mesh.mNumFaces, options));
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D p = X * mesh.mVertices[v];
    out->mesh.vertices.push_back({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)});
    note_vertex(out->mesh.vertices.back(), "mesh", number, v, out);
  }
  const bool mirrored = aiMatrix3x3(X).Determinant() < 0.0F;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;  // Points and lines.
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (face.mIndices[k] >= mesh.mNumVertices) {
        return core::invalid_input("a face of mesh " + std::to_string(number) + " names vertex " +
                                   std::to_string(face.mIndices[k]) + " of " + std::to_string(mesh.mNumVertices));
      }
      corners[k] = first + face.mIndices[k];
    }
    if (mirrored) std::swap(corners[1], corners[2]);
    out->mesh.triangles.push_back(corners);
  }
  return core::ok_status();
}

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
    for (unsigned m = 0; m < node->mNumMeshes; ++m) {
      const unsigned number = node->mMeshes[m];
      if (number >= scene.mNumMeshes) return core::invalid_input("a node names mesh " + std::to_string(number));
      PRESCENE_RETURN_IF_ERROR(append_mesh(*scene.mMeshes[number], number, X, options, out));
    }
  }
  return core::ok_status();
}

/// Leaves the importers of one format: by their first bytes, files would else be given to any of the forty others.
void keep_importers_of(MeshFormat format, Assimp::Importer* importer) {
  const std::string wanted = format == MeshFormat::kGltf ? "gltf" : "dae";
  for (std::size_t i = importer->GetImporterCount(); i > 0; --i) {
    const aiImporterDesc* about = importer->GetImporterInfo(i - 1);
    bool reads_it = false;
    std::istringstream extensions(about ? about->mFileExtensions : "");
    for (std::string extension; extensions >> extension;) reads_it = reads_it || extension == wanted;
    if (!reads_it) importer->UnregisterLoader(importer->GetImporter(i - 1));
  }
}

/// The importers catch this one like any other.
void rethrow_lack_of_memory(const std::exception_ptr& caught) {
  if (!caught) return;
  try {
    std::rethrow_exception(caught);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (...) {  // Is in the importer's text.
  }
}

Result<ImportedMesh> import_scene(const std::filesystem::path& path, MeshFormat format,
                                  const MeshReadOptions& options) {
  // Never destroyed: the memory of the child is the system's to take back, and destroying what is nested deeply may
  // overflow the stack.
  Assimp::Importer& importer = *new Assimp::Importer;                    // NOLINT(cppcoreguidelines-owning-memory)
  auto* files = new ConfinedFiles(path, options.max_assimp_file_bytes);  // NOLINT(cppcoreguidelines-owning-memory)
  keep_importers_of(format, &importer);
  importer.SetIOHandler(files);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, options.up_axis != UpAxis::kDeclared);
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    rethrow_lack_of_memory(importer.GetException());
    std::string why = quote(importer.GetErrorString(), 160);
    if (!files->refusal().empty()) why += " (" + files->refusal() + ")";
    return core::invalid_input(why);
  }
  RawMesh raw;
  PRESCENE_RETURN_IF_ERROR(append_nodes(*scene, options, &raw));
  return ImportedMesh{std::move(raw.mesh), std::move(raw.first_non_finite), has_look(*scene)};
}

void import_and_reply(const std::filesystem::path& path, MeshFormat format, const MeshReadOptions& options,
                      ChildOutput& out) {
  try {
    send_reply(import_scene(path, format, options), out);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    send_reply(core::invalid_input(quote(error.what(), 160)), out);
  }
}

}  // namespace

Result<RawMesh> import_with_assimp(const std::filesystem::path& path, MeshFormat format,
                                   const MeshReadOptions& options) {
  const ChildLimits limits{options.max_importer_memory, options.max_importer_time, largest_reply(options)};
  const Result<std::vector<std::uint8_t>> reply = run_in_child(
      [&](ChildOutput& out) { import_and_reply(path, format, options, out); }, limits, options.cancellation);
  if (!reply) {
    const Status& status = reply.status();
    const bool of_the_file =
        status.code() == core::StatusCode::kInvalidInput || status.code() == core::StatusCode::kResourceExhausted;
    return Status(status.code(), "the importer " + status.message() + (of_the_file ? kConvert : ""));
  }
  Result<ImportedMesh> imported = decode_reply(*reply, options);
  if (!imported) {
    if (imported.status().code() == core::StatusCode::kResourceExhausted) return imported.status();
    return Status(imported.status().code(),
                  "cannot be read: " + imported.status().message() + "; export it again, or as PLY, OBJ or STL");
  }
  RawMesh out;
  out.mesh = std::move(imported->mesh);
  out.first_non_finite = std::move(imported->first_non_finite);
  out.unread_look = imported->has_look;
  out.up_axis = UpAxis::kY;  // assimp turns COLLADA so, glTF is so.
  return out;
}

}  // namespace prescene::interfaces
