// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "edge_colors.h"
#include "prescene/filter/proposals/facets.h"

namespace prescene::filter {
namespace {

using Eigen::Vector2d;

constexpr int kPicture = 64;             // pixels that the object's sphere spans
constexpr int kInwards = 3;              // picture pixels from an edge point to its inner one
constexpr std::size_t kMostPoints = 64;  // of an outline
constexpr double kReach = 0.015;         // m to either side of the outline that are looked at ...
constexpr double kLeastReach = 4.0;      // ... and in pixels
constexpr double kMostReach = 16.0;
constexpr double kTolerance = 0.010;       // m beyond three standard deviations: what still is the object's surface
constexpr double kKnownTolerance = 0.012;  // m; a measurement so near to a known surface shows that
constexpr double kEdgeSigma = 3.0;         // pixels, error of a depth camera's edges
constexpr double kIndependent = 10.0;      // pixels along the outline that share an error
constexpr double kDirectionError = 0.15;   // rad, of the directions across a drawn outline
constexpr int kFewestSeen = 2;             // pixels of either kind on a line

/// A camera of which the object's sphere fills the picture.
geometry::PinholeCamera close_up(const geometry::PinholeCamera& camera, const Vector3d& p_C, double radius) {
  geometry::PinholeCamera picture;
  picture.width = picture.height = kPicture + 4;
  const double scale = 0.5 * kPicture / (radius * std::max(camera.fx, camera.fy) / (p_C.z() - radius));
  picture.fx = scale * camera.fx;
  picture.fy = scale * camera.fy;
  picture.cx = 0.5 * (picture.width - 1) - picture.fx * p_C.x() / p_C.z();
  picture.cy = 0.5 * (picture.height - 1) - picture.fy * p_C.y() / p_C.z();
  return picture;
}

constexpr auto kMostPixels = 2 * static_cast<std::size_t>(kMostReach) + 1;

/// exp(-n kLogOdds / kParts) for all n that a line can have, by depth and colour.
const std::array<double, 2 * kParts * kMostPixels + 1>& powers() {
  static const auto kPowers = [] {
    std::array<double, 2 * kParts * kMostPixels + 1> table{};
    for (std::size_t n = 0; n < table.size(); ++n) table[n] = std::exp(-static_cast<double>(n) * kLogOdds / kParts);
    return table;
  }();
  return kPowers;
}

/// Where a line of pixels crosses from the object to what is around it, in pixels from its middle.
struct Crossing {
  double mean = 0.0;
  double variance = 0.0;
};

/// The posterior of that; `scores`: for each pixel, how much likelier it is the object's than not, in kParts of
/// kLogOdds.
Crossing crossing_of(std::span<const int> scores) {
  const auto& power = powers();
  std::array<int, kMostPixels + 1> sums;
  int sum = 0, largest = 0;
  sums[0] = 0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    sum += scores[i];
    sums[i + 1] = sum;
    largest = std::max(largest, sum);
  }
  double total = 0.0, mean = 0.0, square = 0.0;
  for (std::size_t i = 0; i <= scores.size(); ++i) {
    const double w = power[static_cast<std::size_t>(largest - sums[i])];
    const double at = static_cast<double>(i) - 0.5 * static_cast<double>(scores.size());
    total += w;
    mean += w * at;
    square += w * at * at;
  }
  mean /= total;
  return {mean, square / total - mean * mean};
}

/// Of an image in terms.camera, at a pixel of the full image.
double at_pixel(const geometry::DepthImage& image, const rendering::FrameTerms& terms, int x, int y) {
  return image(std::min(x / terms.step, terms.camera.width - 1), std::min(y / terms.step, terms.camera.height - 1));
}

/// m, depth of what is known to be seen there besides the object; 0 = nothing.
double known_at(const rendering::FrameTerms& terms, int x, int y) {
  return terms.known.empty() ? 0.0 : at_pixel(terms.known, terms, x, y);
}

}  // namespace

