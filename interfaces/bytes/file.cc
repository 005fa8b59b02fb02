// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

std::string reason(int error) { return std::generic_category().message(error); }

Status open_error(const std::filesystem::path& path, int error) {
  const std::string place = path.string() + ": ";
  if (error == ENOENT) return core::not_found(place + "no such file; check the path");
  if (error == EACCES || error == EPERM)
    return core::invalid_input(place + "permission denied; change the file's permissions or the user");
  if (error == ENOTDIR || error == ELOOP || error == ENAMETOOLONG)
    return core::invalid_input(place + "cannot be opened: " + reason(error) + "; check the path");
  return core::unavailable(place + "cannot be opened: " + reason(error));
}

Status write_error(const std::filesystem::path& path, int error) {
  const std::filesystem::path folder = path.parent_path();
  std::error_code ignored;
  if (error == ENOENT && !folder.empty() && !std::filesystem::is_directory(folder, ignored))
    return core::unavailable(path.string() + ": its folder does not exist; make it first");
  std::string remedy;
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) remedy = "; free some space or choose another disk";
  if (error == EACCES || error == EPERM || error == EROFS || error == ENOENT) remedy = "; choose another folder";
  return core::unavailable(path.string() + ": cannot be written: " + reason(error) + remedy);
}

/// Makes a file of a name that nothing has: 0, or the system's error.
int make_empty(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return errno;
  ::close(descriptor);
  return 0;
}

/// The files of create_beside() for remove_files_beside(), which may interrupt any of these calls.
class FilesBeside {
 public:
  void note(const std::filesystem::path& path) {
    const std::string& text = path.native();
    if (text.size() >= kMostText) return;
    for (Slot& slot : slots_) {
      int expected = kFree;
      if (!slot.state.compare_exchange_strong(expected, kTaken)) {
        expected = kNoted;
        if (!slot.state.compare_exchange_strong(expected, kTaken)) continue;
        // Whoever made it has renamed or removed it.
        if (::access(slot.path, F_OK) == 0 || errno != ENOENT) {
          slot.state.store(kNoted);
          continue;
        }
      }
      text.copy(slot.path, text.size());
      slot.path[text.size()] = '\0';
      slot.process = ::getpid();
      slot.state.store(kNoted);
      return;
    }
  }

  void remove_all() noexcept {
    for (Slot& slot : slots_) {
      int expected = kNoted;
      if (!slot.state.compare_exchange_strong(expected, kTaken)) continue;
      if (slot.process == ::getpid()) ::unlink(slot.path);  // not those of a parent
      slot.state.store(kFree);
    }
  }

 private:
  static constexpr std::size_t kMostText = 4096;  // Linux takes no longer path
  static constexpr int kFree = 0, kTaken = 1, kNoted = 2;
  static_assert(std::atomic<int>::is_always_lock_free);  // or a handler could wait for what it interrupts
  struct Slot {
    std::atomic<int> state = kFree;
    pid_t process = 0;
    char path[kMostText] = {};
  };
  std::array<Slot, 64> slots_;
};
constinit FilesBeside files_beside;

/// For locks that belong to an open file, not to the process: they go when it is closed.
struct flock whole_file() {
  struct flock all {};
  all.l_type = F_WRLCK;
  all.l_whence = SEEK_SET;
  return all;
}

}  // namespace

Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  PRESCENE_TRY(const InputFile file, InputFile::open(path));
  if (file.size() > max_bytes) {
    return core::resource_exhausted(path.string() + ": " + size_text(file.size()) + " are more than the limit of " +
                                    size_text(max_bytes) + "; use a smaller file");
  }
  std::vector<std::uint8_t> bytes(file.size());
  PRESCENE_RETURN_IF_ERROR(file.read(0, bytes));
  return bytes;
}

Result<std::filesystem::path> create_beside(const std::filesystem::path& path, const std::filesystem::path& named) {
  static std::atomic<unsigned> count{0};
  // What an ended program of the same number left is another's and stays.
  constexpr int kMostTries = 1000;
  for (int i = 0; i < kMostTries; ++i) {
    // Short, so that any name that a file may have leaves room for it.
    std::filesystem::path made = path;
    made.replace_filename(".prescene-" + std::to_string(::getpid()) + "-" + std::to_string(count++) + ".partial");
    const int error = make_empty(made);
    if (error == 0) {
      files_beside.note(made);
      return made;
    }
    if (error != EEXIST) return write_error(named.empty() ? path : named, error);
  }
  return write_error(named.empty() ? path : named, EEXIST);
}

