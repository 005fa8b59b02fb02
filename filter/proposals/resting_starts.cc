// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/proposals/resting_starts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "resting_parts.h"

namespace prescene::filter {
namespace {

using Eigen::Vector2d;
using geometry::Quaterniond;

constexpr double kSlide = 0.015;  // m between places along an edge ...
constexpr int kMostSlides = 8;    // ... of which there are at most so many
constexpr int kTurns = 2;         // random ones at each place, of what has straight sides
// Of the reach of what is covered: how far its middle may be behind a point that is seen, or before one within it.
constexpr std::array<double, 5> kBehind = {-0.7, -0.2, 0.3, 0.7, 1.0};
constexpr double kSameStart = 0.012;  // m ...
constexpr double kSameTurn = 0.15;    // ... and rad

Vector2d turned(const Vector2d& v, double cosine, double sine) {
  return {cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y()};
}

/// Makes and compares poses of one model in one cluster.
class StartFinder {
 public:
  StartFinder(const ClusterShape& cluster, const RestingShape& shape, const rendering::FrameTerms& fine,
              const Surroundings& surroundings, const core::RandomStream& stream)
      : cluster_(cluster), shape_(shape), fine_(fine), draws_(stream) {
    const Quaterniond R_UW = up_to_z(surroundings.up_W);
    X_CU_ = geometry::Pose{(R_UW * surroundings.X_WC.rotation).normalized(), R_UW * surroundings.X_WC.translation}
                .inverse();
  }

  std::vector<Pose> run(int most) {
    for (std::size_t group = 0; group < shape_.rests.size(); ++group) {
      const std::vector<Rest>& alike = shape_.rests[group];
      const double height = alike.front().top - alike.front().bottom;
      for (const double base : bases_of(height)) {
        for (const SeenEdge& edge : cluster_.edges) along_edge(static_cast<int>(group), base, edge);
        at_points(static_cast<int>(group), base);
      }
    }
    std::stable_sort(tries_.begin(), tries_.end(), [](const Try& a, const Try& b) { return a.score > b.score; });
    std::vector<Try> kept;
    std::vector<Pose> starts;
    for (const Try& one : tries_) {
      if (static_cast<int>(kept.size()) >= most || one.score <= 0) break;
      if (std::any_of(kept.begin(), kept.end(), [&](const Try& other) {
            return other.group == one.group && (other.p_U - one.p_U).norm() < kSameStart &&
                   other.X_CO.rotation.angularDistance(one.X_CO.rotation) < kSameTurn;
          }))
        continue;
      kept.push_back(one);
      starts.push_back(one.X_CO);
    }
    return starts;
  }

 private:
  struct Try {
    int group = 0;
    int score = 0;
    Vector3d p_U;  // of the middle
    Pose X_CO;
  };

  /// Heights at which something of this height may begin: on what is below, or under a level face.
  std::vector<double> bases_of(double height) const {
    std::vector<double> bases = cluster_.bases;
    const double lowest =
        bases.empty() ? -std::numeric_limits<double>::infinity() : *std::min_element(bases.begin(), bases.end());
    for (const double top : cluster_.tops) {
      const double base = top - height;
      if (base > lowest - kSameHeight &&
          std::none_of(bases.begin(), bases.end(), [&](double other) { return std::abs(other - base) < kSameHeight; }))
        bases.push_back(base);
    }
    return bases;
  }

  const Rest& one_of(int group) {
    const std::vector<Rest>& alike = shape_.rests[static_cast<std::size_t>(group)];
    return alike[draws_.uniform_below(alike.size())];
  }

  void along_edge(int group, double base, const SeenEdge& edge) {
    const Rest& rest = one_of(group);
    const Vector2d along = left_of(edge.outwards);
    for (const auto& [from, to] : rest.sides) {
      // The side goes along the edge, as both have the thing to their left.
      const Vector2d way = (to - from).normalized();
      const double cosine = way.dot(along), sine = way.x() * along.y() - way.y() * along.x();
      const Vector2d start = turned(from, cosine, sine), end = turned(to, cosine, sine);
      const double across = edge.offset - edge.outwards.dot(start);
      const double at_first = edge.first - along.dot(start), at_last = edge.last - along.dot(end);
      const int steps = std::clamp(1 + static_cast<int>(std::abs(at_last - at_first) / kSlide), 1, kMostSlides - 1);
      for (int i = 0; i <= steps; ++i) {
        const double slide = at_first + (at_last - at_first) * i / steps;
        const Vector2d at = across * edge.outwards + slide * along;
        attempt(group, rest, cosine, sine, {at.x(), at.y(), base - rest.bottom});
      }
    }
  }

  /// With the border nearest to the camera at points of the cluster.
  void at_points(int group, double base) {
    const Vector3d p_UC = X_CU_.inverse().translation;
    for (const Vector3d& p : cluster_.points_U) {
      const Rest& rest = one_of(group);
      const Vector2d away = (p - p_UC).head<2>().normalized();
      for (const double behind : kBehind)
        for (int turn = 0; turn < (rest.sides.empty() ? 1 : kTurns); ++turn) {
          const double angle = draws_.uniform(-std::numbers::pi, std::numbers::pi);
          const double cosine = std::cos(angle), sine = std::sin(angle);
          const Vector2d at = p.head<2>() + behind * rest.reach * away - turned(rest.middle, cosine, sine);
          attempt(group, rest, cosine, sine, {at.x(), at.y(), base - rest.bottom});
        }
    }
  }

  void attempt(int group, const Rest& rest, double cosine, double sine, const Vector3d& p_UO) {
    geometry::Matrix3d R;
    R << cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0;
    Try one;
    one.group = group;
    const geometry::Matrix3d R_UO = R * rest.R_UO.toRotationMatrix();
    one.X_CO = X_CU_ * Pose{Quaterniond(R_UO).normalized(), p_UO};
    const Vector2d middle = turned(rest.middle, cosine, sine) + p_UO.head<2>();
    one.p_U = {middle.x(), middle.y(), p_UO.z() + 0.5 * (rest.bottom + rest.top)};
    one.score = points_shown(shape_, fine_, one.X_CO);
    if (one.score > 0) tries_.push_back(one);
  }

  const ClusterShape& cluster_;
  const RestingShape& shape_;
  const rendering::FrameTerms& fine_;
  core::RandomStream draws_;
  Pose X_CU_;
  std::vector<Try> tries_;
};

}  // namespace

std::vector<Pose> resting_starts(const ClusterShape& cluster, const RestingShape& shape,
                                 const rendering::FrameTerms& fine, const Surroundings& surroundings, int most,
                                 const core::RandomStream& stream) {
  return StartFinder(cluster, shape, fine, surroundings, stream).run(most);
}

}  // namespace prescene::filter
