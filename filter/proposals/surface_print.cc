// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/surface_print.h"

#include <algorithm>
#include <cmath>

#include "prescene/rendering/surface_color.h"

namespace prescene::filter {
namespace {

constexpr int kCubesAcross = 96;         // of the longest edge of the surface's box
constexpr int kSamplesPerCube = 3;       // along an edge of a cube, on triangles
constexpr int kMostSamplesOfEdge = 400;  // of a triangle
constexpr double kLeastContrast = 8.0;   // of 255, between neighbouring cubes of the surface
constexpr double kLeastPrinted = 0.02;   // share of the surface's cubes that differ so from one beside them
constexpr int kWindow = 4;               // cells to either side over which brightness is normalised
constexpr double kNoise = 4.0;           // of 255; weaker contrast than this is mostly a camera's noise
constexpr double kLeastEnergy = 0.02;    // of a normalised cell: keeps what has no contrast from correlating
constexpr double kSurfaceStep = 0.02;    // m; pixels of a cell further from its nearest ones are another surface
constexpr int kFewestCells = 30;         // to compare

double luma(const geometry::Rgb& c) { return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]; }

/// Sums over windows of an image by one pass.
class WindowSums {
 public:
  WindowSums(int width, int height) : width_(width), height_(height) {
    sums_.assign(static_cast<std::size_t>(width + 1) * static_cast<std::size_t>(height + 1), 0.0);
  }
  template <class Value>
  void add(const Value& value) {
    for (int y = 0; y < height_; ++y) {
      double row = 0.0;
      for (int x = 0; x < width_; ++x) {
        row += value(x, y);
        sums_[at(x + 1, y + 1)] = sums_[at(x + 1, y)] + row;
      }
    }
  }
  double around(int x, int y) const {
    const int left = std::max(0, x - kWindow), right = std::min(width_, x + kWindow + 1);
    const int top = std::max(0, y - kWindow), bottom = std::min(height_, y + kWindow + 1);
    return sums_[at(right, bottom)] - sums_[at(left, bottom)] - sums_[at(right, top)] + sums_[at(left, top)];
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) + static_cast<std::size_t>(x);
  }
  int width_, height_;
  std::vector<double> sums_;
};

/// The values at the cells of a mask, less their mean around them and over their deviation there.
std::vector<float> normalised(const std::vector<float>& values, const std::vector<std::uint8_t>& mask, int width,
                              int height, const WindowSums& counts) {
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  WindowSums sums(width, height), squares(width, height);
  sums.add([&](int x, int y) { return mask[at(x, y)] != 0 ? static_cast<double>(values[at(x, y)]) : 0.0; });
  squares.add([&](int x, int y) {
    const double v = values[at(x, y)];
    return mask[at(x, y)] != 0 ? v * v : 0.0;
  });
  std::vector<float> out(values.size(), 0.0F);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (mask[at(x, y)] == 0) continue;
      const double n = counts.around(x, y);
      const double mean = sums.around(x, y) / n;
      const double variance = std::max(0.0, squares.around(x, y) / n - mean * mean);
      out[at(x, y)] = static_cast<float>((values[at(x, y)] - mean) / std::sqrt(variance + kNoise * kNoise));
    }
  return out;
}

}  // namespace

void SurfacePrint::lay_out(const rendering::RenderMesh& mesh) {
  geometry::Box box;
  for (const auto& vertex : mesh.vertices) box.extend(vertex.cast<double>());
  p_OQ_ = mesh.centre.cast<double>();
  radius_ = static_cast<double>(mesh.radius);
  const double longest = box.isEmpty() ? 0.0 : box.sizes().maxCoeff();
  if (!(longest > 0.0)) return;
  per_metre_ = kCubesAcross / longest;
  p_O_corner_ = box.min() - Vector3d::Constant(kReach);
  for (std::size_t k = 0; k < 3; ++k)
    size_[k] = static_cast<int>(std::ceil((box.sizes()[static_cast<Eigen::Index>(k)] + 2.0 * kReach) * per_metre_)) + 1;
  cells_.assign(index(0, 0, size_[2]), 0);
}

