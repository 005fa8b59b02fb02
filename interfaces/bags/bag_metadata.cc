// SPDX-License-Identifier: Apache-2.0
#include "bag_metadata.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/located_value.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

std::string text_at(const LocatedValue& map, const char* key) {
  const LocatedValue* value = map.find(key);
  return value && value->kind == LocatedValue::Kind::kScalar ? value->text : std::string();
}

/// In the folder, whatever the metadata say.
Result<std::filesystem::path> file_in(const std::filesystem::path& folder, const LocatedValue& value) {
  const std::filesystem::path name = value.text;
  const bool is_inside =
      value.kind == LocatedValue::Kind::kScalar && !name.empty() && name.is_relative() &&
      std::none_of(name.begin(), name.end(), [](const std::filesystem::path& part) { return part == ".."; });
  const std::string place = value.place.file ? *value.place.file + ":" + std::to_string(value.place.line) : "";
  if (!is_inside)
    return core::invalid_input(place + ": " + quote(value.text, 80) +
                               " is not the name of a file in the bag's folder; correct it");
  std::error_code error;
  std::filesystem::path path = folder / name;
  // Early versions put the folder's own name before it.
  if (!std::filesystem::exists(path, error)) path = folder / name.filename();
  if (!std::filesystem::is_regular_file(path, error))
    return core::not_found(place + ": the bag has no file " + quote(value.text, 80) +
                           "; copy the whole folder, or remove the file from metadata.yaml");
  return path;
}

/// The number at the end of "run_12"; the rest in `stem`.
std::optional<std::uint64_t> number_of(const std::filesystem::path& path, std::string* stem) {
  const std::string name = path.stem().string();
  const std::size_t begin = name.find_last_of('_');
  if (begin == std::string::npos || begin + 1 == name.size()) return std::nullopt;
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data() + begin + 1, name.data() + name.size(), number);
  if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
  *stem = name.substr(0, begin) + path.extension().string();
  return number;
}

}  // namespace

bool is_bag_file(const std::filesystem::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".db3";
}

Result<BagMetadata> read_bag_metadata(const std::filesystem::path& folder) {
  PRESCENE_TRY(const LocatedValue document, read_yaml(folder / kBagMetadataName, {}));
  const std::string name = (folder / kBagMetadataName).string();
  const LocatedValue* information = document.find("rosbag2_bagfile_information");
  if (!information || information->kind != LocatedValue::Kind::kMap)
    return core::invalid_input(name + ": has no 'rosbag2_bagfile_information'; give the folder of a bag of rosbag2");
  BagMetadata out;
  out.storage = text_at(*information, "storage_identifier");
  out.compression = text_at(*information, "compression_format");
  out.compression_mode = lower_case(text_at(*information, "compression_mode"));
  if (out.compression_mode == "none") out.compression_mode.clear();
  const std::string count = text_at(*information, "message_count");
  std::uint64_t messages = 0;
  if (!count.empty()) {
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), messages);
    if (error != std::errc() || end != count.data() + count.size())
      return core::invalid_input(name + ": 'message_count' is " + quote(count, 40) + ", not a number; correct it");
    out.message_count = messages;
  }
  const LocatedValue* files = information->find("relative_file_paths");
  if (!files || files->kind != LocatedValue::Kind::kList || files->items.empty())
    return core::invalid_input(name + ": 'relative_file_paths' names no file; `ros2 bag reindex` makes it anew");
  if (files->items.size() > kMostBagFiles)
    return core::resource_exhausted(name + ": names more than " + std::to_string(kMostBagFiles) + " files; split it");
  for (const LocatedValue& value : files->items) {
    PRESCENE_TRY(std::filesystem::path file, file_in(folder, value));
    out.files.push_back(std::move(file));
  }
  return out;
}

Result<BagMetadata> bag_without_metadata(const std::filesystem::path& folder) {
  struct Run {
    std::vector<std::pair<std::uint64_t, std::filesystem::path>> files;
    std::string continued_as;  ///< The run of what goes on from its only file.
  };
  std::map<std::string, Run> runs;  // by what the names of its files have in common
  std::size_t count = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator file(folder, error), end; !error && file != end; file.increment(error)) {
    if (!is_bag_file(file->path()) || !file->is_regular_file(error)) continue;
    std::string stem;
    const std::string name = file->path().filename().string();
    const auto number = number_of(file->path(), &stem);
    Run& run = runs[number ? stem : "/" + name];  // no name holds a slash
    run.files.emplace_back(number.value_or(0), file->path());
    run.continued_as = run.files.size() == 1 && number == 0U ? name : "";
    if (++count > kMostBagFiles)
      return core::resource_exhausted(folder.string() + ": has more than " + std::to_string(kMostBagFiles) + " files");
  }
  if (error) return core::unavailable(folder.string() + ": " + error.message());
  if (runs.empty())
    return core::invalid_input(folder.string() + ": holds no .mcap or .db3 file; give the folder of a bag");
  std::vector<const Run*> in_order;
  for (auto& [name, run] : runs) {
    std::sort(run.files.begin(), run.files.end());
    const bool goes_on = runs.size() == 2 && runs.contains(run.continued_as);
    in_order.insert(goes_on ? in_order.begin() : in_order.end(), &run);
  }
  const bool is_one = in_order.size() == 1 || (in_order.size() == 2 && runs.contains(in_order.front()->continued_as));
  if (!is_one)
    return core::invalid_input(folder.string() +
                               ": has no metadata.yaml and files of different recordings; name one of them");
  BagMetadata out;
  for (const Run* run : in_order)
    for (const auto& [number, path] : run->files) out.files.push_back(path);
  return out;
}

}  // namespace prescene::interfaces
