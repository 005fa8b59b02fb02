// SPDX-License-Identifier: Apache-2.0
// A scene that targets read what is about it with.
#pragma once

#include <memory>

#include "prescene/core/check.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::fuzz {

/// Of a valid scene file's text.
inline std::shared_ptr<const belief::Scene> scene_from(const char* text) {
  interfaces::FileReport report;
  auto read = interfaces::parse_scene(text, "two.yaml", {}, &report);
  PRESCENE_CHECK_MSG(read.ok(), read.status().message());
  return std::make_shared<const belief::Scene>(*std::move(read));
}

}  // namespace prescene::fuzz