void SurfacePrint::fill(const std::vector<float>& sums, const std::vector<std::uint32_t>& counts) {
  std::vector<std::array<int, 3>> surface;
  for (int z = 0; z < size_[2]; ++z)
    for (int y = 0; y < size_[1]; ++y)
      for (int x = 0; x < size_[0]; ++x) {
        const std::size_t i = index(x, y, z);
        cells_[i] = 0;
        if (counts[i] == 0) continue;
        cells_[i] =
            static_cast<std::uint8_t>(std::clamp(std::lround(sums[i] / static_cast<float>(counts[i])), 1L, 255L));
        surface.push_back({x, y, z});
      }
  static constexpr std::array<std::array<int, 3>, 6> kBeside = {
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  const auto inside = [&](const std::array<int, 3>& c) {
    return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < size_[0] && c[1] < size_[1] && c[2] < size_[2];
  };
  std::size_t printed = 0;
  for (const auto& c : surface) {
    bool differs = false;
    for (const auto& d : kBeside) {
      const std::array<int, 3> other = {c[0] + d[0], c[1] + d[1], c[2] + d[2]};
      if (!inside(other)) continue;
      const std::uint8_t value = cells_[index(other[0], other[1], other[2])];
      differs = differs || (value != 0 && std::abs(value - cells_[index(c[0], c[1], c[2])]) > kLeastContrast);
    }
    printed += differs ? 1 : 0;
  }
  says_anything_ = static_cast<double>(printed) > kLeastPrinted * static_cast<double>(surface.size());
  // Outwards, one layer of cubes after the other.
  std::vector<std::array<int, 3>> layer = std::move(surface), next;
  const int layers = static_cast<int>(kReach * per_metre_);
  for (int k = 0; k < layers; ++k) {
    next.clear();
    for (const auto& c : layer)
      for (const auto& d : kBeside) {
        const std::array<int, 3> other = {c[0] + d[0], c[1] + d[1], c[2] + d[2]};
        if (!inside(other)) continue;
        std::uint8_t& value = cells_[index(other[0], other[1], other[2])];
        if (value != 0) continue;
        value = cells_[index(c[0], c[1], c[2])];
        next.push_back(other);
      }
    std::swap(layer, next);
  }
}

SurfacePrint::SurfacePrint(const rendering::RenderMesh& mesh, const rendering::SurfaceMaterial& material) {
  lay_out(mesh);
  if (cells_.empty()) return;
  std::vector<float> sums(cells_.size(), 0.0F);
  std::vector<std::uint32_t> counts(cells_.size(), 0);
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    std::array<Vector3d, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.vertices[mesh.triangles[face][k]].cast<double>();
    // From the corner between the two shorter edges.
    std::size_t first = 0;
    double longest = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double opposite = (corners[(k + 1) % 3] - corners[(k + 2) % 3]).norm();
      if (opposite > longest) longest = opposite, first = k;
    }
    const Vector3d& a = corners[first];
    const Vector3d ab = corners[(first + 1) % 3] - a, ac = corners[(first + 2) % 3] - a;
    const auto steps = [&](const Vector3d& edge) {
      return std::clamp(static_cast<int>(std::ceil(kSamplesPerCube * per_metre_ * edge.norm())), 1, kMostSamplesOfEdge);
    };
    const int along = steps(ab), across = steps(ac);
    for (int i = 0; i < along; ++i)
      for (int j = 0; j < across; ++j) {
        const double u = (i + 0.5) / along, v = (j + 0.5) / across;
        if (u + v > 1.0) break;
        const Vector3d p = a + u * ab + v * ac;
        const Vector3d cell = (p - p_O_corner_) * per_metre_;
        const std::size_t at =
            index(static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()));
        sums[at] += static_cast<float>(luma(rendering::srgb(rendering::own_color(mesh, face, p, material))));
        ++counts[at];
      }
  }
  fill(sums, counts);
}

double PrintMatch::log_ratio(double independent_share) const {
  const double independent_cells = std::min(kMostIndependent, independent_share * cells);
  if (!(independent_cells > 1.0)) return 0.0;
  const double r = std::clamp(correlation, 0.0, 0.99);  // a print is not seen as its negative
  const double unexplained = (1.0 - kOutlierShare) / std::sqrt(independent_cells);
  const double gain = -0.5 * independent_cells * std::log1p(-r * r);
  // log(unexplained e^gain + outliers), against the same without a gain
  return gain + std::log((unexplained + kOutlierShare * std::exp(-gain)) / (unexplained + kOutlierShare));
}

