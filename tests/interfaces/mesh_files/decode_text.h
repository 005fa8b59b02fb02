// SPDX-License-Identifier: Apache-2.0
// Meshes from literals.
#pragma once

#include <string>
#include <string_view>

#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::interfaces {

inline core::Result<LoadedMesh> decode_text(MeshFormat format, std::string_view text,
                                            const MeshReadOptions& options = {}) {
  return decode_mesh(format, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, options);
}

inline std::string error_of(MeshFormat format, std::string_view text, const MeshReadOptions& options = {}) {
  return decode_text(format, text, options).status().message();
}

}  // namespace prescene::interfaces
