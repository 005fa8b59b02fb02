// SPDX-License-Identifier: Apache-2.0
// What waits for the disk.
#pragma once

#include <filesystem>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// kUnavailable with the path and the system's reason.
core::Status disk_error(const std::filesystem::path& path, int error);

/// Waits until what was written to an open file is on the disk. Pipes and character devices can't be waited for; that
/// is no loss. A file that has no name any more is an error. Errors speak of `path`.
core::Status sync_content(int descriptor, const std::filesystem::path& path);

/// Waits until the file's name in its folder is on the disk, too: a new file may be gone after a power failure
/// otherwise. Does nothing where the folder may not be read.
core::Status sync_name(const std::filesystem::path& path);

/// The same in two parts, of which the second needs no descriptor: the folder's, or -1 where it may not be read; and
/// waiting, which closes it.
core::Result<int> open_folder_of(const std::filesystem::path& path);
core::Status sync_and_close_folder(int folder, const std::filesystem::path& path);

}  // namespace prescene::interfaces
