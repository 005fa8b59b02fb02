// SPDX-License-Identifier: Apache-2.0
// The file that every tree of this library is kept in, so that a service starts without building it anew: sections of
// plain values behind a header that says which tree of which mesh and settings they are.
//
//   TreeFileKey key{.kind = "boxes", .layout = 1, .mesh_hash = mesh.content_hash(), .settings_hash = hash};
//   PRESCENE_RETURN_IF_ERROR(TreeFileWriter(key).add(nodes.span()).add(triangles.span()).write(path));
//
//   PRESCENE_TRY(const TreeFile file, TreeFile::open(path, key));
//   PRESCENE_TRY(Array<Node> nodes, file.section<Node>(0));        // looks at the mapped file and keeps it mapped
//
// A checksum guards against damage, not against malice: whoever can write the files can make a tree that answers
// wrongly, and each tree checks its own indices. While a file is mapped it may be replaced or removed, but not be
// shortened or written over; TreeFileWriter replaces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "prescene/collision/array.h"
#include "prescene/core/status.h"

namespace prescene::collision {

/// Sections begin at multiples of this, in the file and in memory.
inline constexpr std::size_t kTreeFileAlignment = 64;
inline constexpr std::size_t kMostTreeFileSections = 62;

/// What a file must agree with to be read.
struct TreeFileKey {
  std::string_view kind;            ///< Of tree: 1 to 15 characters (checked).
  std::uint32_t layout = 1;         ///< Version of the kind's sections: to be raised when their meaning changes.
  std::uint64_t mesh_hash = 0;      ///< Mesh::content_hash.
  std::uint64_t settings_hash = 0;  ///< Of what else the tree depends on.
};

template <class T>
concept TreeFileValue = std::is_trivially_copyable_v<T> && alignof(T) <= kTreeFileAlignment;

/// Collects sections; the values must stay where they are until the file is written.
class TreeFileWriter {
 public:
  explicit TreeFileWriter(const TreeFileKey& key);

  /// Adds a section, at most kMostTreeFileSections (checked).
  template <TreeFileValue T>
  TreeFileWriter& add(std::span<const T> values) {
    return add_section({reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()}, sizeof(T));
  }

  std::vector<std::uint8_t> bytes() const;
  /// Writes beside the target and renames: readers see the old file or the new one. A link stays, the file that it
  /// leads to is written. kInvalidInput when there is something else than a file, kNotFound when the folder does not
  /// exist, kResourceExhausted when the disk is full, kUnavailable for other failures; the text begins with the path.
  core::Status write(const std::filesystem::path& path) const;

 private:
  struct Section {
    std::span<const std::uint8_t> bytes;
    std::uint64_t element_size;
  };
  TreeFileWriter& add_section(std::span<const std::uint8_t> bytes, std::size_t element_size);

  std::string kind_;
  TreeFileKey key_;
  std::vector<Section> sections_;
};

class TreeFile {
 public:
  /// Maps the file. kNotFound when there is none, kUnavailable when it can't be read, kDataLoss when it is cut or
  /// damaged, kUnsupported when another version wrote it, kInvalidInput when it is no such file or belongs to another
  /// kind of tree, mesh or settings. The text begins with the path, says why, and that the file can be deleted.
  static core::Result<TreeFile> open(const std::filesystem::path& path, const TreeFileKey& key);
  /// From memory, which is copied; `name` takes the path's place.
  static core::Result<TreeFile> from_bytes(std::span<const std::uint8_t> bytes, const TreeFileKey& key,
                                           std::string_view name);

  /// The path or name that messages begin with.
  const std::string& name() const { return name_; }
  std::size_t section_count() const { return sections_.size(); }
  /// kDataLoss when there is no such section or its values have another size.
  template <TreeFileValue T>
  core::Result<Array<T>> section(std::size_t i) const {
    PRESCENE_TRY(const std::span<const std::uint8_t> bytes, section_bytes(i, sizeof(T)));
    // The values were written from objects of this type; the memory is aligned and never written to.
    return Array<T>({reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)}, memory_);
  }

 private:
  struct Section {
    std::span<const std::uint8_t> bytes;
    std::uint64_t element_size;
  };
  TreeFile() = default;
  core::Result<std::span<const std::uint8_t>> section_bytes(std::size_t i, std::size_t element_size) const;
  static core::Result<TreeFile> make(std::shared_ptr<const void> memory, std::span<const std::uint8_t> bytes,
                                     const TreeFileKey& key, std::string name);

  std::string name_;
  std::shared_ptr<const void> memory_;
  std::vector<Section> sections_;
};

}  // namespace prescene::collision
