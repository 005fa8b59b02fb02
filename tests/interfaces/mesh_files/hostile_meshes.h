// SPDX-License-Identifier: Apache-2.0
// Mesh files that no exporter would write: sound ones with bytes changed at random, and ones made to be hard to read.
#pragma once

#include <string>
#include <vector>

#include "prescene/core/random.h"

namespace prescene::tests {

/// The ways in which mesh files are laid out.
enum class MeshKind { kObj, kPlyText, kPlyBinary, kStlText, kStlBinary, kGltf, kGlb, kCollada };

const char* name_of(MeshKind kind);
/// ".obj", ...
const char* extension_of(MeshKind kind);

/// Small and sound; between them they use what the format knows.
std::vector<std::string> sound_files(MeshKind kind);

/// One of the sound files with up to eight changes: bits, bytes and numbers replaced, pieces cut out, doubled, moved,
/// put in or taken from another file, the end cut off.
std::string mutated_file(const std::vector<std::string>& sound, core::RandomStream* stream);

/// Numbers that are too large, negative or none in each place of a sound file in turn, counts that promise more than
/// there is, nesting, names of things that are no files (a pipe "pipe" and a folder "folder" are to lie beside them),
/// and small files that ask for much. At least 80.
std::vector<std::string> crafted_files(MeshKind kind);

/// As many triangles as are allowed: the file that takes longest to read, and most memory. For PLY and STL.
std::string largest_file(MeshKind kind, std::size_t triangles, bool slivers);

}  // namespace prescene::tests
