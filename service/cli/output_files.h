// SPDX-License-Identifier: Apache-2.0
// Where verbs write: the files of recordings, and whether an output can be written at all, asked before there is one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/service/recording/rolling_recording.h"

namespace prescene::service {

class VerbContext;

/// Whether a recording is to be a folder as rosbag2 has it: its name ends with a slash.
bool names_bag(const std::string& output);
/// That folder, without the slash.
std::filesystem::path folder_of_bag(const std::string& output);
/// The first file of a recording that is such a folder: "run/run_0.mcap".
std::filesystem::path first_file_of_bag(const std::filesystem::path& folder);
/// Where to record a robot live, see unused_recording_path(); says so when it is another file than the one asked for.
/// Of a folder (names_bag()), its first file, in a folder that is not there yet.
std::string live_recording_path(const std::string& asked, VerbContext& context);
/// kInvalidInput where a bound on what is kept is given for a folder.
core::Status check_part_limits(const std::string& output, const PartLimits& limits);
/// kInvalidInput if two outputs, named by these options, are one file. Empty names are no files.
core::Status check_apart(const std::string& option, const std::string& output, const std::string& other_option,
                         const std::string& other);
/// kInvalidInput if `output`, named by `option`, would overwrite one of the inputs; kUnavailable where it can't be
/// written, so that nobody waits for a result that is then lost. Empty names are no files.
core::Status check_output(const std::string& option, const std::string& output, const std::vector<std::string>& inputs);
/// kInvalidInput if the name of a picture that is written as PNG ends like that of another kind of file (".jpg").
core::Status check_png(const std::string& option, const std::string& output);
/// check_output for a recording; kInvalidInput for what is there and no file, as a device, a pipe or a folder, or no
/// folder where the name ends with a slash.
core::Status check_recording(const std::string& option, const std::string& output,
                             const std::vector<std::string>& inputs);

}  // namespace prescene::service
