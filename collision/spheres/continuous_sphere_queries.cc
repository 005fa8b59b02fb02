// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/continuous_sphere_queries.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sweep_lanes.h"

namespace prescene::collision {

namespace {

using Eigen::Vector3d;

/// X_AB * c in double precision.
Vector3d placed(const Transform& X_AB, const Vector3d& c) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> rotation(X_AB.rotation.data());
  return rotation.cast<double>() * c + Eigen::Map<const Vector3f>(X_AB.translation.data()).cast<double>();
}

/// The pair that meets first so far.
struct EarliestPair {
  double time;
  bool found = false;
  std::uint32_t place_a = 0;
  std::uint32_t place_b = 0;

  void offer(double t, std::uint32_t a, std::uint32_t b) {
    if (t > time || (found && t == time && std::pair(a, b) > std::pair(place_a, place_b))) return;
    *this = {t, true, a, b};
  }
};

class Pairs {
 public:
  Pairs(const SphereTree& a, const SphereTree& b) : a_(a), b_(b) {}
  const PackedSphere& a(std::uint32_t place) const { return a_.packing().spheres()[a_.order()[place]]; }
  const PackedSphere& b(std::uint32_t place) const { return b_.packing().spheres()[b_.order()[place]]; }

  Impact impact(const EarliestPair& earliest, const Vector3d& centre_b) const {
    Impact impact;
    impact.time = earliest.time;
    impact.sphere_a = a_.order()[earliest.place_a];
    impact.sphere_b = b_.order()[earliest.place_b];
    const Vector3d centre_a = a(earliest.place_a).centre.cast<double>();
    const Vector3d between = centre_b - centre_a;
    const double distance = between.norm();
    impact.normal = distance > 0.0 ? Vector3d(between / distance) : Vector3d(Vector3d::UnitX());
    impact.point = centre_a + static_cast<double>(a(earliest.place_a).radius) * impact.normal;
    return impact;
  }

 private:
  const SphereTree& a_;
  const SphereTree& b_;
};

double radii_of(const PackedSphere& a, const PackedSphere& b) {
  return static_cast<double>(a.radius) + static_cast<double>(b.radius);
}

class StraightPairs final : public SweptPairs {
 public:
  StraightPairs(const Pairs& pairs, const Transform& start, const Transform& end)
      : pairs_(pairs), start_(start), end_(end) {}

  double meet(std::uint32_t place_a, std::uint32_t place_b) override {
    const PackedSphere& a = pairs_.a(place_a);
    const PackedSphere& b = pairs_.b(place_b);
    const Vector3d c = b.centre.cast<double>();
    const Vector3d from = placed(start_, c) - a.centre.cast<double>();
    const Vector3d to = placed(end_, c) - a.centre.cast<double>();
    if (const auto time = swept_spheres_contact(from, to, radii_of(a, b))) earliest.offer(*time, place_a, place_b);
    return earliest.time;
  }

  EarliestPair earliest{1.0};

 private:
  const Pairs& pairs_;
  const Transform& start_;
  const Transform& end_;
};

/// Within a piece [begin, end] of a screw.
class TurningPairs final : public SweptPairs {
 public:
  TurningPairs(const Pairs& pairs, const ScrewMotion& motion, double tolerance)
      : pairs_(pairs), motion_(motion), tolerance_(tolerance) {}

  void set_piece(double begin, double end) {
    begin_ = begin;
    end_ = end;
    earliest.time = end;
  }

  double meet(std::uint32_t place_a, std::uint32_t place_b) override {
    const PackedSphere& a = pairs_.a(place_a);
    const PackedSphere& b = pairs_.b(place_b);
    const Vector3d centre = a.centre.cast<double>();
    const double radii = radii_of(a, b);
    const Vector3d start = motion_.start() * b.centre.cast<double>();
    const double speed = motion_.speed(start);
    const double bend = motion_.bend(start);
    // On chords of this length the sphere is off by half the tolerance at most.
    const double chord = bend > 0.0 ? std::sqrt(4.0 * tolerance_ / bend) : 2.0;
    double t = begin_;
    Vector3d from = motion_.place(start, t) - centre;
    while (true) {
      const double gap = from.norm() - radii;
      if (gap <= 0.0) {
        earliest.offer(t, place_a, place_b);
        break;
      }
      if (speed <= 0.0 || t >= earliest.time) break;
      // It takes that long to close the gap, however the sphere moves.
      const double free = gap / speed;
      if (free > chord) {
        t += free;
        if (t > earliest.time) break;
        from = motion_.place(start, t) - centre;
        continue;
      }
      const double next = std::min(t + chord, end_);
      const Vector3d to = motion_.place(start, next) - centre;
      const double off = 0.125 * bend * (next - t) * (next - t);
      if (const auto share = swept_spheres_contact(from, to, radii + off)) {
        earliest.offer(t + *share * (next - t), place_a, place_b);
        break;
      }
      if (next >= end_) break;
      t = next;
      from = to;
    }
    return (earliest.time - begin_) / (end_ - begin_);
  }