PrintView::PrintView(const SurfacePrint& print, const geometry::PinholeCamera& camera,
                     const geometry::DepthImage& depth, const geometry::ColorImage& color, const Pose& X_CO, int cells)
    : print_(&print) {
  const Vector3d p_C = X_CO * print.centre();
  if (!(p_C.z() > print.radius()) || color.width() != depth.width() || color.height() != depth.height()) return;
  const auto u = camera.project(p_C);
  const double reach = print.radius() * std::max(camera.fx, camera.fy) / (p_C.z() - print.radius());
  const int step = std::max(1, static_cast<int>(std::lround(2.0 * reach / cells)));
  const int left = static_cast<int>(std::clamp(u.x() - reach, 0.0, static_cast<double>(depth.width())));
  const int right = static_cast<int>(std::clamp(u.x() + reach + 1.0, 0.0, static_cast<double>(depth.width())));
  const int top = static_cast<int>(std::clamp(u.y() - reach, 0.0, static_cast<double>(depth.height())));
  const int bottom = static_cast<int>(std::clamp(u.y() + reach + 1.0, 0.0, static_cast<double>(depth.height())));
  width_ = std::max(0, (right - left) / step);
  height_ = std::max(0, (bottom - top) / step);
  const std::size_t count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  points_C_.assign(count, Vector3d::Zero());
  brightness_.assign(count, 0.0F);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const int x0 = left + x * step, y0 = top + y * step;
      float nearest = 0.0F;
      for (int v = y0; v < y0 + step; ++v)
        for (int w = x0; w < x0 + step; ++w) {
          const float z = depth(w, v);
          if (z > 0.0F && (nearest == 0.0F || z < nearest)) nearest = z;
        }
      if (nearest == 0.0F) continue;
      double sum = 0.0, columns = 0.0, rows = 0.0, lumas = 0.0;
      int n = 0;
      for (int v = y0; v < y0 + step; ++v)
        for (int w = x0; w < x0 + step; ++w) {
          const double z = depth(w, v);
          if (!(z > 0.0) || z > static_cast<double>(nearest) + kSurfaceStep) continue;
          sum += z, columns += w, rows += v, lumas += luma(color(w, v));
          ++n;
        }
      points_C_[at(x, y)] = camera.unproject(columns / n, rows / n, sum / n);
      brightness_[at(x, y)] = static_cast<float>(lumas / n);
    }
}

PrintView::Compared PrintView::compare(const Pose& X_CO) const {
  const std::size_t count = points_C_.size();
  Compared out;
  std::vector<float> print(count, 0.0F);
  std::vector<std::uint8_t> near(count, 0);
  const Pose X_OC = X_CO.inverse();
  const geometry::Matrix3d R_OC = X_OC.rotation.toRotationMatrix();
  for (std::size_t i = 0; i < count; ++i) {
    if (!(points_C_[i].z() > 0.0)) continue;
    const std::uint8_t value = print_->at(R_OC * points_C_[i] + X_OC.translation);
    near[i] = value != 0 ? 1 : 0;
    print[i] = value;
  }
  // Cells at an outline show other things, too.
  out.mask.assign(count, 0);
  for (int y = 1; y + 1 < height_; ++y)
    for (int x = 1; x + 1 < width_; ++x)
      if (near[at(x, y)] && near[at(x - 1, y)] && near[at(x + 1, y)] && near[at(x, y - 1)] && near[at(x, y + 1)]) {
        out.mask[at(x, y)] = 1;
        ++out.cells;
      }
  if (out.cells < kFewestCells) {
    out.cells = 0;
    return out;
  }
  WindowSums counts(width_, height_);
  counts.add([&](int x, int y) { return static_cast<double>(out.mask[at(x, y)]); });
  out.print = normalised(print, out.mask, width_, height_, counts);
  out.frame = normalised(brightness_, out.mask, width_, height_, counts);
  return out;
}

PrintMatch PrintView::match(const Pose& X_CO) const {
  const Compared compared = compare(X_CO);
  PrintMatch match;
  match.cells = compared.cells;
  if (match.cells == 0) return match;
  double both = 0.0, print = kLeastEnergy * match.cells, frame = kLeastEnergy * match.cells;
  for (std::size_t i = 0; i < compared.mask.size(); ++i) {
    const double p = compared.print[i], f = compared.frame[i];
    both += p * f;
    print += p * p;
    frame += f * f;
  }
  match.correlation = both / std::sqrt(print * frame);
  return match;
}

double PrintView::independent_share(const Pose& X_CO) const {
  const Compared compared = compare(X_CO);
  if (compared.cells == 0) return 0.0;
  const auto products = [&](const std::vector<float>& values, int dx, int dy) {
    double sum = 0.0;
    for (int y = std::max(0, -dy); y < height_ - std::max(0, dy); ++y)
      for (int x = std::max(0, -dx); x < width_ - std::max(0, dx); ++x)
        sum += static_cast<double>(values[at(x, y)]) * static_cast<double>(values[at(x + dx, y + dy)]);
    return sum;
  };
  const double print = products(compared.print, 0, 0), frame = products(compared.frame, 0, 0);
  if (!(print > 0.0) || !(frame > 0.0)) return 0.0;
  double correlated = 1.0;
  for (int dy = 0; dy <= kWindow; ++dy)
    for (int dx = dy == 0 ? 1 : -kWindow; dx <= kWindow; ++dx)
      correlated += 2.0 * products(compared.print, dx, dy) * products(compared.frame, dx, dy) / (print * frame);
  return 1.0 / std::max(1.0, correlated);
}

}  // namespace prescene::filter
