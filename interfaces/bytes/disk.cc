// SPDX-License-Identifier: Apache-2.0
#include "disk.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace prescene::interfaces {
namespace {

/// Of what has no disk behind it, or one that is not written to.
bool has_no_disk(int error) { return error == EINVAL || error == EROFS; }

}  // namespace

core::Status disk_error(const std::filesystem::path& path, int error) {
  return core::unavailable(path.string() + ": cannot be kept on the disk: " + std::generic_category().message(error) +
                           "; free some space or choose another disk");
}

core::Status sync_content(int descriptor, const std::filesystem::path& path) {
  if (::fdatasync(descriptor) != 0 && !has_no_disk(errno)) return disk_error(path, errno);
  struct stat information {};
  if (::fstat(descriptor, &information) == 0 && S_ISREG(information.st_mode) && information.st_nlink == 0)
    return core::unavailable(path.string() + ": was removed while it was written; what was in it is lost");
  return core::ok_status();
}

core::Result<int> open_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0 && errno != EACCES) return disk_error(path, errno);
  return descriptor;
}

core::Status sync_and_close_folder(int folder, const std::filesystem::path& path) {
  if (folder < 0) return core::ok_status();
  const int error = ::fsync(folder) == 0 ? 0 : errno;
  ::close(folder);
  return error == 0 || has_no_disk(error) ? core::ok_status() : disk_error(path, error);
}

core::Status sync_name(const std::filesystem::path& path) {
  PRESCENE_TRY(const int folder, open_folder_of(path));
  return sync_and_close_folder(folder, path);
}

}  // namespace prescene::interfaces
