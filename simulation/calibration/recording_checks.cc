// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/recording_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "prescene/core/order_statistics.h"

namespace prescene::simulation {
namespace {

using geometry::Vector3d;

// Of a rest: s and frames, at the end of a recording, and s that are enough before it.
constexpr double kShortestRest = 0.03;
constexpr double kLongRest = 0.15;
constexpr std::size_t kRestFrames = 5;
// Within which an object lies still.
constexpr double kStillPlace = 1e-3;  // m
constexpr double kStillAngle = 0.02;  // rad
constexpr double kNoises = 6.0;
// Of kStillPlace and kStillAngle: what a rest may drift.
constexpr double kDrift = 0.4;
// Of kStillPlace and kStillAngle: what moved again is farther off than.
constexpr double kMovedAgain = 3.0;

constexpr double kJump = 8.0;

// Of twins: m, and of the vertical in the object's frame.
constexpr double kSameHeight = 1e-4;
constexpr double kSameTilt = 2e-3;
// Of the shorter recording, that must be in the other, and frames that one may begin later.
constexpr double kSharedFrames = 0.8;
constexpr std::ptrdiff_t kMostShift = 60;
constexpr std::size_t kLeastShared = 10;

class Stillness {
 public:
  Stillness(std::span<const TimedPose> frames, double position_noise, double rotation_noise)
      : frames_(frames),
        place_(std::max(kStillPlace, kNoises * position_noise)),
        angle_(std::max(kStillAngle, kNoises * rotation_noise)) {}

  double place() const { return place_; }
  double angle() const { return angle_; }
  bool near(std::size_t i, std::size_t k, double share) const {
    return (frames_[i].X_WO.translation - frames_[k].X_WO.translation).norm() <= share * place_ &&
           geometry::angle_between(frames_[i].X_WO.rotation, frames_[k].X_WO.rotation) <= share * angle_;
  }
  /// The last frame of those that stay where `first` is.
  std::size_t end_of(std::size_t first) const {
    std::size_t last = first;
    while (last + 1 < frames_.size() && near(first, last + 1, 1.0)) ++last;
    return last;
  }
  bool drifts(std::size_t first, std::size_t last) const {
    const std::size_t third = std::max<std::size_t>(1, (last - first + 1) / 3);
    Vector3d early = Vector3d::Zero(), late = Vector3d::Zero();
    for (std::size_t i = 0; i < third; ++i) {
      early += frames_[first + i].X_WO.translation / static_cast<double>(third);
      late += frames_[last - i].X_WO.translation / static_cast<double>(third);
    }
    return (late - early).norm() > kDrift * place_;
  }