Outline::Outline(const SearchTarget& target, const Pose& X_CO, const geometry::PinholeCamera& camera,
                 rendering::Renderer& renderer)
    : camera_(camera) {
  const Vector3d p_C = X_CO * target.centre();
  const auto radius = static_cast<double>(target.mesh->radius);
  if (!(radius > 0.0) || !(p_C.z() - radius > 0.05)) return;
  const geometry::PinholeCamera picture = close_up(camera, p_C, radius);
  rendering::RenderScene scene;
  scene.instances.push_back({target.mesh, X_CO, target.material});
  rendering::RenderedView view;
  if (!renderer.render(scene, picture, Pose::identity(), {}, &view).ok()) return;
  const geometry::DepthImage& depth = view.depth;
  const auto covered = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < picture.width && y < picture.height && depth(x, y) > 0.0F;
  };
  const Pose X_OC = X_CO.inverse();
  std::vector<Point> points;
  for (int y = 1; y + 1 < picture.height; ++y)
    for (int x = 1; x + 1 < picture.width; ++x) {
      if (!covered(x, y)) continue;
      if (covered(x - 1, y) && covered(x + 1, y) && covered(x, y - 1) && covered(x, y + 1)) continue;
      // Away from what is covered, over a neighbourhood of three pixels.
      Vector2d outwards = Vector2d::Zero();
      for (int dy = -3; dy <= 3; ++dy)
        for (int dx = -3; dx <= 3; ++dx)
          if (!covered(x + dx, y + dy)) outwards += Vector2d(dx, dy);
      if (!(outwards.norm() > 0.5)) continue;
      outwards.normalize();
      const int inner_x = x - static_cast<int>(std::lround(kInwards * outwards.x()));
      const int inner_y = y - static_cast<int>(std::lround(kInwards * outwards.y()));
      const double z = depth(x, y);
      // The surface ends between this pixel's centre and the next one's.
      const Vector3d edge = picture.unproject(x + 0.5 * outwards.x(), y + 0.5 * outwards.y(), z);
      Vector3d inner = picture.unproject(x - kInwards * outwards.x(), y - kInwards * outwards.y(), z);
      if (covered(inner_x, inner_y)) inner = picture.unproject(inner_x, inner_y, depth(inner_x, inner_y));
      int inside = 1;
      while (covered(x - static_cast<int>(std::lround(inside * outwards.x())),
                     y - static_cast<int>(std::lround(inside * outwards.y()))))
        ++inside;
      const Vector3d across(outwards.x() / picture.fx, outwards.y() / picture.fy, 0.0);
      points.push_back({X_OC * edge, X_OC.rotation * (inner - edge), X_OC.rotation * across.normalized(),
                        static_cast<double>(inside) / picture.fx});
    }
  const std::size_t stride = (points.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, stride)) points_.push_back(points[i]);
  // Edge points follow each other at about a picture pixel.
  const double spacing = static_cast<double>(std::max<std::size_t>(1, stride)) * camera.fx / picture.fx;
  share_ = std::min(1.0, spacing / kIndependent);
  lever_ = kDirectionError * radius;
  p_OQ_ = target.centre();
}

std::optional<Outline::Line> Outline::line_at(const Point& point, const Pose& X_CO,
                                              const rendering::FrameTerms& terms) const {
  Line line;
  line.p = X_CO * point.p_O;
  if (!(line.p.z() > 0.05)) return std::nullopt;
  const Vector3d inwards = X_CO.rotation * point.inwards_O;
  const Vector3d outwards = X_CO.rotation * point.outwards_O;
  line.u = camera_.project(line.p);
  // The image's direction of a small step outwards.
  line.n = {camera_.fx * (outwards.x() - line.p.x() / line.p.z() * outwards.z()),
            camera_.fy * (outwards.y() - line.p.y() / line.p.z() * outwards.z())};
  if (!(line.n.norm() > 0.0)) return std::nullopt;
  line.n.normalize();
  line.reach = static_cast<int>(std::clamp(kReach * camera_.fx / line.p.z(), kLeastReach, kMostReach));
  const double inner_px = (camera_.project(line.p + inwards) - line.u).norm();
  line.slope = inner_px > 0.5 ? inwards.z() / inner_px : 0.0;
  line.tolerance = kTolerance + 3.0 * terms.model.hit_sigma(line.p.z(), 1.0);
  return line;
}

bool Outline::is_hidden(const Line& line, int s, int x, int y, double z, const rendering::FrameTerms& terms) {
  const double front = line.expected(s) - line.tolerance;
  if (z > 0.0) return z < front;
  const double known = known_at(terms, x, y);
  return known > 0.0 && known < front;
}

Outline::Seen Outline::seen_at(const Line& line, int s, int x, int y, double z, const rendering::FrameTerms& terms) {
  const double known = known_at(terms, x, y);
  const double peak = at_pixel(terms.absent_peak, terms, x, y);
  const double expected = line.expected(s);
  const bool is_object = std::abs(z - expected) < line.tolerance;
  const bool is_known =
      (known > 0.0 && std::abs(z - known) < kKnownTolerance) || (peak > 0.0 && std::abs(z - peak) < kKnownTolerance);
  // Both say nothing of where one ends; neither is something nearer, or what is behind.
  if (is_object == is_known) return !is_object && z > expected ? Seen::kBackground : Seen::kNothing;
  if (is_object) return Seen::kObject;
  return z > expected - line.tolerance ? Seen::kBackground : Seen::kNothing;
}

