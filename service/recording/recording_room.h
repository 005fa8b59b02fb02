// SPDX-License-Identifier: Apache-2.0
// The files of a recording on the disk: made where nothing is, and removed when all take too much.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/service/recording/recording.h"

namespace prescene::service {

/// An empty file of a name that nothing had. It goes again unless it is kept.
class NewFile {
 public:
  static core::Result<std::unique_ptr<NewFile>> create(std::filesystem::path path) {
    auto file = std::make_unique<NewFile>(std::move(path));
    PRESCENE_TRY(file->is_mine_, interfaces::create_new_file(file->path_));
    if (!file->is_mine_) return core::unavailable(file->path_.string() + ": is there already, and is not written over");
    return file;
  }
  explicit NewFile(std::filesystem::path path) : path_(std::move(path)) {}
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile() {
    std::error_code error;
    if (is_mine_) std::filesystem::remove(path_, error);
  }
  const std::filesystem::path& path() const { return path_; }
  void keep() { is_mine_ = false; }

 private:
  std::filesystem::path path_;
  bool is_mine_ = false;
};

/// A folder that was not there, for a bag. It goes again, if it is empty, unless it is kept.
class NewBagFolder {
 public:
  static core::Result<std::unique_ptr<NewBagFolder>> create(const std::filesystem::path& path) {
    std::error_code error;
    const bool is_mine = std::filesystem::create_directory(path, error);
    if (error) return core::unavailable(path.string() + ": the folder can't be made: " + error.message());
    if (!is_mine) return core::unavailable(path.string() + ": is there already, and is not written over");
    return std::make_unique<NewBagFolder>(path);
  }
  explicit NewBagFolder(std::filesystem::path path) : path_(std::move(path)) {}
  NewBagFolder(const NewBagFolder&) = delete;
  NewBagFolder& operator=(const NewBagFolder&) = delete;
  ~NewBagFolder() {
    std::error_code error;
    if (is_mine_) std::filesystem::remove(path_, error);
  }
  void keep() { is_mine_ = false; }

 private:
  std::filesystem::path path_;
  bool is_mine_ = true;
};

/// A file that was to go, and why it could not; "" = it is gone.
struct RemovedFile {
  std::filesystem::path file;
  std::string why_not;
};

/// Keeps what the runs of a recording take below a bound. Not thread-safe.
class RecordingRoom {
 public:
  /// `part`: of the run that goes on (RecordingPart::bounded_as).
  RecordingRoom(std::filesystem::path folder, RecordingPart part, std::uint64_t keep_bytes)
      : folder_(std::move(folder)), part_(std::move(part)), keep_bytes_(keep_bytes) {}
  /// Removes the oldest files while all take more: first those of earlier runs, by when they were written last, but for
  /// runs that another program goes on with; then those of this one (`own`, oldest first), but for its newest two.
  /// Each that is gone is told once, also where the next `own` was put together before that was known.
  std::vector<RemovedFile> make_room(const std::vector<std::filesystem::path>& own);

 private:
  struct Earlier {
    std::filesystem::path file;
    std::uint64_t bytes = 0;
    std::filesystem::file_time_type written;
  };
  /// Nothing where not all of the folder can be read.
  std::vector<Earlier> earlier_runs();
  /// Of a file that may go for want of room: the series that it is of; "" = it may not.
  std::string series_of(const Earlier& file);
  /// Whether a file of this run is still there as it was written.
  bool is_own(const std::filesystem::path& file) const;

  std::filesystem::path folder_;
  RecordingPart part_;
  std::uint64_t keep_bytes_;
  struct Known {
    std::uint64_t bytes = 0;
    std::filesystem::file_time_type written;
    std::string series;
  };
  std::map<std::filesystem::path, Known> known_;  // so that each is opened once
  std::set<std::filesystem::path> gone_;          // own files that were told to be gone, while `own` still names them
};

}  // namespace prescene::service
