// SPDX-License-Identifier: Apache-2.0
#include "hostile_meshes.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>

#include "crafted_meshes.h"
#include "prescene/core/check.h"

namespace prescene::tests {
namespace {

std::string odd_bytes(core::RandomStream* stream) {
  switch (stream->uniform_below(5)) {
    case 0:
      return kOddNumbers[stream->uniform_below(std::size(kOddNumbers))];
    case 1:
      return bytes_of(static_cast<std::uint32_t>(stream->uniform_below(4)) - 2U);
    case 2:
      return bytes_of(std::uint32_t{1} << stream->uniform_below(32));
    case 3:
      return bytes_of(stream->uniform_below(2) == 0 ? std::numeric_limits<float>::infinity() : 1e38F);
    default: {
      const auto byte = static_cast<char>(stream->uniform_below(256));
      return std::string(1 + stream->uniform_below(16), byte);
    }
  }
}

void change(const std::vector<std::string>& sound, core::RandomStream* stream, std::string* file) {
  if (file->empty()) return;
  const std::size_t at = stream->uniform_below(file->size());
  const std::size_t length = std::min<std::size_t>(file->size() - at, 1 + stream->uniform_below(32));
  switch (stream->uniform_below(9)) {
    case 0:
      (*file)[at] = static_cast<char>((*file)[at] ^ (1 << stream->uniform_below(8)));
      break;
    case 1:
      (*file)[at] = static_cast<char>(stream->uniform_below(256));
      break;
    case 2: {
      const std::vector<Piece> numbers = numbers_in(*file);
      if (numbers.empty()) break;
      const Piece& number = numbers[stream->uniform_below(numbers.size())];
      file->replace(number.begin, number.length, kOddNumbers[stream->uniform_below(std::size(kOddNumbers))]);
      break;
    }
    case 3:
      file->erase(at, length);
      break;
    case 4:
      file->insert(at, file->substr(at, length));
      break;
    case 5:
      file->insert(stream->uniform_below(file->size()), file->substr(at, length));
      break;
    case 6:
      file->insert(at, odd_bytes(stream));
      break;
    case 7: {
      const std::string bytes = odd_bytes(stream);
      file->replace(at, std::min(bytes.size(), file->size() - at), bytes);
      break;
    }
    default: {
      const std::string& other = sound[stream->uniform_below(sound.size())];
      if (stream->uniform_below(4) == 0)
        file->resize(at);
      else
        file->replace(at, length, other.substr(stream->uniform_below(other.size()), length));
    }
  }
}

}  // namespace

const char* name_of(MeshKind kind) {
  constexpr const char* kNames[] = {"obj",        "ply_text", "ply_binary", "stl_text",
                                    "stl_binary", "gltf",     "glb",        "collada"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* extension_of(MeshKind kind) {
  constexpr const char* kExtensions[] = {".obj", ".ply", ".ply", ".stl", ".stl", ".gltf", ".glb", ".dae"};
  return kExtensions[static_cast<std::size_t>(kind)];
}

std::vector<std::string> sound_files(MeshKind kind) {
  switch (kind) {
    case MeshKind::kObj:
      return sound_obj();
    case MeshKind::kPlyText:
    case MeshKind::kPlyBinary:
      return sound_ply(kind == MeshKind::kPlyText);
    case MeshKind::kStlText:
    case MeshKind::kStlBinary:
      return sound_stl(kind == MeshKind::kStlText);
    case MeshKind::kGltf:
      return {sound_gltf().dump(), sound_gltf().dump(1)};
    case MeshKind::kGlb:
      return {glb_of(sound_gltf(), sound_buffer())};
    case MeshKind::kCollada:
      return {sound_collada(), collada_polygons()};
  }
  PRESCENE_CHECK_MSG(false, "no such kind");
}

std::string mutated_file(const std::vector<std::string>& sound, core::RandomStream* stream) {
  std::string file = sound[stream->uniform_below(sound.size())];
  for (std::uint64_t left = 1 + stream->uniform_below(8); left > 0; --left) change(sound, stream, &file);
  return file;
}

std::vector<std::string> crafted_files(MeshKind kind) {
  std::vector<std::string> files;
  switch (kind) {
    case MeshKind::kObj:
      files = crafted_obj();
      break;
    case MeshKind::kPlyText:
    case MeshKind::kPlyBinary:
      files = crafted_ply(kind == MeshKind::kPlyText);
      break;
    case MeshKind::kStlText:
    case MeshKind::kStlBinary:
      files = crafted_stl(kind == MeshKind::kStlText);
      break;
    case MeshKind::kGltf:
      files = crafted_gltf();
      break;
    case MeshKind::kGlb:
      files = crafted_glb();
      break;
    case MeshKind::kCollada:
      files = crafted_collada();
      break;
  }
  PRESCENE_CHECK(files.size() >= kLeastCrafted);
  return files;
}

std::string largest_file(MeshKind kind, std::size_t triangles, bool slivers) {
  core::RandomStream stream(3, core::Purpose::kTest);
  const auto count = static_cast<std::uint32_t>(triangles);
  const std::uint32_t vertices = slivers ? count + 2 : count / 2;
  const auto vertex = [&](std::uint32_t v) {
    // Slivers: corners along a line, now and then one beside it.
    if (slivers) return bytes_of(static_cast<float>(v)) + bytes_of(v % 1000 == 0 ? 1.0F : 0.0F) + bytes_of(0.0F);
    core::RandomStream place(v, core::Purpose::kTest);
    std::string bytes;
    for (int i = 0; i < 3; ++i) bytes += bytes_of(static_cast<float>(place.uniform()));
    return bytes;
  };
  const auto corner = [&](std::uint32_t t, std::uint32_t k) {
    return slivers ? t + k : static_cast<std::uint32_t>(stream.uniform_below(vertices));
  };
  std::string file;
  if (kind == MeshKind::kPlyBinary) {
    file = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(count) +
           "\nproperty list uchar uint vertex_indices\nend_header\n";
    for (std::uint32_t v = 0; v < vertices; ++v) file += vertex(v);
    for (std::uint32_t t = 0; t < count; ++t) {
      file += '\3';
      for (std::uint32_t k = 0; k < 3; ++k) file += bytes_of(corner(t, k));
    }
    return file;
  }
  PRESCENE_CHECK(kind == MeshKind::kStlBinary);
  file = std::string(80, '\0') + bytes_of(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    file.append(12, '\0');
    for (std::uint32_t k = 0; k < 3; ++k) file += vertex(corner(t, k));
    file.append(2, '\0');
  }
  return file;
}

}  // namespace prescene::tests
