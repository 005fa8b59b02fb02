// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/edge_smear.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>

namespace prescene::filter {
namespace {

constexpr int kMostGap = 3;              // pixels between the two surfaces; more is a hole, and tells little
constexpr int kSurfacePixels = 4;        // beside an edge, of which all but one must continue a surface
constexpr float kStepPerPixel = 0.005F;  // m at 1 m, growing with the squared depth, that a surface may recede
constexpr float kLeastJump = 0.04F;      // m at 1 m, likewise, between the two surfaces
constexpr int kColorReach = 10;          // pixels; what changes further away is another edge
constexpr int kLeastChange = 40;         // of the three channels together, of 3 x 255
constexpr int kEdgeContrast = 4;         // times the mean change about an edge
constexpr int kFewestEdges = 60;
constexpr double kShare = 0.68;  // of the edges: a standard deviation, if displacements were normal

using Counts = std::array<int, kColorReach + 1>;

/// One row or column of a frame, from either end.
struct Line {
  const geometry::DepthImage* depth;
  const geometry::ColorImage* color;
  int index;
  bool is_row;
  bool is_reversed;
  int size;

  float z(int i) const {
    const int k = is_reversed ? size - 1 - i : i;
    return is_row ? (*depth)(k, index) : (*depth)(index, k);
  }
  const geometry::Rgb& rgb(int i) const {
    const int k = is_reversed ? size - 1 - i : i;
    return is_row ? (*color)(k, index) : (*color)(index, k);
  }
  /// How much the colours of pixel i and the next one differ.
  int change(int i) const {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(static_cast<int>(rgb(i + 1)[c]) - static_cast<int>(rgb(i)[c]));
    return sum;
  }
};

float growth(float depth) { return std::max(1.0F, depth * depth); }

/// Whether the pixels to one side of pixel i (`side`: 1 or -1), where depth is measured, continue its surface.
bool is_surface(const Line& line, int i, int side) {
  const float z = line.z(i);
  int same = 0;
  for (int k = 1; k <= kSurfacePixels; ++k) {
    const int j = i + side * k;
    if (j < 0 || j >= line.size) break;
    const float other = line.z(j);
    if (other > 0.0F && std::abs(other - z) < kStepPerPixel * static_cast<float>(k + 1) * growth(z)) ++same;
  }
  return same + 1 >= kSurfacePixels;
}

/// The first pixel of a surface behind the one that ends at `last`; 0 if there is none, or if that one goes on.
int behind(const Line& line, int last) {
  const float z = line.z(last), least = kLeastJump * growth(z);
  for (int i = last + 1; i <= last + kMostGap + 1 && i < line.size; ++i) {
    const float jump = line.z(i) - z;
    if (!(line.z(i) > 0.0F)) continue;
    if (jump > least && is_surface(line, i, 1)) return i;
    if (std::abs(jump) < 0.5F * least && is_surface(line, i, -1)) return 0;
  }
  return 0;
}

/// Counts the edges of a line by how far they are from the strongest change of colours.
void count_displacements(const Line& line, Counts& counts) {
  for (int last = kColorReach; last + kMostGap + 1 + kColorReach < line.size; ++last) {
    if (!(line.z(last) > 0.0F) || !is_surface(line, last, -1)) continue;
    const int next = behind(line, last);
    if (next == 0) continue;
    int strongest = 0, at = last, sum = 0;
    for (int i = last - kColorReach; i < next + kColorReach; ++i) {
      const int change = line.change(i);
      sum += change;
      if (change > strongest) strongest = change, at = i;
    }
    const int pixels = next - last + 2 * kColorReach;
    if (strongest >= kLeastChange && strongest * pixels >= kEdgeContrast * sum)
      ++counts[static_cast<std::size_t>(std::max({0, last - at, at - next + 1}))];
    last = next - 1;
  }
}

}  // namespace

EdgeSmear measure_edge_smear(const geometry::DepthImage& depth, const geometry::ColorImage* color) {
  if (color == nullptr || color->width() != depth.width() || color->height() != depth.height()) return {};
  Counts counts{};
  for (const bool is_row : {true, false})
    for (const bool is_reversed : {false, true}) {
      const int lines = is_row ? depth.height() : depth.width();
      for (int index = 0; index < lines; ++index)
        count_displacements({&depth, color, index, is_row, is_reversed, is_row ? depth.width() : depth.height()},
                            counts);
    }
  EdgeSmear smear;
  for (const int count : counts) smear.edges += count;
  if (smear.edges < kFewestEdges) return {};
  int within = 0;
  for (std::size_t pixels = 0; pixels < counts.size(); ++pixels) {
    within += counts[pixels];
    smear.pixels = static_cast<double>(pixels);
    if (within >= kShare * smear.edges) break;
  }
  return smear;
}

}  // namespace prescene::filter
