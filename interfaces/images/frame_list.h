// SPDX-License-Identifier: Apache-2.0
// The text files of a frame folder.
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/images/frame_folder.h"

namespace prescene::interfaces {

/// The rows of camera_poses.csv; paths stay relative, frames without the column stamp_ns get stamps at the options'
/// rate. Errors begin with "line N: ".
core::Result<std::vector<FolderFrame>> parse_camera_poses(std::string_view text, const FrameFolderOptions& options);

/// fx, fy, cx, cy of a 3x3 matrix in text; the size stays 0. Errors begin with "line N: ".
core::Result<geometry::PinholeCamera> parse_intrinsics(std::string_view text);

/// A camera-to-world matrix as a pose; kInvalidInput when it is not finite or not rigid within 1e-3.
core::Result<geometry::Pose> rigid_pose(const Eigen::Matrix4d& matrix);

/// Stamp of the frame at this place of the list, for frames without one.
std::int64_t stamp_at(std::size_t index, const FrameFolderOptions& options);

}  // namespace prescene::interfaces
