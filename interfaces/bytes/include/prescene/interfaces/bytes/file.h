// SPDX-License-Identifier: Apache-2.0
// Files read with a size cap and written with every call checked, so that a full disk or a wrong path is a clear
// status.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// The whole content of a regular file. kNotFound when there is none, kInvalidInput for a folder or a path that can't
/// be opened by this user, kResourceExhausted above `max_bytes`, kUnavailable when the system can't open or read it
/// now; the text begins with the path.
core::Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Creates an empty file of a name that nothing had, in the folder of `path`, with the permissions of any new file: for
/// what is written aside and renamed to `path` when it is whole. The caller removes it where that fails. kUnavailable
/// as write_file; errors speak of `named`, if any, in place of `path`.
core::Result<std::filesystem::path> create_beside(const std::filesystem::path& path,
                                                  const std::filesystem::path& named = {});

/// Removes what create_beside() made in this process and still has the name that it got there. For a handler of a
/// signal that ends the process: it calls what such a handler may call. At most 64 files are remembered at a time.
void remove_files_beside() noexcept;

/// Creates an empty file of this name. False where there is something of that name already, be it a link that leads
/// nowhere: it stays as it is. kUnavailable as write_file.
core::Result<bool> create_new_file(const std::filesystem::path& path);

/// Writes beside the target and renames at the end: the old content stays when anything fails. Makes no folders.
/// Whatever keeps a file from being written is kUnavailable, with the path as it was given and the system's reason.
core::Status write_file(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);
core::Status write_file(const std::filesystem::path& path, std::string_view text);

/// A file that is being written front to back. Not thread-safe; closing is checked only by close().
class OutputFile {
 public:
  OutputFile() = default;
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();  ///< Closes; errors are lost, so call close() first.

  /// Truncates an existing file. Errors speak of `named`, if any, in place of the path.
  static core::Result<OutputFile> create(const std::filesystem::path& path, const std::filesystem::path& named = {});

  /// Says to other programs that it is being written, until it is closed or the program ends: is_in_use(). Does nothing
  /// on file systems without locks.
  void mark_in_use();

  bool is_open() const { return descriptor_ >= 0; }
  const std::filesystem::path& path() const { return path_; }
  /// All bytes or an error (kUnavailable, as of a full disk).
  core::Status write(std::span<const std::uint8_t> bytes);
  /// Waits until the bytes are on the disk.
  core::Status sync();
  core::Status close();

 private:
  std::filesystem::path path_, named_;
  int descriptor_ = -1;
};

/// Whether somebody writes a file that was marked so; also where that can't be known.
bool is_in_use(const std::filesystem::path& path);

/// A file that is read at any place; its size is the one at opening. Not thread-safe.
class InputFile {
 public:
  InputFile() = default;
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  static core::Result<InputFile> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// Fills `out` from `offset`; kDataLoss when the file ends before.
  core::Status read(std::uint64_t offset, std::span<std::uint8_t> out) const;

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace prescene::interfaces
