// SPDX-License-Identifier: Apache-2.0
// The meshes that the device has, in one buffer. Meshes are known by their numbers; when the buffer is full, all are
// forgotten and those that are asked for come again.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gl_buffer.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::rendering {

class DeviceMeshes {
 public:
  /// Never more bytes than `most`.
  explicit DeviceMeshes(std::size_t most);

  /// Where a mesh lies, in words.
  struct Place {
    std::uint32_t vertices_at = 0;
    std::uint32_t faces_at = 0;
  };

  /// Brings the mesh there if it isn't; null when there is no room left.
  const Place* find(const RenderMesh& mesh);
  /// Forgets all meshes and makes room for more, twice as much as before if there may be so much.
  void begin_again();
  void bind(unsigned binding) const { buffer_.bind(binding); }

 private:
  static std::size_t words_of(const RenderMesh& mesh);

  std::size_t most_words_;
  std::size_t words_ = 0;  ///< Taken.
  GlBuffer buffer_;
  std::map<std::uint64_t, Place> places_;
  std::vector<std::uint32_t> upload_;
};

}  // namespace prescene::rendering
