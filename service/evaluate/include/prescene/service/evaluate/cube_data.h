// SPDX-License-Identifier: Apache-2.0
// The cube_tosses folder: tracked poses of one cube thrown onto a board.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/simulation/calibration/ballistic_fit.h"

namespace prescene::service {

struct CubeToss {
  int number = 0;                             ///< In the source.
  std::vector<simulation::TimedPose> frames;  ///< At 148 Hz; W is the board, z up, O the cube's middle.
};

enum class CubeSplit { kCalibrate, kReport, kAll };

/// All tosses of tosses_even.csv in the file's order. Errors name the file and line.
core::Result<std::vector<CubeToss>> read_cube_tosses(const std::filesystem::path& dir);
/// Those at even places of the list (calibrate), at odd ones (report), or all.
std::vector<CubeToss> select(const std::vector<CubeToss>& tosses, CubeSplit split);

}  // namespace prescene::service
