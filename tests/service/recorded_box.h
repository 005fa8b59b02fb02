// SPDX-License-Identifier: Apache-2.0
// A scene that tracks quickly, and recordings of what a simulated robot sees of a scene.
#pragma once

#include <filesystem>
#include <string>

#include "prescene/core/status.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/recording/simulated_recording.h"

namespace prescene::tests {

/// A box at rest on a table, seen by a small camera for `duration` seconds; `more_of_pose` goes behind its position.
inline std::string box_on_table(const std::string& duration, const std::string& more_of_pose = "") {
  return "name: box\nduration: " + duration + R"(
models:
  box: {box: [0.12, 0.08, 0.1], mass: 0.4}
supports:
  table: {box: [0.8, 0.8, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  box: {model: box, pose: {position: [0, 0, 0.05])" +
         more_of_pose + R"(}}
camera:
  width: 80
  height: 60
  fov_deg: 55
  look: {from: [0.55, -0.5, 0.5], at: [0, 0, 0.03]}
)";
}

/// Writes what a robot with `rate` frames a second sees of a scene, through a lens, to `path`, with seed 1.
inline core::Status record_scene(const std::string& yaml, const service::RecordingInfo& info, double rate,
                                 const std::filesystem::path& path, const geometry::LensDistortion& lens = {}) {
  core::ThreadPool pool(1);
  service::Backends backends(pool);
  PRESCENE_TRY(const auto scene, service::load_scene_text(yaml, "scene.yaml", {}));
  PRESCENE_TRY(const auto recording, service::RecordingWriter::create(path, info));
  service::SimulatedRecordingOptions options;
  options.rate = rate;
  options.lens = lens;
  PRESCENE_RETURN_IF_ERROR(service::simulate_recording(*scene, options, 1, backends, {}, {}, *recording));
  return recording->close();
}

}  // namespace prescene::tests
