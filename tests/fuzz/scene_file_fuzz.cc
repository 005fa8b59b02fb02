// SPDX-License-Identifier: Apache-2.0
// Any bytes as a scene file: read, or refused with a message; a scene that is read is valid and can be started.
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/scene_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  interfaces::SceneFileOptions options;
  options.follow_files = false;
  interfaces::FileReport report;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto scene = interfaces::parse_scene(text, "fuzz.yaml", options, &report);
  PRESCENE_CHECK(scene.ok() == report.errors.empty());
  if (!scene) {
    PRESCENE_CHECK(!scene.status().message().empty());
    return 0;
  }
  PRESCENE_CHECK(belief::validate(*scene).ok());
  const std::vector<double> middle(static_cast<std::size_t>(belief::start_dimensions(*scene)), 0.3);
  PRESCENE_CHECK(belief::draw_start(*scene, middle).objects.size() == scene->objects.size());
  return 0;
}