void Outline::see_colors(const Pose& X_CO, const geometry::DepthImage& depth, const geometry::ColorImage& color,
                         const rendering::FrameTerms& terms) {
  // Calls `see` for the pixels of a line on either side of where the edge may be.
  const auto beside = [&](const Point& point, const Line& line, const auto& see) {
    // The width in pixels may be too large for an int.
    const double width = point.width * camera_.fx;
    const int inner = static_cast<int>(std::min<double>(line.reach, 0.5 * width));
    const int innermost = static_cast<int>(std::min<double>(2 * line.reach, width));
    const auto see_from = [&](int first, int last, bool is_inside) {
      for (int s = first; s <= last; ++s) {
        const auto at = line.pixel(s);
        if (at.x() < 0 || at.y() < 0 || at.x() >= color.width() || at.y() >= color.height()) continue;
        if (!is_hidden(line, s, at.x(), at.y(), depth(at.x(), at.y()), terms)) see(color(at.x(), at.y()), is_inside);
      }
    };
    see_from(-innermost, -inner - 1, true);
    see_from(line.reach + 1, 2 * line.reach, false);
  };
  std::vector<std::optional<Line>> lines;
  auto colors = std::make_shared<EdgeColors>();
  for (const Point& point : points_) {
    lines.push_back(line_at(point, X_CO, terms));
    if (lines.back())
      beside(point, *lines.back(), [&](const geometry::Rgb& c, bool is_inside) { colors->add(c, is_inside); });
  }
  if (!colors->finish()) return;
  // A face may look like what is around the object, and another one like no other part of it.
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i].contrast = 0.0;
    if (!lines[i]) continue;
    std::array<int, 2> sums{}, pixels{};
    beside(points_[i], *lines[i], [&](const geometry::Rgb& c, bool is_inside) {
      sums[is_inside ? 1 : 0] += colors->score(c);
      ++pixels[is_inside ? 1 : 0];
    });
    if (pixels[0] == 0 || pixels[1] == 0) continue;
    const double least = std::min(static_cast<double>(sums[1]) / pixels[1], -static_cast<double>(sums[0]) / pixels[0]);
    points_[i].contrast = std::max(0.0, least / kParts);
  }
  colors_ = std::move(colors);
}

OutlineEquations Outline::linearise(const Pose& X_CO, const geometry::DepthImage& depth,
                                    const rendering::FrameTerms& terms, const geometry::ColorImage* color) const {
  OutlineEquations equations;
  const geometry::Matrix3d R_OC = X_CO.rotation.conjugate().toRotationMatrix();
  std::array<int, kMostPixels> scores, by_color;
  const bool has_colors = colors_ && color != nullptr;
  for (const Point& point : points_) {
    const auto line = line_at(point, X_CO, terms);
    if (!line) continue;
    const auto pixels = static_cast<std::size_t>(2 * line->reach + 1);
    scores.fill(0);
    by_color.fill(0);
    int objects = 0, backgrounds = 0;
    std::size_t hole = 0;    // the first pixel of a run without a return that ends here
    bool is_behind = false;  // something nearer is before that run
    for (int s = -line->reach; s <= line->reach; ++s) {
      const auto at = line->pixel(s);
      if (at.x() < 0 || at.y() < 0 || at.x() >= depth.width() || at.y() >= depth.height()) continue;
      const double z = depth(at.x(), at.y());
      const auto i = static_cast<std::size_t>(s + line->reach);
      const bool hidden = has_colors && is_hidden(*line, s, at.x(), at.y(), z, terms);
      if (has_colors && !hidden) by_color[i] = colors_->score((*color)(at.x(), at.y()));
      // What is nearer ends somewhere in the holes beside it, and its colour is neither's.
      if (hidden) std::fill(by_color.begin() + hole, by_color.begin() + i, 0);
      if (!(z > 0.0)) {
        if (is_behind) by_color[i] = 0;
        continue;
      }
      is_behind = hidden;
      hole = i + 1;
      const Seen seen = seen_at(*line, s, at.x(), at.y(), z, terms);
      objects += seen == Seen::kObject;
      backgrounds += seen == Seen::kBackground;
      scores[i] = seen == Seen::kObject ? kParts : seen == Seen::kBackground ? -kParts : 0;
    }
    const Vector3d a(camera_.fx * line->n.x() / line->p.z(), camera_.fy * line->n.y() / line->p.z(),
                     -(camera_.fx * line->n.x() * line->p.x() + camera_.fy * line->n.y() * line->p.y()) /
                         (line->p.z() * line->p.z()));
    const Vector3d a_O = R_OC * a;
    Vector6d row;
    row << point.p_O.cross(a_O), a;
    const auto add = [&](const Crossing& crossing, double share) {
      const double variance = crossing.variance + kEdgeSigma * kEdgeSigma;
      const double scaled = crossing.mean / (3.0 * kEdgeSigma);
      const double weight = share * share_ / variance / ((1.0 + scaled * scaled) * (1.0 + scaled * scaled));
      equations.H += weight * row * row.transpose();
      equations.g += weight * crossing.mean * row;
      ++equations.points;
    };
    if (has_colors && point.contrast > 0.0) {
      for (std::size_t i = 0; i < pixels; ++i) scores[i] += static_cast<int>(std::lround(point.contrast * by_color[i]));
      const Crossing crossing = crossing_of(std::span(scores).first(pixels));
      // What a line of which nothing is known has as its variance is no news.
      const double unknown = (static_cast<double>((pixels + 1) * (pixels + 1)) - 1.0) / 12.0;
      if (crossing.variance < unknown) add(crossing, 1.0 - crossing.variance / unknown);
    } else if (objects >= kFewestSeen && backgrounds >= kFewestSeen) {
      add(crossing_of(std::span(scores).first(pixels)), 1.0);
    }
  }
  without_facets(lever_, X_CO.rotation, p_OQ_, equations.H, equations.g);
  return equations;
}

}  // namespace prescene::filter
