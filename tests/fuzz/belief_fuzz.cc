// SPDX-License-Identifier: Apache-2.0
// Any bytes as a belief about a scene of two objects, and as the summary of one that is published: understood, or
// refused with a reason; what is understood can be written down and read again.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz_scene.h"
#include "prescene/belief/json.h"
#include "prescene/core/check.h"
#include "prescene/service/belief_summary.h"

namespace {

using namespace prescene;  // NOLINT(google-build-using-namespace)

std::shared_ptr<const belief::Scene> scene() {
  static const auto kScene = fuzz::scene_from(
      "name: two\nmodels:\n  box: {box: [0.1, 0.1, 0.1], mass: 0.4}\nsupports:\n  floor: {ground: {size: 4}}\n"
      "objects:\n  a: {model: box, pose: {position: [0, 0, 0.05]}}\n"
      "  b: {model: box, pose: {position: [1, 0, 0.05]}}\n");
  return kScene;
}

void read_summary(const std::string& text) {
  const auto summary = service::belief_summary_from_json(text);
  if (!summary) {
    PRESCENE_CHECK(!summary.status().message().empty());
    return;
  }
  for (const service::ObjectSummary& object : summary->objects) PRESCENE_CHECK(object.X_WO.is_finite());
  const std::string again = service::to_json(*summary).dump();
  const auto read = service::belief_summary_from_json(again);
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
  PRESCENE_CHECK(read->objects.size() == summary->objects.size() && read->stamp_ns == summary->stamp_ns);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read_summary(text);
  const auto document = belief::parse_json(text);
  if (!document) {
    PRESCENE_CHECK(!document.status().message().empty());
    return 0;
  }
  const auto belief = belief::belief_from_json(*document, scene());
  if (!belief) {
    PRESCENE_CHECK(!belief.status().message().empty());
    return 0;
  }
  const auto again = belief::belief_from_json(belief::to_json(*belief), scene());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(again->step == belief->step && again->objects.size() == belief->objects.size());
  return 0;
}
