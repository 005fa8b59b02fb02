// SPDX-License-Identifier: Apache-2.0
#include "recording_room.h"

#include <dirent.h>

#include <algorithm>
#include <set>
#include <system_error>

#include "prescene/interfaces/mcap/mcap_reader.h"
#include "recording_format.h"

namespace prescene::service {
namespace {

/// What is in a folder, in no order; nothing where it can't be read. The iterator of libstdc++ 12 would end the program
/// where there is no memory.
std::vector<std::string> names_in(const std::filesystem::path& folder) {
  const std::unique_ptr<DIR, int (*)(DIR*)> open(::opendir(folder.c_str()), &::closedir);
  std::vector<std::string> names;
  while (const dirent* entry = open ? ::readdir(open.get()) : nullptr) names.emplace_back(entry->d_name);
  return names;
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
  if (const auto part = part_of(file.file); part && part->bounded_as == part_.bounded_as) now.series = part->series;
  return known_.insert_or_assign(file.file, std::move(now)).first->second.series;
}

std::vector<RecordingRoom::Earlier> RecordingRoom::earlier_runs() {
  std::vector<std::pair<std::string, Earlier>> all;  // with their series
  std::set<std::string> in_use = {"", part_.series};
  for (const std::string& name : names_in(folder_)) {
    if (!is_called_as(name, part_.bounded_as)) continue;
    Earlier earlier{folder_ / name, 0, {}};
    std::error_code error;
    if (std::filesystem::symlink_status(earlier.file, error).type() != std::filesystem::file_type::regular) continue;
    earlier.bytes = std::filesystem::file_size(earlier.file, error);
    if (!error) earlier.written = std::filesystem::last_write_time(earlier.file, error);
    if (error) continue;
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

std::vector<RemovedFile> RecordingRoom::make_room(const std::vector<std::filesystem::path>& own) {
  std::vector<Earlier> files = earlier_runs();
  std::uint64_t sum = 0;
  for (const std::filesystem::path& file : own) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    files.push_back({file, error ? 0 : bytes, {}});
  }
  for (const Earlier& file : files) sum += file.bytes;
  const std::size_t stay = std::min<std::size_t>(own.size(), 2);
  std::vector<RemovedFile> removed;
  for (std::size_t i = 0; i + stay < files.size() && sum > keep_bytes_; ++i) {
    std::error_code error;
    const bool was_there = std::filesystem::remove(files[i].file, error);
    if (!error) sum -= files[i].bytes;
    known_.erase(files[i].file);
    if (error)
      removed.push_back({files[i].file, files[i].file.string() + " can't be removed: " + error.message()});
    else if (was_there)
      removed.push_back({files[i].file, ""});
  }
  return removed;
}

}  // namespace prescene::service
