// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/cube_data.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

#include "prescene/interfaces/bytes/file.h"

namespace prescene::service {
namespace {

constexpr std::size_t kMaxTextBytes = std::size_t{256} << 20;
constexpr std::string_view kHeader = "toss,row,t_s,x_m,y_m,z_m,qw,qx,qy,qz,";
constexpr int kUsedColumns = 10;

std::string_view next_part(std::string_view& rest, char separator) {
  const std::size_t end = std::min(rest.find(separator), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

constexpr double kLargestNumber = 1e9;  // of a toss

/// The used cells of a row; false unless all are finite numbers and the toss has a number.
bool parse_row(std::string_view line, std::array<double, kUsedColumns>& cells) {
  for (double& cell : cells) {
    const std::string_view text = next_part(line, ',');
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cell);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(cell)) return false;
  }
  return cells[0] >= 0.0 && cells[0] <= kLargestNumber && cells[0] == std::floor(cells[0]);
}

}  // namespace

core::Result<std::vector<CubeToss>> read_cube_tosses(const std::filesystem::path& dir) {
  const std::filesystem::path file = dir / "tosses_even.csv";
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(file, kMaxTextBytes));
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto wrong = [&](std::size_t line, const std::string& what) {
    return core::invalid_input(file.string() + ", line " + std::to_string(line) + ": " + what);
  };
  const std::string_view header = next_part(rest, '\n');
  if (!header.starts_with(kHeader)) {
    return wrong(1, "expected the columns " + std::string(kHeader) + "...: is this the tosses file?");
  }
  const auto columns = std::count(header.begin(), header.end(), ',') + 1;
  std::vector<CubeToss> tosses;
  for (std::size_t line = 2; !rest.empty(); ++line) {
    const std::string_view text = next_part(rest, '\n');
    if (text.empty()) continue;
    const auto cells = std::count(text.begin(), text.end(), ',') + 1;
    if (cells != columns) {
      return wrong(line,
                   "has " + std::to_string(cells) + " of " + std::to_string(columns) + " columns: is the file cut?");
    }
    std::array<double, kUsedColumns> c{};
    if (!parse_row(text, c)) return wrong(line, "expected finite numbers toss,row,t,x,y,z,qw,qx,qy,qz");
    simulation::TimedPose pose;
    pose.time = c[2];
    pose.X_WO.translation = {c[3], c[4], c[5]};
    pose.X_WO.rotation = geometry::Quaterniond(c[6], c[7], c[8], c[9]);
    const double norm = pose.X_WO.rotation.norm();
    if (std::abs(norm - 1.0) > 1e-3) return wrong(line, "the quaternion's norm is " + std::to_string(norm) + ", not 1");
    pose.X_WO.rotation.normalize();
    const int number = static_cast<int>(c[0]);
    if (tosses.empty() || tosses.back().number != number) tosses.push_back({number, {}});
    std::vector<simulation::TimedPose>& frames = tosses.back().frames;
    if (!frames.empty() && !(pose.time > frames.back().time))
      return wrong(line, "its time is not after the row before");
    frames.push_back(pose);
  }
  if (tosses.empty()) return wrong(2, "there is no toss in it");
  return tosses;
}

std::vector<CubeToss> select(const std::vector<CubeToss>& tosses, CubeSplit split) {
  std::vector<CubeToss> selected;
  for (std::size_t i = 0; i < tosses.size(); ++i) {
    const bool calibrate = i % 2 == 0;
    if (split == CubeSplit::kAll || calibrate == (split == CubeSplit::kCalibrate)) selected.push_back(tosses[i]);
  }
  return selected;
}

}  // namespace prescene::service
