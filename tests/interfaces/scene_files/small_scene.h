// SPDX-License-Identifier: Apache-2.0
// A small scene file, what it reads as, and what is wrong with it.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "prescene/interfaces/scene_files/scene_file.h"
#include "tests/interfaces/scene_files/scene_texts.h"

namespace prescene::interfaces::small_scene {

/// The text of a scene of one box on a table; `more` goes behind it, `model`, `object` into the maps.
inline std::string small(const std::string& more = "", const std::string& model = "", const std::string& object = "") {
  return "models:\n  block:\n    box: [0.1, 0.2, 0.3]\n" +
         (model.find("mass") + 1 || model.find("density") + 1 ? "" : std::string("    mass: 1\n")) + model +
         "supports:\n  table: {box: [1, 1, 0.1]}\n  bin: {open_bin: {inner: [0.2, 0.3, 0.4], wall: 0.01}}\n" +
         "objects:\n  block:\n    model: block\n" +
         (object.find("pose") + 1 ? "" : std::string("    pose: {position: [0, 0, 0.2]}\n")) + object + more;
}

inline belief::Scene scene_of(const std::string& text) {
  const auto scene = parse_scene(text, "s.yaml", tests::options_with_meshes());
  EXPECT_TRUE(scene.ok()) << scene.status().message() << "\n" << text;
  return scene.ok() ? *scene : belief::Scene{};
}
inline std::string error_of(const std::string& text) {
  return parse_scene(text, "s.yaml", tests::options_with_meshes()).status().message();
}

}  // namespace prescene::interfaces::small_scene
