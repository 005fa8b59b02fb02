// SPDX-License-Identifier: Apache-2.0
#include "frame_list.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::PinholeCamera;
using geometry::Pose;

constexpr double kRigidTolerance = 1e-3;  // What Pose::from_matrix asks for.

/// Takes the next line, without its end, off the text.
std::string_view next_line(std::string_view* text) {
  const std::size_t end = text->find('\n');
  const std::string_view line = text->substr(0, end);
  text->remove_prefix(end == std::string_view::npos ? text->size() : end + 1);
  return trimmed(line);
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t end = line.find(separator);
    cells.push_back(trimmed(line.substr(0, end)));
    if (end == std::string_view::npos) return cells;
    line.remove_prefix(end + 1);
  }
}

std::string line_place(int line) { return "line " + std::to_string(line); }

/// Where the columns are; the matrix's are m00 ... m33.
struct Columns {
  std::size_t count = 0;
  std::size_t frame = 0;
  std::size_t color = 0;
  std::size_t depth = 0;
  std::optional<std::size_t> stamp_ns;
  std::array<std::size_t, 16> matrix{};
};

Result<Columns> parse_columns(std::string_view line) {
  const std::vector<std::string_view> names = split(line, ',');
  std::map<std::string_view, std::size_t> place;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!place.emplace(names[i], i).second) return core::invalid_input("column " + quote(names[i]) + " stands twice");
  }
  std::string missing;
  const auto find = [&](const std::string& name) {
    const auto found = place.find(name);
    if (found != place.end()) return found->second;
    missing += (missing.empty() ? "" : ", ") + name;
    return std::size_t{0};
  };
  Columns columns;
  columns.count = names.size();
  columns.frame = find("frame");
  columns.color = find("color");
  columns.depth = find("depth");
  for (std::size_t i = 0; i < 16; ++i) columns.matrix[i] = find("m" + std::to_string(i / 4) + std::to_string(i % 4));
  if (const auto stamp = place.find("stamp_ns"); stamp != place.end()) columns.stamp_ns = stamp->second;
  if (!missing.empty())
    return core::invalid_input("the columns " + missing + " are missing; name them in the first line");
  return columns;
}

Status check_file_name(std::string_view name) {
  const std::filesystem::path path(name);
  const bool leaves = path.empty() || path.is_absolute() ||
                      std::any_of(path.begin(), path.end(), [](const auto& part) { return part == ".."; });
  if (!leaves) return core::ok_status();
  return core::invalid_input("the file name " + quote(name) +
                             " does not lie in the folder; give it relative, without ..");
}

Result<FolderFrame> parse_row(const std::vector<std::string_view>& cells, const Columns& columns) {
  if (cells.size() != columns.count) {
    return core::invalid_input("has " + std::to_string(cells.size()) + " cells, the first line has " +
                               std::to_string(columns.count));
  }
  FolderFrame frame;
  frame.name = cells[columns.frame];
  PRESCENE_RETURN_IF_ERROR(check_file_name(cells[columns.color]));
  PRESCENE_RETURN_IF_ERROR(check_file_name(cells[columns.depth]));
  frame.color = cells[columns.color];
  frame.depth = cells[columns.depth];
  if (columns.stamp_ns) {
    long long stamp = 0;
    if (!parse_integer(cells[*columns.stamp_ns], &stamp) || stamp < 0) {
      return core::invalid_input("stamp_ns " + quote(cells[*columns.stamp_ns]) + " is no whole number of nanoseconds");
    }
    frame.stamp_ns = stamp;
  }
  Eigen::Matrix4d matrix;
  for (std::size_t i = 0; i < 16; ++i) {
    const std::string_view cell = cells[columns.matrix[i]];
    if (!parse_number(cell, &matrix(static_cast<int>(i / 4), static_cast<int>(i % 4)))) {
      return core::invalid_input("m" + std::to_string(i / 4) + std::to_string(i % 4) + " " + quote(cell) +
                                 " is no number");
    }
  }
  PRESCENE_TRY(frame.X_WC, rigid_pose(matrix));
  return frame;
}

}  // namespace

Result<Pose> rigid_pose(const Eigen::Matrix4d& matrix) {
  if (!matrix.allFinite()) return core::invalid_input("the pose has NaN or infinity; leave the frame out");
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool last_row = (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-9;
  if (!(error < kRigidTolerance) || R.determinant() < 0.0 || !last_row) {
    return core::invalid_input("the pose is not rigid (R'R is off the identity by " + number_text(error) +
                               ", determinant " + number_text(R.determinant()) +
                               "); give camera-to-world, row-major, last row 0 0 0 1");
  }
  return Pose::from_matrix(matrix);
}

std::int64_t stamp_at(std::size_t index, const FrameFolderOptions& options) {
  return options.first_stamp_ns + std::llround(static_cast<double>(index) * 1e9 / options.frames_per_second);
}

Result<std::vector<FolderFrame>> parse_camera_poses(std::string_view text, const FrameFolderOptions& options) {
  std::vector<FolderFrame> frames;
  const Result<Columns> columns = parse_columns(next_line(&text));
  if (!columns) return columns.status().at(line_place(1));
  for (int line = 2; !text.empty(); ++line) {
    const std::string_view row = next_line(&text);
    if (row.empty()) continue;
    Result<FolderFrame> frame = parse_row(split(row, ','), *columns);
    if (!frame) return frame.status().at(line_place(line));
    if (!columns->stamp_ns) frame->stamp_ns = stamp_at(frames.size(), options);
    if (!frames.empty() && frame->stamp_ns <= frames.back().stamp_ns) {
      return core::invalid_input(line_place(line) + ": stamp " + std::to_string(frame->stamp_ns) +
                                 " ns is not after that of the frame before; order the lines by time");
    }
    frames.push_back(*std::move(frame));
  }
  if (frames.empty()) return core::invalid_input("line 2: there is no frame; write one line a frame");
  return frames;
}

Result<PinholeCamera> parse_intrinsics(std::string_view text) {
  Eigen::Matrix3d K;
  int row = 0;
  for (int line = 1; !text.empty(); ++line) {
    const std::string_view content = next_line(&text);
    if (content.empty()) continue;
    std::vector<std::string_view> cells;
    for (const std::string_view cell : split(content, ' ')) {
      if (!cell.empty()) cells.push_back(cell);
    }
    if (row == 3 || cells.size() != 3) {
      return core::invalid_input(line_place(line) + ": a 3x3 matrix has three lines of three numbers");
    }
    for (int column = 0; column < 3; ++column) {
      const std::string_view cell = cells[static_cast<std::size_t>(column)];
      if (parse_number(cell, &K(row, column)) && std::isfinite(K(row, column))) continue;
      return core::invalid_input(line_place(line) + ": " + quote(cell) + " is no finite number");
    }
    ++row;
  }
  if (row != 3)
    return core::data_loss("line " + std::to_string(row + 1) + ": a 3x3 matrix has three lines of three numbers");
  const bool pinhole = K(0, 1) == 0.0 && K(1, 0) == 0.0 && K(2, 0) == 0.0 && K(2, 1) == 0.0 && K(2, 2) == 1.0;
  if (!pinhole)
    return core::invalid_input("line 1: only fx, fy, cx and cy may be set, row-major, and the last number is 1");
  PinholeCamera camera;
  camera.fx = K(0, 0);
  camera.fy = K(1, 1);
  camera.cx = K(0, 2);
  camera.cy = K(1, 2);
  return camera;
}

}  // namespace prescene::interfaces
