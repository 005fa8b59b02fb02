// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/motion_dataset.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <set>
#include <string_view>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/scene_files/located_value.h"
#include "prescene/service/load_scene.h"

namespace prescene::service {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{256} << 20;
constexpr std::array<const char*, 9> kColumns = {"toss", "t", "x", "y", "z", "qw", "qx", "qy", "qz"};
// Of a quaternion's length: cells with three decimals.
constexpr double kLengthTolerance = 2e-3;
constexpr double kLargestNumber = 1e9;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    std::string_view cell = line.substr(begin, end - begin);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t' || cell.back() == '\r')) cell.remove_suffix(1);
    cells.push_back(cell);
    begin = end + 1;
  }
  return cells;
}

/// Reads one table, line by line.
class TableReader {
 public:
  explicit TableReader(std::filesystem::path file) : file_(std::move(file)) {}

  core::Status read_header(std::string_view line) {
    const std::vector<std::string_view> names = cells_of(line);
    if (names.size() == 1) {
      for (const auto& [separator, word] : {std::pair(';', "semicolons"), std::pair('\t', "tabs")}) {
        if (std::ranges::count(names[0], separator) + 1 >= static_cast<std::ptrdiff_t>(kColumns.size()))
          return wrong(std::string("its cells are separated by ") + word +
                       "; separate them by commas, with points in numbers: toss,t,x,y,z,qw,qx,qy,qz");
      }
    }
    width_ = names.size();
    for (std::size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::ranges::find(names, kColumns[i]);
      if (found == names.end())
        return wrong("there is no column '" + std::string(kColumns[i]) +
                     "'; name the columns in the first line: toss,t,x,y,z,qw,qx,qy,qz");
      if (std::find(found + 1, names.end(), kColumns[i]) != names.end())
        return wrong("there are two columns '" + std::string(kColumns[i]) + "'; rename one");
      places_[i] = static_cast<std::size_t>(found - names.begin());
    }
    return core::ok_status();
  }

  core::Status read_row(std::string_view line) {
    ++line_;
    const std::vector<std::string_view> cells = cells_of(line);
    if (cells.size() == 1 && cells[0].empty()) return core::ok_status();
    if (cells.size() != width_)
      return wrong("has " + std::to_string(cells.size()) + " cells, the first line " + std::to_string(width_) +
                   "; is the file cut?");
    std::array<double, kColumns.size()> values{};
    for (std::size_t i = 1; i < kColumns.size(); ++i) {
      const std::string_view text = cells[places_[i]];
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), values[i]);
      if (error != std::errc() || end != text.data() + text.size() || !(std::abs(values[i]) <= kLargestNumber))
        return wrong("column '" + std::string(kColumns[i]) + "' holds '" + std::string(text.substr(0, 40)) +
                     "'; give a finite number, and leave frames without a pose out");
    }
    simulation::TimedPose pose;
    pose.time = values[1];
    pose.X_WO.translation = {values[2], values[3], values[4]};
    pose.X_WO.rotation = geometry::Quaterniond(values[5], values[6], values[7], values[8]);
    const double length = pose.X_WO.rotation.norm();
    if (std::abs(length - 1.0) > kLengthTolerance)
      return wrong("the quaternion's length is " + core::rounded_text(length) + "; give unit quaternions (qw first)");
    pose.X_WO.rotation.normalize();
    return add(std::string(cells[places_[0]]), pose);
  }

  core::Result<std::vector<MotionRecording>> take() {
    if (recordings_.empty()) return wrong("there is no row with a pose; give one row a frame");
    return std::move(recordings_);
  }

 private:
  core::Status add(const std::string& toss, const simulation::TimedPose& pose) {
    const std::string name = "toss " + toss;
    if (recordings_.empty() || recordings_.back().name != name) {
      if (!names_.insert(name).second)
        return wrong(name + " stands in two places; keep its rows together, or number tosses apart");
      recordings_.push_back({name, {}});
    }
    std::vector<simulation::TimedPose>& frames = recordings_.back().frames;
    if (!frames.empty() && !(pose.time > frames.back().time))
      return wrong(name + ": its time " + core::rounded_text(pose.time) +
                   " is not after the row before; sort the rows of a toss by time");
    frames.push_back(pose);
    return core::ok_status();
  }

  core::Status wrong(const std::string& what) const {
    return core::invalid_input(file_.string() + ", line " + std::to_string(line_) + ": " + what);
  }

  std::filesystem::path file_;
  std::size_t line_ = 1;
  std::size_t width_ = 0;
  std::array<std::size_t, kColumns.size()> places_{};
  std::vector<MotionRecording> recordings_;
  std::set<std::string> names_;
};

// Files that a scene names, however deep.
void add_files(const interfaces::LocatedValue& value, std::vector<std::string>* files) {
  for (std::size_t i = 0; i < value.items.size(); ++i) {
    const interfaces::LocatedValue& item = value.items[i];
    const bool file = value.kind == interfaces::LocatedValue::Kind::kMap && value.keys[i].name == "file";
    if (file && item.kind == interfaces::LocatedValue::Kind::kScalar)
      files->push_back((std::filesystem::path(*item.place.file).parent_path() / item.text).string());
    add_files(item, files);
  }
}

}  // namespace

core::Result<std::vector<MotionRecording>> read_motion_table(const std::filesystem::path& file) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(file, kMaxTextBytes));
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  const auto next_line = [&] {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    return line;
  };
  TableReader reader(file);
  PRESCENE_RETURN_IF_ERROR(reader.read_header(next_line()));
  while (!rest.empty()) PRESCENE_RETURN_IF_ERROR(reader.read_row(next_line()));
  return reader.take();
}

core::Result<MotionDataset> read_motion_dataset(const std::filesystem::path& folder, const core::LogSink& log) {
  MotionDataset dataset;
  dataset.folder = folder;
  if (!std::filesystem::is_directory(folder)) {
    return core::not_found(folder.string() + ": is no folder; give one with scene.yaml and tosses.csv");
  }
  for (const std::filesystem::path& file : {dataset.scene_file(), dataset.table_file()}) {
    if (!std::filesystem::exists(file))
      return core::not_found(file.string() +
                             ": there is no such file; a data set is a folder with scene.yaml and tosses.csv");
    dataset.inputs.push_back(file.string());
  }
  PRESCENE_TRY(dataset.scene, load_scene(dataset.scene_file(), log));
  if (dataset.scene->objects.size() != 1 || !dataset.scene->actions.empty() || dataset.scene->objects[0].held_by)
    return core::invalid_input(dataset.scene_file().string() + ": it has " +
                               std::to_string(dataset.scene->objects.size()) +
                               " objects; give the tossed one alone, held by nothing, without actions");
  if (dataset.scene->supports.empty())
    return core::invalid_input(dataset.scene_file().string() + ": it has no support; give what the object falls on");
  PRESCENE_TRY(const interfaces::LocatedValue document, interfaces::read_yaml(dataset.scene_file(), {}));
  add_files(document, &dataset.inputs);
  PRESCENE_TRY(dataset.recordings, read_motion_table(dataset.table_file()));
  return dataset;
}

}  // namespace prescene::service
