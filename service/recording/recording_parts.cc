// SPDX-License-Identifier: Apache-2.0
// The files of a recording that goes on in several.
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <string>
#include <system_error>

#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/service/recording/recording.h"
#include "recording_format.h"

namespace prescene::service {

std::filesystem::path part_path(const std::filesystem::path& first, std::uint64_t number) {
  if (number == 0) return first;
  std::string digits = std::to_string(number);
  digits.insert(0, 4 - std::min<std::size_t>(4, digits.size()), '0');
  std::filesystem::path path = first;
  return path.replace_filename(first.stem().string() + "_" + digits + first.extension().string());
}

namespace {

interfaces::McapReaderOptions nothing_but_metadata() {
  interfaces::McapReaderOptions options;
  options.topics = {""};
  options.salvage = true;
  options.check_data = false;
  return options;
}

/// The files beside a recording's first that are called as its parts are, by number.
std::map<std::uint64_t, std::filesystem::path> files_called_parts(const std::filesystem::path& first) {
  std::map<std::uint64_t, std::filesystem::path> files;
  const std::filesystem::path folder = first.parent_path().empty() ? "." : first.parent_path();
  const std::string begin = first.stem().string() + "_";
  std::error_code none;
  for (std::filesystem::directory_iterator file(folder, none), end; !none && file != end; file.increment(none)) {
    const std::string stem = file->path().stem().string();
    if (!stem.starts_with(begin) || file->path().extension() != first.extension()) continue;
    std::uint64_t number = 0;
    const char* last = stem.data() + stem.size();
    const auto [stop, error] = std::from_chars(stem.data() + begin.size(), last, number);
    if (error != std::errc() || stop != last || number == 0) continue;
    if (part_path(first, number).filename() == file->path().filename())
      files.emplace(number, first.parent_path() / file->path().filename());
  }
  return files;
}

}  // namespace

std::filesystem::path unused_recording_path(const std::filesystem::path& path) {
  std::filesystem::path unused = path;
  std::error_code none;
  const auto is_used = [&none](const std::filesystem::path& file) {
    const auto type = std::filesystem::symlink_status(file, none).type();
    // A link that leads nowhere keeps its name.
    if (type == std::filesystem::file_type::symlink && !std::filesystem::exists(file, none)) return true;
    return std::filesystem::is_regular_file(file, none) ||
           (type == std::filesystem::file_type::not_found && !files_called_parts(file).empty());
  };
  for (int i = 2; is_used(unused); ++i) {
    unused = path;
    unused.replace_filename(path.stem().string() + "-" + std::to_string(i) + path.extension().string());
  }
  return unused;
}

RecordingPart part_from(const interfaces::McapMetadata& metadata) {
  const auto value = [&metadata](const char* key) {
    const auto found = metadata.values.find(key);
    return found == metadata.values.end() ? std::string() : found->second;
  };
  const auto number = [&value](const char* key) { return std::strtoull(value(key).c_str(), nullptr, 10); };
  RecordingPart part;
  part.series = value(kSeriesKey);
  part.number = number("part");
  part.first_message = number("first_message");
  part.began_ns = std::min<core::TimeNs>(static_cast<core::TimeNs>(number("began_ns")), kLatestRecordedNs);
  part.after_gap = value("after_gap") == "yes";
  part.bounded_as = value("bounded_as");
  part.first_file = value("first_file");
  return part;
}

core::Result<RecordingPart> part_of(const std::filesystem::path& file) {
  PRESCENE_TRY(const auto reader, interfaces::McapReader::open(file, nothing_but_metadata()));
  for (const interfaces::McapMetadata& metadata : reader->metadata())
    if (metadata.name == kMetadataName && metadata.values.contains(kSeriesKey)) return part_from(metadata);
  return RecordingPart();
}

std::vector<std::filesystem::path> parts_after(const std::filesystem::path& path, const RecordingPart& part,
                                               std::size_t most, std::vector<PassedOver>* passed_over) {
  std::vector<std::filesystem::path> after;
  if (part.series.empty()) return after;
  std::filesystem::path first = path;
  if (part.number > 0) {
    const std::string end = part_path("", part.number).string();  // "_0007"
    const std::string stem = path.stem().string();
    if (!stem.ends_with(end)) return after;
    first.replace_filename(stem.substr(0, stem.size() - end.size()) + path.extension().string());
  }
  for (const auto& [number, file] : files_called_parts(first)) {
    if (after.size() >= most) break;
    if (number <= part.number) continue;
    const auto says = part_of(file);
    if (says && says->series == part.series) {
      after.push_back(file);
    } else if (passed_over) {
      passed_over->push_back({file, after.size(), says.ok()});
    }
  }
  return after;
}

}  // namespace prescene::service
