// SPDX-License-Identifier: Apache-2.0
// Bytes as a tree file, as they are and with the checksum made right.
#include <vector>

#include "prescene/collision/tree_file.h"
#include "prescene/collision/tree_file_seal.h"
#include "prescene/core/check.h"

using namespace prescene::collision;  // NOLINT(google-build-using-namespace)

namespace {

// Reads every value, so that a section outside of the bytes is seen by the address sanitizer.
template <class T>
void read_all(const TreeFile& file, std::size_t i) {
  const auto section = file.section<T>(i);
  if (!section) {
    PRESCENE_CHECK(!section.status().message().empty());
    return;
  }
  PRESCENE_CHECK(reinterpret_cast<std::uintptr_t>(section->data()) % kTreeFileAlignment == 0);
  unsigned sum = 0;
  for (const T value : section->span()) sum += static_cast<unsigned>(value);
  static_cast<void>(*static_cast<volatile unsigned*>(&sum));
}

void load(std::span<const std::uint8_t> bytes) {
  const TreeFileKey key{.kind = "fuzz", .layout = 1, .mesh_hash = 1, .settings_hash = 2};
  const auto file = TreeFile::from_bytes(bytes, key, "input");
  if (!file) {
    PRESCENE_CHECK(!file.status().message().empty());
    return;
  }
  PRESCENE_CHECK(file->section_count() <= kMostTreeFileSections);
  for (std::size_t i = 0; i <= file->section_count(); ++i) {
    read_all<std::uint8_t>(*file, i);
    read_all<std::uint32_t>(*file, i);
    read_all<std::uint64_t>(*file, i);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  load({data, size});
  std::vector<std::uint8_t> sealed(data, data + size);
  seal_tree_file(sealed);
  load(sealed);
  return 0;
}
