// SPDX-License-Identifier: Apache-2.0
// A folder of recorded motions of one object: scene.yaml describes it and what it falls or slides on, tosses.csv holds
// the poses that a tracker saw. docs/reference/calibration.md is the page for who makes one.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::service {

struct MotionRecording {
  std::string name;  ///< "toss 12"
  std::vector<simulation::TimedPose> frames;
};

struct MotionDataset {
  std::filesystem::path folder;
  std::shared_ptr<const belief::Scene> scene;
  std::vector<MotionRecording> recordings;  ///< In the file's order.
  std::vector<std::string> inputs;          ///< Files that were read, and the scene's model file and meshes.

  std::filesystem::path scene_file() const { return folder / "scene.yaml"; }
  std::filesystem::path table_file() const { return folder / "tosses.csv"; }
};

/// One recording for each value of the column `toss`, whose rows stand together. Columns may come in any order, others
/// are left out, as is a byte order mark. Fails with kNotFound or kInvalidInput that name file, line and remedy: a
/// missing file or column, a cell that is no finite number, times that do not ascend, a quaternion that is not of
/// length one, a toss in two places, a scene that has not exactly one object.
core::Result<MotionDataset> read_motion_dataset(const std::filesystem::path& folder, const core::LogSink& log);

/// The table alone.
core::Result<std::vector<MotionRecording>> read_motion_table(const std::filesystem::path& file);

}  // namespace prescene::service