  EarliestPair earliest{1.0};

 private:
  const Pairs& pairs_;
  const ScrewMotion& motion_;
  double tolerance_;
  double begin_ = 0.0;
  double end_ = 1.0;
};

int pieces_of(const SphereTree& a, const SphereTree& b, const ScrewMotion& motion) {
  const auto radius = static_cast<double>(b.root().radius);
  const double bend =
      motion.bend(motion.start() * b.root().centre.cast<double>()) + motion.spin().squaredNorm() * radius;
  return chord_pieces(bend, kChordDeviation * std::min(radius, static_cast<double>(a.root().radius)));
}

Transform rounded(const geometry::Pose& X) {
  Transform transform;
  const Eigen::Matrix3d R = X.rotation.toRotationMatrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) transform.rotation[static_cast<std::size_t>(3 * i + j)] = static_cast<float>(R(i, j));
    transform.translation[static_cast<std::size_t>(i)] = static_cast<float>(X.translation[i]);
  }
  return transform;
}

}  // namespace

std::optional<double> swept_spheres_contact(const Vector3d& from, const Vector3d& to, double radii) {
  const double outside = from.squaredNorm() - radii * radii;
  if (outside <= 0.0) return 0.0;
  const Vector3d move = to - from;
  const double approach = -from.dot(move);
  const double square = move.squaredNorm();
  if (!(approach > 0.0)) return std::nullopt;  // standing still, or moving apart
  const double discriminant = approach * approach - square * outside;
  if (discriminant < 0.0) return std::nullopt;
  // The smaller root, written so that nothing cancels.
  const double time = outside / (approach + std::sqrt(discriminant));
  if (time > 1.0) return std::nullopt;
  return time;
}

std::optional<Impact> time_of_impact(const SphereTree& a, const SphereTree& b, const Transform& X_AB_start,
                                     const Transform& X_AB_end, SweepScratch& scratch) {
  const Pairs pairs(a, b);
  StraightPairs straight(pairs, X_AB_start, X_AB_end);
  sweep(a, b, {X_AB_start, X_AB_end}, &scratch, &straight);
  if (!straight.earliest.found) return std::nullopt;
  const Vector3d c = pairs.b(straight.earliest.place_b).centre.cast<double>();
  const Vector3d from = placed(X_AB_start, c);
  return pairs.impact(straight.earliest, from + straight.earliest.time * (placed(X_AB_end, c) - from));
}

std::optional<Impact> time_of_impact(const SphereTree& a, const SphereTree& b, const ScrewMotion& motion,
                                     const ImpactOptions& options, SweepScratch& scratch) {
  const Pairs pairs(a, b);
  TurningPairs turning(pairs, motion, std::max(kLeastImpactTolerance, options.tolerance));
  const int count = pieces_of(a, b, motion);
  Sweep piece;
  piece.end = rounded(motion.pose(0.0));
  for (int i = 0; i < count && !turning.earliest.found; ++i) {
    const double begin = static_cast<double>(i) / count;
    const double end = i + 1 == count ? 1.0 : static_cast<double>(i + 1) / count;
    turning.set_piece(begin, end);
    piece.start = piece.end;
    piece.end = rounded(motion.pose(end));
    piece.set_bend(motion, begin, end);
    sweep(a, b, piece, &scratch, &turning);
  }
  if (!turning.earliest.found) return std::nullopt;
  const Vector3d c = pairs.b(turning.earliest.place_b).centre.cast<double>();
  return pairs.impact(turning.earliest, motion.place(motion.start() * c, turning.earliest.time));
}

}  // namespace prescene::collision
