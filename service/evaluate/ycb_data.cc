// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/ycb_data.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>

#include "cells.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::service {
namespace {

namespace fs = std::filesystem;
using geometry::Pose;

constexpr std::size_t kMaxYcbTextBytes = std::size_t{64} << 20;
constexpr double kYcbUnit = 1e-4;  // of the depth images

/// Splits at any of `separators`, leaving out empty parts.
std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::string place(const fs::path& file, std::size_t line) { return file.string() + ", line " + std::to_string(line); }

/// Calls `row(fields)` for each line with its fields, `first` lines skipped; a false answer is an error of that line.
core::Status for_each_line(const fs::path& file, std::string_view separators, std::size_t first,
                           const std::string& wanted,
                           const std::function<bool(const std::vector<std::string_view>&)>& row) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(file, kMaxYcbTextBytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::size_t number = 0;
  for (std::string_view line : split(text, "\n")) {
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (++number <= first) continue;
    if (!row(split(line, separators))) return core::invalid_input(place(file, number) + ": expected " + wanted);
  }
  return core::ok_status();
}

core::Result<std::vector<YcbObject>> read_true_poses(const fs::path& file) {
  std::vector<YcbObject> objects;
  PRESCENE_RETURN_IF_ERROR(
      for_each_line(file, ",", 1, "a name and 16 elements of a rigid matrix", [&](const auto& cells) {
        if (cells.size() != 17) return false;
        Eigen::Matrix4d matrix;
        for (int i = 0; i < 16; ++i)
          if (!parse_cell(cells[static_cast<std::size_t>(i + 1)], &matrix(i / 4, i % 4))) return false;
        const geometry::Matrix3d R = matrix.topLeftCorner<3, 3>();
        if (!(R * R.transpose()).isIdentity(1e-3) || R.determinant() < 0.0) return false;
        objects.push_back({std::string(cells[0]), Pose::from_matrix(matrix)});
        return true;
      }));
  return objects;
}

core::Result<YcbFrame> read_ycb_frame(const fs::path& folder) {
  YcbFrame frame;
  frame.name = folder.filename().string();
  PRESCENE_TRY(frame.depth, interfaces::read_png_depth(folder / "depth.png", kYcbUnit));
  PRESCENE_TRY(frame.color, interfaces::read_png_color(folder / "color.png"));
  PRESCENE_TRY(frame.objects, read_true_poses(folder / "gt_poses.csv"));
  if (frame.color.width() != frame.depth.width() || frame.color.height() != frame.depth.height())
    return core::invalid_input(folder.string() + ": color.png and depth.png differ in size");
  // The data set's camera, the same in all of its keyframes.
  frame.camera = {frame.depth.width(), frame.depth.height(), 1066.778, 1067.487, 312.9869, 241.3109};
  return frame;
}

core::Status missing(const fs::path& path, const char* what) {
  return core::not_found(path.string() + ": no " + what + " there: --data must name the ycb_video folder");
}

}  // namespace

core::Result<std::vector<YcbFrame>> read_ycb_frames(const fs::path& dir) {
  std::error_code error;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(dir, error))
    if (fs::exists(entry.path() / "gt_poses.csv", error) && fs::exists(entry.path() / "depth.png", error))
      folders.push_back(entry.path());
  if (folders.empty()) return missing(dir, "frame folders");
  std::sort(folders.begin(), folders.end());
  std::vector<YcbFrame> frames;
  for (const fs::path& folder : folders) {
    PRESCENE_TRY(YcbFrame frame, read_ycb_frame(folder));
    frames.push_back(std::move(frame));
  }
  return frames;
}

core::Result<geometry::TriangleMesh> read_ycb_mesh(const fs::path& dir, const std::string& object) {
  PRESCENE_TRY(interfaces::LoadedMesh loaded, interfaces::read_mesh(dir / "meshes" / (object + ".ply")));
  return std::move(loaded.mesh);
}

core::Result<std::vector<geometry::Vector3d>> read_ycb_points(const fs::path& dir, const std::string& object) {
  const fs::path file = dir / "points" / (object + ".xyz");
  std::vector<geometry::Vector3d> points;
  PRESCENE_RETURN_IF_ERROR(for_each_line(file, " \t", 0, "x y z", [&](const auto& cells) {
    geometry::Vector3d p;
    if (cells.size() != 3) return false;
    for (int i = 0; i < 3; ++i)
      if (!parse_cell(cells[static_cast<std::size_t>(i)], &p[i])) return false;
    points.push_back(p);
    return true;
  }));
  if (points.empty()) return core::invalid_input(file.string() + ": no points");
  return points;
}

core::Result<YcbTrack> read_ycb_track(const fs::path& file) {
  YcbTrack track;
  PRESCENE_RETURN_IF_ERROR(for_each_line(file, " \t", 0, "qw qx qy qz tx ty tz", [&](const auto& cells) {
    double v[7];
    if (cells.size() != 7) return false;
    for (std::size_t i = 0; i < 7; ++i)
      if (!parse_cell(cells[i], &v[i])) return false;
    if (v[4] == 0.0 && v[5] == 0.0 && v[6] == 0.0) {
      track.push_back(std::nullopt);
      return true;
    }
    const geometry::Quaterniond q(v[0], v[1], v[2], v[3]);
    if (q.norm() < 1e-6) return false;
    track.push_back(geometry::Pose{q.normalized(), {v[4], v[5], v[6]}});
    return true;
  }));
  return track;
}

core::Result<std::vector<std::string>> list_ycb_tracks(const fs::path& dir) {
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(dir / "eval" / "ground_truth", error))
    if (entry.path().extension() == ".txt") names.push_back(entry.path().filename().string());
  if (names.empty()) return missing(dir / "eval" / "ground_truth", "poses");
  std::sort(names.begin(), names.end());
  return names;
}

std::string object_of_track(const std::string& file_name) {
  const std::size_t begin = std::min(file_name.find('_'), file_name.size() - 1) + 1;
  return file_name.substr(begin, file_name.rfind('.') - begin);
}

core::Result<std::vector<YcbExpectedAuc>> read_expected_auc(const fs::path& dir) {
  std::vector<YcbExpectedAuc> rows;
  PRESCENE_RETURN_IF_ERROR(for_each_line(dir / "eval" / "expected_auc.csv", ",", 1,
                                         "method,object,poses,missing,ADD AUC,ADD-S AUC,...", [&](const auto& cells) {
                                           if (cells.size() < 6) return false;
                                           YcbExpectedAuc row{std::string(cells[0]), std::string(cells[1]), 0.0, 0.0};
                                           if (!parse_cell(cells[4], &row.add) || !parse_cell(cells[5], &row.adds))
                                             return false;
                                           rows.push_back(std::move(row));
                                           return true;
                                         }));
  return rows;
}

}  // namespace prescene::service
