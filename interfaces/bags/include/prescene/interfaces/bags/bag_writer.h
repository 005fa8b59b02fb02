// SPDX-License-Identifier: Apache-2.0
// Makes a folder of MCAP files a bag of rosbag2, by writing its metadata.yaml: what `ros2 bag info` and `ros2 bag play`
// begin with.
//
//   PRESCENE_RETURN_IF_ERROR(write_bag_metadata("run", {"run/run_0.mcap"}));
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// In version 5, that of ROS 2 Humble: later releases read it, too. `files` lie in the folder, and are played in this
/// order. A player offers each topic as its channels say (mcap_writer.h, offered_qos_profiles), else reliably.
///
/// Counts and times are those of the files' statistics; a file without them, as one that was cut, is read through, and
/// what can't be read of it is left out. Errors of McapReader::open; kUnavailable where the file can't be written.
core::Status write_bag_metadata(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files);

}  // namespace prescene::interfaces
