// SPDX-License-Identifier: Apache-2.0
// Any bytes as the belief that a file of a recording goes on from: understood, or refused with a reason; what is
// understood is a belief of its scene, and is written down and read again, or its scene can't be written.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz_scene.h"
#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/core/hash.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/tracker_snapshot.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

std::shared_ptr<const belief::Scene> scene() {
  static const auto kScene = fuzz::scene_from(
      "name: two\nnew_objects: true\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\n"
      "supports:\n  floor: {ground: {size: 4}}\nrobot:\n  hand: {parts: [{box: [0.05, 0.05, 0.04]}], pose: "
      "{position: [0, 0, 1]}}\n"
      "objects:\n  a: {model: box, pose: {position: [0, 0, 0.05]}}\n"
      "  b: {model: box, pose: {position: [1, 0, 0.05]}}\n");
  return kScene;
}

void read(const std::string& text) {
  const auto snapshot = service::snapshot_from_text(text, scene());
  if (!snapshot) {
    PRESCENE_CHECK(!snapshot.status().message().empty());
    return;
  }
  const belief::Belief& belief = *snapshot->belief;
  PRESCENE_CHECK(belief.objects.size() == belief.scene->objects.size());
  for (const belief::SceneObject& object : belief.scene->objects)
    PRESCENE_CHECK(object.model >= 0 && static_cast<std::size_t>(object.model) < belief.scene->models.size());
  const auto again = service::snapshot_text(*snapshot, scene());
  PRESCENE_CHECK_MSG(again.ok() || again.status().code() == core::StatusCode::kUnsupported, again.status().message());
}

/// The text with the hash of the belief in it, which no chance would find, so that what is after that check is tried.
std::string with_hash(const std::string& text) {
  nlohmann::ordered_json json = service::parse_or_discard(text);
  if (!json.is_object() || !json.contains("belief")) return text;
  auto roomy = std::make_shared<belief::Scene>(*scene());
  roomy->models.resize(4, roomy->models.front());  // those of what was found
  const auto belief = belief::belief_from_json(json["belief"], roomy);
  if (!belief) return text;
  json["belief_hash"] = core::hash_text(belief::content_hash(*belief));
  return belief::json_text(json);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read(text);
  read(with_hash(text));
  return 0;
}