 private:
  std::span<const TimedPose> frames_;
  double place_;
  double angle_;
};

/// What a turn about the vertical and a horizontal shift leave as it is.
struct Invariant {
  double height;
  Vector3d vertical_O;
};
std::vector<Invariant> invariants_of(std::span<const TimedPose> frames) {
  std::vector<Invariant> all;
  for (const TimedPose& frame : frames)
    all.push_back({frame.X_WO.translation.z(), frame.X_WO.rotation.conjugate() * Vector3d::UnitZ()});
  return all;
}

/// Whether frame i of a is frame i + shift of b, as far as both go.
bool same(const std::vector<Invariant>& a, const std::vector<Invariant>& b, std::ptrdiff_t shift) {
  const auto na = static_cast<std::ptrdiff_t>(a.size());
  const auto nb = static_cast<std::ptrdiff_t>(b.size());
  const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(0, -shift);
  const std::ptrdiff_t end = std::min(na, nb - shift);
  const auto least = std::max(kSharedFrames * static_cast<double>(std::min(na, nb)), static_cast<double>(kLeastShared));
  if (static_cast<double>(end - begin) < least) return false;
  for (std::ptrdiff_t i = begin; i < end; ++i) {
    const Invariant& p = a[static_cast<std::size_t>(i)];
    const Invariant& q = b[static_cast<std::size_t>(i + shift)];
    if (std::abs(p.height - q.height) > kSameHeight || (p.vertical_O - q.vertical_O).cwiseAbs().maxCoeff() > kSameTilt)
      return false;
  }
  return true;
}

/// Whether anything but lying or sliding happens: things that slide on a level board all agree in height and tilt.
bool is_distinctive(const std::vector<Invariant>& motion) {
  double low = motion.front().height, high = low, tilt = 0.0;
  for (const Invariant& each : motion) {
    low = std::min(low, each.height);
    high = std::max(high, each.height);
    tilt = std::max(tilt, (each.vertical_O - motion.front().vertical_O).norm());
  }
  return high - low > 20.0 * kSameHeight || tilt > 20.0 * kSameTilt;
}

}  // namespace

std::optional<RecordedRest> find_rest(std::span<const TimedPose> frames, double position_noise, double rotation_noise) {
  const Stillness stillness(frames, position_noise, rotation_noise);
  for (std::size_t first = 0; first + kRestFrames <= frames.size(); ++first) {
    const std::size_t last = stillness.end_of(first);
    const double time = frames[last].time - frames[first].time;
    const bool to_the_end = last + 1 == frames.size();
    if (last - first + 1 < kRestFrames || time < (to_the_end ? kShortestRest : kLongRest)) continue;
    if (stillness.drifts(first, last)) continue;
    RecordedRest rest{first, last, std::nullopt, 0.0, 0.0};
    if (to_the_end) return rest;
    // Whether it goes away, or a frame is off and it lies there still.
    const std::size_t middle = first + (last - first) / 2;
    const std::size_t end = frames.size() - 1;
    for (std::size_t i = last + 1; i <= end; ++i) {
      const double moved = (frames[i].X_WO.translation - frames[middle].X_WO.translation).norm();
      const double turned = geometry::angle_between(frames[i].X_WO.rotation, frames[middle].X_WO.rotation);
      rest.moved = std::max(rest.moved, moved);
      rest.turned = std::max(rest.turned, turned);
    }
    if (stillness.near(middle, end, 1.0) && rest.moved <= kMovedAgain * stillness.place() &&
        rest.turned <= kMovedAgain * stillness.angle()) {
      rest.last = end;
      rest.moved = rest.turned = 0.0;
    } else {
      // Not where noise first ends the still frames, but where it leaves.
      std::size_t gone = last + 1;
      while (gone < end && stillness.near(middle, gone, kMovedAgain)) ++gone;
      while (gone > last + 1 && !stillness.near(middle, gone - 1, 1.0)) --gone;
      rest.moves_again = gone;
    }
    return rest;
  }
  return std::nullopt;
}

double rotation_noise_of(std::span<const std::span<const TimedPose>> recordings) {
  std::vector<double> sizes;
  for (const auto& frames : recordings) {
    for (std::size_t i = 3; i < frames.size(); ++i) {
      const geometry::Quaterniond back = frames[i - 3].X_WO.rotation.conjugate();
      const auto turn = [&](std::size_t k) -> Vector3d {
        return geometry::log_rotation(back * frames[i - 3 + k].X_WO.rotation);
      };
      const Vector3d third = turn(3) - 3.0 * turn(2) + 3.0 * turn(1);
      for (const double each : third) sizes.push_back(std::abs(each));
    }
  }
  // The median of |N(0, 1)|, and the size of a third difference of noise one.
  return core::upper_median(std::move(sizes)) / (0.67449 * std::sqrt(20.0));
}

std::optional<std::size_t> find_stamp_jump(std::span<const TimedPose> frames) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < frames.size(); ++i) steps.push_back(frames[i].time - frames[i - 1].time);
  const double longest = kJump * core::upper_median(steps);
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (steps[i] > longest) return i + 1;
  return std::nullopt;
}

std::vector<std::size_t> find_twins(std::span<const std::span<const TimedPose>> recordings) {
  std::vector<std::vector<Invariant>> motions;
  for (const auto& frames : recordings) motions.push_back(invariants_of(frames));
  std::vector<std::size_t> first(motions.size());
  for (std::size_t b = 0; b < motions.size(); ++b) {
    first[b] = b;
    if (motions[b].empty() || !is_distinctive(motions[b])) continue;
    for (std::size_t a = 0; a < b && first[b] == b; ++a) {
      if (first[a] != a || motions[a].empty()) continue;
      for (std::ptrdiff_t shift = -kMostShift; shift <= kMostShift; ++shift) {
        if (!same(motions[a], motions[b], shift)) continue;
        first[b] = a;
        break;
      }
    }
  }
  return first;
}

}  // namespace prescene::simulation