void remove_files_beside() noexcept { files_beside.remove_all(); }

Result<bool> create_new_file(const std::filesystem::path& path) {
  const int error = make_empty(path);
  if (error != 0 && error != EEXIST) return write_error(path, error);
  return error == 0;
}

Status write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  std::error_code ignored;
  const std::filesystem::file_status there = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(there)) return write_error(path, EISDIR);
  if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
    // A device or a pipe is written to; a new file in its place would take it away from everybody.
    PRESCENE_TRY(OutputFile file, OutputFile::create(path));
    const Status written = file.write(bytes);
    const Status closed = file.close();
    return written.ok() ? closed : written;
  }
  // What a link names is replaced, not the link.
  std::filesystem::path target = path;
  if (std::filesystem::is_regular_file(there)) {
    std::error_code error;
    const std::filesystem::path resolved = std::filesystem::canonical(path, error);
    if (!error) target = resolved;
  }
  PRESCENE_TRY(const std::filesystem::path partial, create_beside(target, path));
  Status status;
  {
    auto file = OutputFile::create(partial, path);
    status = file ? file->write(bytes) : file.status();
    if (file) {
      if (const Status closed = file->close(); status.ok()) status = closed;
    }
  }
  std::error_code error;
  if (status.ok()) {
    std::filesystem::rename(partial, target, error);
    if (!error) return status;
    status = core::unavailable(path.string() + ": cannot be replaced: " + error.message());
  }
  std::filesystem::remove(partial, error);
  return status;
}

Status write_file(const std::filesystem::path& path, std::string_view text) {
  return write_file(path, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      named_(std::move(other.named_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(named_, other.named_);
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

OutputFile::~OutputFile() {
  if (is_open()) ::close(descriptor_);
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path, const std::filesystem::path& named) {
  OutputFile file;
  file.path_ = path;
  file.named_ = named.empty() ? path : named;
  file.descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file.descriptor_ >= 0) return file;
  return write_error(file.named_, errno);
}

void OutputFile::mark_in_use() {
  PRESCENE_CHECK(is_open());
  struct flock all = whole_file();
  static_cast<void>(::fcntl(descriptor_, F_OFD_SETLK, &all));
}

bool is_in_use(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return errno != ENOENT;
  struct flock all = whole_file();
  const bool is_known = ::fcntl(descriptor, F_OFD_GETLK, &all) == 0;
  ::close(descriptor);
  return !is_known || all.l_type != F_UNLCK;
}

Status OutputFile::write(std::span<const std::uint8_t> bytes) {
  PRESCENE_CHECK(is_open());
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return write_error(named_, errno);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return core::ok_status();
}

Status OutputFile::sync() {
  PRESCENE_CHECK(is_open());
  // Pipes and character devices cannot be synchronised; that is not a loss.
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL && errno != EROFS) return write_error(named_, errno);
  return core::ok_status();
}

Status OutputFile::close() {
  if (!is_open()) return core::ok_status();
  if (::close(std::exchange(descriptor_, -1)) != 0 && errno != EINTR) return write_error(named_, errno);
  return core::ok_status();
}

InputFile::InputFile(InputFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      size_(std::exchange(other.size_, 0)) {}

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  return *this;
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  InputFile file;
  file.path_ = path;
  // Without O_NONBLOCK, opening a named pipe would wait for a writer.
  file.descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file.descriptor_ < 0) return open_error(path, errno);
  struct stat information {};
  if (::fstat(file.descriptor_, &information) != 0) return open_error(path, errno);
  if (S_ISDIR(information.st_mode)) return core::invalid_input(path.string() + ": is a folder; name a file in it");
  if (!S_ISREG(information.st_mode)) {
    return core::invalid_input(path.string() + ": is no regular file; copy its content into one");
  }
  file.size_ = static_cast<std::uint64_t>(information.st_size);
  return file;
}

Status InputFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  while (!out.empty()) {
    const ssize_t count = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
    if (count < 0) {
      if (errno == EINTR) continue;
      return core::unavailable(path_.string() + ": cannot be read: " + reason(errno));
    }
    if (count == 0) return core::data_loss(path_.string() + ": ends at byte " + std::to_string(offset));
    offset += static_cast<std::uint64_t>(count);
    out = out.subspan(static_cast<std::size_t>(count));
  }
  return core::ok_status();
}

}  // namespace prescene::interfaces
