// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: which elements with which properties follow it, and how their values are written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

enum class PlyType { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

/// Of a value in a binary file, bytes.
inline std::size_t bytes_of(PlyType type) {
  static constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kF32;
  std::optional<PlyType> list_count;  ///< Set for lists.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding { kText, kLittleEndian, kBigEndian };

struct PlyHeader {
  std::optional<PlyEncoding> encoding;  ///< Set once the header is read.
  std::vector<PlyElement> elements;
  bool names_texture = false;  ///< By a comment, as MeshLab and others write it.
  // Where the values begin.
  std::size_t body_line = 1;
  std::size_t body_byte = 0;
};

/// The header at the beginning of a file; what is wrong with it, with the line.
core::Result<PlyHeader> parse_ply_header(std::string_view text);

}  // namespace prescene::interfaces
