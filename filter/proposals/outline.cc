// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/outline.h"

#include <algorithm>
#include <array>
#include <cmath>

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
constexpr double kLogOdds = 1.1;           // nats a pixel; less than its reliability, as neighbours err together
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

/// What one pixel of a line shows.
enum class Seen : std::int8_t { kNothing, kObject, kBackground };

/// exp(-n kLogOdds) for all n that a line can have.
const std::array<double, 2 * static_cast<std::size_t>(kMostReach) + 2>& powers() {
  static const auto kPowers = [] {
    std::array<double, 2 * static_cast<std::size_t>(kMostReach) + 2> table{};
    for (std::size_t n = 0; n < table.size(); ++n) table[n] = std::exp(-static_cast<double>(n) * kLogOdds);
    return table;
  }();
  return kPowers;
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
      const Vector3d across(outwards.x() / picture.fx, outwards.y() / picture.fy, 0.0);
      points.push_back({X_OC * edge, X_OC.rotation * (inner - edge), X_OC.rotation * across.normalized()});
    }
  const std::size_t stride = (points.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, stride)) points_.push_back(points[i]);
  // Edge points follow each other at about a picture pixel.
  const double spacing = static_cast<double>(std::max<std::size_t>(1, stride)) * camera.fx / picture.fx;
  share_ = std::min(1.0, spacing / kIndependent);
  lever_ = kDirectionError * radius;
  p_OQ_ = target.centre();
}

OutlineEquations Outline::linearise(const Pose& X_CO, const geometry::DepthImage& depth,
                                    const rendering::FrameTerms& terms) const {
  OutlineEquations equations;
  const auto& power = powers();
  const geometry::Matrix3d R_CO = X_CO.rotation.toRotationMatrix();
  for (const Point& point : points_) {
    const Vector3d p = R_CO * point.p_O + X_CO.translation;
    if (!(p.z() > 0.05)) continue;
    const Vector3d inwards = R_CO * point.inwards_O;
    const Vector3d outwards = R_CO * point.outwards_O;
    const Vector2d u = camera_.project(p);
    // The image's direction of a small step outwards.
    Vector2d n(camera_.fx * (outwards.x() - p.x() / p.z() * outwards.z()),
               camera_.fy * (outwards.y() - p.y() / p.z() * outwards.z()));
    if (!(n.norm() > 0.0)) continue;
    n.normalize();
    const int reach = static_cast<int>(std::clamp(kReach * camera_.fx / p.z(), kLeastReach, kMostReach));
    // How the depth changes along the line on the object's side, per pixel.
    const double inner_px = (camera_.project(p + inwards) - u).norm();
    const double slope = inner_px > 0.5 ? inwards.z() / inner_px : 0.0;
    const double tolerance = kTolerance + 3.0 * terms.model.hit_sigma(p.z(), 1.0);

    std::array<Seen, 2 * static_cast<std::size_t>(kMostReach) + 1> line;
    int objects = 0, backgrounds = 0;
    for (int s = -reach; s <= reach; ++s) {
      Seen& seen = line[static_cast<std::size_t>(s + reach)];
      seen = Seen::kNothing;
      const int x = static_cast<int>(std::lround(u.x() + s * n.x()));
      const int y = static_cast<int>(std::lround(u.y() + s * n.y()));
      if (x < 0 || y < 0 || x >= depth.width() || y >= depth.height()) continue;
      const double z = depth(x, y);
      if (!(z > 0.0)) continue;
      const int low_x = std::min(x / terms.step, terms.camera.width - 1);
      const int low_y = std::min(y / terms.step, terms.camera.height - 1);
      const double known = terms.known.empty() ? 0.0 : static_cast<double>(terms.known(low_x, low_y));
      const double peak = terms.absent_peak(low_x, low_y);
      const double expected = p.z() + std::max(0, -s) * slope;
      const bool is_object = std::abs(z - expected) < tolerance;
      const bool is_known = (known > 0.0 && std::abs(z - known) < kKnownTolerance) ||
                            (peak > 0.0 && std::abs(z - peak) < kKnownTolerance);
      if (is_object == is_known) {
        // Both say nothing of where one ends; neither is something nearer, or what is behind.
        if (!is_object && z > expected) seen = Seen::kBackground;
      } else {
        seen = is_object ? Seen::kObject : (z > expected - tolerance ? Seen::kBackground : Seen::kNothing);
      }
      objects += seen == Seen::kObject;
      backgrounds += seen == Seen::kBackground;
    }
    if (objects < kFewestSeen || backgrounds < kFewestSeen) continue;

    // The posterior of where it ends: object on this side, background on that. Scores are in units of kLogOdds.
    std::array<int, 2 * static_cast<std::size_t>(kMostReach) + 2> scores;
    int score = backgrounds;
    int largest = score;
    scores[0] = score;
    const int ends = 2 * reach + 2;
    for (int i = 1; i < ends; ++i) {
      const Seen seen = line[static_cast<std::size_t>(i - 1)];
      score += (seen == Seen::kObject ? 1 : 0) - (seen == Seen::kBackground ? 1 : 0);
      scores[static_cast<std::size_t>(i)] = score;
      largest = std::max(largest, score);
    }
    double sum = 0.0, mean = 0.0, square = 0.0;
    for (int i = 0; i < ends; ++i) {
      const double w = power[static_cast<std::size_t>(largest - scores[static_cast<std::size_t>(i)])];
      const double at = i - reach - 0.5;
      sum += w;
      mean += w * at;
      square += w * at * at;
    }
    mean /= sum;
    const double variance = square / sum - mean * mean + kEdgeSigma * kEdgeSigma;
    const double scaled = mean / (3.0 * kEdgeSigma);
    const double weight = share_ / variance / ((1.0 + scaled * scaled) * (1.0 + scaled * scaled));
    const Vector3d a(camera_.fx * n.x() / p.z(), camera_.fy * n.y() / p.z(),
                     -(camera_.fx * n.x() * p.x() + camera_.fy * n.y() * p.y()) / (p.z() * p.z()));
    Vector6d row;
    row << point.p_O.cross(R_CO.transpose() * a), a;
    equations.H += weight * row * row.transpose();
    equations.g += weight * mean * row;
    ++equations.points;
  }
  without_facets(lever_, X_CO.rotation, p_OQ_, equations.H, equations.g);
  return equations;
}

}  // namespace prescene::filter
