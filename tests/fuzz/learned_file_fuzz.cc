// SPDX-License-Identifier: Apache-2.0
// Any bytes as a learned file: read, or refused with a reason. What is read is written as a file that holds the same,
// and put into a scene, or refused there.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "fuzz_scene.h"
#include "prescene/belief/object_model.h"
#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/learned_file.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

const belief::Scene& scene() {
  static const auto kScene = fuzz::scene_from(
      "name: two\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: {normal: [0.4, 0.02]}, friction: {uniform: [0.3, "
      "0.9]}}\n"
      "supports:\n  floor: {ground: {size: 4}}\nobjects:\n  a: {model: box, pose: {position: [0, 0, 0.05]}}\n"
      "  b: {model: box, pose: {position: [1, 0, 0.05]}}\n");
  return *kScene;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  interfaces::FileReport report;
  const auto learned = interfaces::parse_learned(text, "learned.yaml", &report);
  PRESCENE_CHECK(learned.ok() == report.errors.empty());
  if (!learned) {
    PRESCENE_CHECK(!learned.status().message().empty());
    return 0;
  }
  const std::string written = interfaces::learned_yaml(*learned);
  const auto again = interfaces::parse_learned(written, "again.yaml");
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(interfaces::learned_yaml(*again) == written);
  const auto with = interfaces::with_learned_models(scene(), *learned);
  PRESCENE_CHECK(with.ok() || !with.status().message().empty());
  if (with)
    for (const belief::ObjectModel& model : with->models) PRESCENE_CHECK(belief::validate(model).ok());
  const auto physics = interfaces::learned_physics(with ? *with : scene(), *learned);
  PRESCENE_CHECK(physics.ok() || !physics.status().message().empty());
  if (physics) PRESCENE_CHECK(physics->size() == scene().objects.size());
  return 0;
}
