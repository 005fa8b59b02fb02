// SPDX-License-Identifier: Apache-2.0
#include "recording_room.h"

#include <dirent.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "prescene/interfaces/mcap/mcap_reader.h"
#include "recording_format.h"

namespace prescene::service {
namespace {

/// What is in a folder, in no order; nothing where not all of it can be read. The iterator of libstdc++ 12 would end
/// the program where there is no memory.
std::vector<std::string> names_in(const std::filesystem::path& folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> open(::opendir(folder.c_str()), &::closedir);
  std::vector<std::string> names;
  if (!open) return names;
  errno = 0;
  while (const dirent* entry = ::readdir(open.get())) {
    names.emplace_back(entry->d_name);
    errno = 0;
  }
  if (errno != 0) names.clear();
  return names;
}

/// Whether a file is called as it was when it was written.
bool has_its_name(const std::filesystem::path& file, const RecordingPart& part) {
  return part_path(part.first_file, part.number) == file.filename();
}

/// Takes off the number of at least so many digits that ends `text` after `mark`, and the mark. False where there is
/// none.
bool take_number(std::string& text, char mark, std::size_t digits) {
  const std::size_t at = text.find_last_not_of("0123456789");
  if (at == std::string::npos || text[at] != mark) return false;
  const std::string number = text.substr(at + 1);
  if (number.size() < digits || (number.size() > digits && number.front() == '0')) return false;
  text.resize(at);
  return true;
}

/// Whether a file is called as one of a run of the recording `asked`: "run.mcap", "run_0001.mcap", "run-2.mcap",
/// "run-2_0001.mcap".
bool is_called_as(const std::filesystem::path& file, const std::filesystem::path& asked) {
  if (file.extension() != asked.extension()) return false;
  const std::string base = asked.stem().string();
  std::string stem = file.stem().string();
  if (stem == base) return true;
  if (take_number(stem, '_', 4) && stem == base) return true;
  return take_number(stem, '-', 1) && stem == base;
}

}  // namespace

std::string RecordingRoom::series_of(const Earlier& file) {
  const auto known = known_.find(file.file);
  if (known != known_.end() && known->second.bytes == file.bytes && known->second.written == file.written)
    return known->second.series;
  Known now{file.bytes, file.written, ""};
  const auto part = part_of(file.file);
  if (part && part->bounded_as == part_.bounded_as && has_its_name(file.file, *part)) now.series = part->series;
  return known_.insert_or_assign(file.file, std::move(now)).first->second.series;
}

std::vector<RecordingRoom::Earlier> RecordingRoom::earlier_runs() {
  std::vector<std::pair<std::string, Earlier>> all;  // with their series
  std::set<std::string> in_use = {"", part_.series};
  for (const std::string& name : names_in(folder_)) {
    if (!is_called_as(name, part_.bounded_as)) continue;
    Earlier earlier{folder_ / name, 0, {}};
    std::error_code error;
    const std::filesystem::file_type type = std::filesystem::symlink_status(earlier.file, error).type();
    if (type == std::filesystem::file_type::not_found) continue;  // gone meanwhile
    if (!error && type != std::filesystem::file_type::regular) continue;
    if (!error) earlier.bytes = std::filesystem::file_size(earlier.file, error);
    if (!error) earlier.written = std::filesystem::last_write_time(earlier.file, error);
    if (error) return {};  // it may be the one by which its run is known to go on
    const std::string series = series_of(earlier);
    if (in_use.contains(series)) continue;
    if (interfaces::is_in_use(earlier.file)) in_use.insert(series);
    all.emplace_back(series, std::move(earlier));
  }
  std::vector<Earlier> earlier;
  for (auto& [series, file] : all)
    if (!in_use.contains(series)) earlier.push_back(std::move(file));
  std::sort(earlier.begin(), earlier.end(), [](const Earlier& a, const Earlier& b) {
    return std::pair(a.written, a.file) < std::pair(b.written, b.file);
  });
  return earlier;
}

bool RecordingRoom::is_own(const std::filesystem::path& file) const {
  std::error_code error;
  if (std::filesystem::symlink_status(file, error).type() != std::filesystem::file_type::regular) return false;
  const auto part = part_of(file);
  return part && part->series == part_.series && has_its_name(file, *part);
}

std::vector<RemovedFile> RecordingRoom::make_room(const std::vector<std::filesystem::path>& own) {
  std::vector<Earlier> files = earlier_runs();
  if (!files.empty()) {
    // A run that goes on in another file is in use by that one, which was perhaps not there when the folder was read.
    const std::vector<Earlier> again = earlier_runs();
    std::erase_if(files, [&](const Earlier& one) {
      return std::none_of(again.begin(), again.end(), [&](const Earlier& other) { return other.file == one.file; });
    });
  }
  const std::size_t of_others = files.size();
  std::uint64_t sum = 0;
  std::erase_if(gone_, [&own](const std::filesystem::path& file) {
    return std::find(own.begin(), own.end(), file) == own.end();
  });
  for (const std::filesystem::path& file : own) {
    if (gone_.contains(file)) continue;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    files.push_back({file, error ? 0 : bytes, {}});
  }
  for (const Earlier& file : files) sum += file.bytes;
  const std::size_t stay = std::min<std::size_t>(files.size() - of_others, 2);
  std::vector<RemovedFile> removed;
  for (std::size_t i = 0; i + stay < files.size() && sum > keep_bytes_; ++i) {
    std::error_code error;
    // One of this run that was moved away is gone, whatever is in its place.
    if (i < of_others || is_own(files[i].file)) std::filesystem::remove(files[i].file, error);
    if (!error) sum -= files[i].bytes;
    if (!error && i >= of_others) gone_.insert(files[i].file);
    known_.erase(files[i].file);
    removed.push_back(
        {files[i].file, error ? files[i].file.string() + " can't be removed: " + error.message() : std::string()});
  }
  return removed;
}

}  // namespace prescene::service
