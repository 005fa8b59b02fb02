// SPDX-License-Identifier: Apache-2.0
#include "tests/interfaces/scene_files/scene_texts.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"
#include "tests/support/paths.h"

namespace prescene::tests {

std::string text_of_file(const std::string& path_in_source) {
  std::ifstream file(source_dir() / path_in_source, std::ios::binary);
  PRESCENE_CHECK_MSG(file, path_in_source);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string code_blocks(const std::string& page, const std::string& info) {
  std::string blocks, line;
  bool inside = false, wanted = false;
  std::istringstream lines(page);
  while (std::getline(lines, line)) {
    if (line.rfind("```", 0) == 0) {
      wanted = !inside && line.substr(3) == info;
      inside = !inside;
    } else if (inside && wanted) {
      blocks += line + "\n";
    }
  }
  return blocks;
}

std::vector<SceneText> scene_texts() {
  std::vector<SceneText> texts;
  for (const auto& entry : std::filesystem::directory_iterator(source_dir() / "scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string file = "scenarios/" + entry.path().filename().string();
    texts.push_back({entry.path().stem().string(), file, text_of_file(file)});
  }
  texts.push_back({"page", "page.yaml", code_blocks(text_of_file("docs/reference/scene_files.md"), "yaml")});
  std::sort(texts.begin(), texts.end(), [](const SceneText& a, const SceneText& b) { return a.name < b.name; });
  return texts;
}

interfaces::SceneFileOptions options_with_meshes() {
  interfaces::SceneFileOptions options;
  options.read_mesh = [](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    if (request.path.extension() != ".ply")
      return core::not_found(request.path.string() + ": no such file; check the path");
    return geometry::make_mesh(geometry::BoxShape{Eigen::Vector3d(80.0, 100.0, 120.0) * request.scale});
  };
  return options;
}

}  // namespace prescene::tests
