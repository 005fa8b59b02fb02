// SPDX-License-Identifier: Apache-2.0
#include "gl_meshes.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <cstdint>
#include <string>
#include <vector>

namespace prescene::rendering {
namespace {

struct Corner {
  float position[3];
  float normal[3];
  float place[2];
  std::uint8_t color[4];
};

std::vector<Corner> corners_of(const RenderMesh& mesh) {
  std::vector<Corner> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3f& n = mesh.normals[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t index = mesh.triangles[i][k];
      const Vector3f& p = mesh.vertices[index];
      Corner corner{{p.x(), p.y(), p.z()}, {n.x(), n.y(), n.z()}, {0.0f, 0.0f}, {0, 0, 0, 255}};
      if (!mesh.look.texture_places.empty()) {
        corner.place[0] = mesh.look.texture_places[i][k].x();
        corner.place[1] = mesh.look.texture_places[i][k].y();
      }
      if (!mesh.look.vertex_colors.empty())
        for (std::size_t c = 0; c < 3; ++c) corner.color[c] = mesh.look.vertex_colors[index][c];
      corners.push_back(corner);
    }
  }
  return corners;
}

template <class Member>
void attribute(MeshAttribute location, GLint size, GLenum type, GLboolean normalised, Member Corner::*member) {
  const Corner corner{};
  const auto offset = reinterpret_cast<const char*>(&(corner.*member)) - reinterpret_cast<const char*>(&corner);
  glVertexAttribPointer(location, size, type, normalised, sizeof(Corner),
                        reinterpret_cast<const void*>(static_cast<std::uintptr_t>(offset)));
  glEnableVertexAttribArray(location);
}

core::Result<GLuint> uploaded_texture(const geometry::ColorImage& image) {
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (image.width() > most || image.height() > most)
    return core::unsupported("OpenGL renderer: a texture of " + std::to_string(image.width()) + " x " +
                             std::to_string(image.height()) + " is larger than the device's " + std::to_string(most) +
                             ": make it smaller, or use the reference renderer");
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, image.width(), image.height(), 0, GL_RGB, GL_UNSIGNED_BYTE, image.data());
  // Texels are fetched one by one; without this the texture would count as incomplete.
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

}  // namespace

void GlMeshes::free(const GlMesh& mesh) {
  glDeleteBuffers(1, &mesh.buffer);
  glDeleteVertexArrays(1, &mesh.vertex_array);
  if (mesh.texture != 0) glDeleteTextures(1, &mesh.texture);
}

GlMeshes::~GlMeshes() {
  for (const auto& [address, mesh] : meshes_) free(mesh);
}

void GlMeshes::forget_unused() {
  for (auto i = meshes_.begin(); i != meshes_.end();) {
    if (!i->second.mesh.expired()) {
      ++i;
      continue;
    }
    free(i->second);
    i = meshes_.erase(i);
  }
}

core::Result<const GlMesh*> GlMeshes::get(const MeshHandle& mesh) {
  const auto known = meshes_.find(mesh.get());
  if (known != meshes_.end()) {
    if (known->second.mesh.lock() == mesh) return &known->second;
    // Another mesh at the address of one that is gone.
    free(known->second);
    meshes_.erase(known);
  }
  GlMesh entry;
  entry.mesh = mesh;
  entry.vertices = static_cast<int>(3 * mesh->triangles.size());
  entry.colored = !mesh->look.vertex_colors.empty();
  if (!mesh->look.texture_places.empty()) {
    PRESCENE_TRY(entry.texture, uploaded_texture(*mesh->look.texture));
  }
  const std::vector<Corner> corners = corners_of(*mesh);
  glGenVertexArrays(1, &entry.vertex_array);
  glBindVertexArray(entry.vertex_array);
  glGenBuffers(1, &entry.buffer);
  glBindBuffer(GL_ARRAY_BUFFER, entry.buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(Corner)), corners.data(),
               GL_STATIC_DRAW);
  attribute(kPosition, 3, GL_FLOAT, GL_FALSE, &Corner::position);
  attribute(kNormal, 3, GL_FLOAT, GL_FALSE, &Corner::normal);
  attribute(kColor, 3, GL_UNSIGNED_BYTE, GL_TRUE, &Corner::color);
  attribute(kPlace, 2, GL_FLOAT, GL_FALSE, &Corner::place);
  return &meshes_.emplace(mesh.get(), entry).first->second;
}

}  // namespace prescene::rendering
