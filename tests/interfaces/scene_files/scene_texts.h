// SPDX-License-Identifier: Apache-2.0
// The scene files that tests read: all of scenarios/ and the one that docs/reference/scene_files.md is made of.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::tests {

struct SceneText {
  std::string name;  ///< Fit for a test's name.
  std::string file;
  std::string text;
  friend void PrintTo(const SceneText& scene, std::ostream* out) { *out << scene.file; }
};
std::vector<SceneText> scene_texts();
std::string text_of_file(const std::string& path_in_source);
/// The code blocks of a page that begin with ``` and just `info`, one after another.
std::string code_blocks(const std::string& page, const std::string& info);
/// Every mesh is a box of 8 x 10 x 12 cm (times the scale in mm), without touching the disk.
interfaces::SceneFileOptions options_with_meshes();

}  // namespace prescene::tests
