// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/tracking_counter.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::service {
namespace {

using geometry::Pose;

constexpr double kVisibleShare = 0.5;
constexpr double kHiddenShare = 0.1;
constexpr double kSurelyRight = 0.99;
constexpr double kConfident = 0.9;
constexpr double kChiSquared90 = 6.2513886;  // 3 degrees of freedom
constexpr double kStillShift = 1e-4;         // m: a truth that moves less between two frames stands still
constexpr double kStillTurn = 1e-3;          // rad

const ObjectSummary* find(const BeliefSummary& summary, const std::string& name) {
  const auto found = std::find_if(summary.objects.begin(), summary.objects.end(),
                                  [&](const ObjectSummary& object) { return object.name == name; });
  return found == summary.objects.end() ? nullptr : &*found;
}

struct Difference {
  double shift = 0.0;
  double turn = 0.0;
};

/// Of `estimate` from `reference`, up to the symmetry.
Difference difference(const Pose& estimate, const Pose& reference, const geometry::SymmetryGroup& symmetry) {
  const Pose nearest = geometry::closest_equivalent(estimate, reference, symmetry);
  return {(nearest.translation - reference.translation).norm(),
          geometry::symmetric_angle(estimate, reference, symmetry)};
}

bool region_holds(const ObjectSummary& object, const Pose& X_WO) {
  const Eigen::Matrix3d covariance = object.covariance.bottomRightCorner<3, 3>() + 1e-10 * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d d = X_WO.translation - object.X_WO.translation;
  return d.dot(geometry::solve_symmetric_3(covariance, d)) <= kChiSquared90;
}

}  // namespace

TrackingFigures TrackingCounter::figures() const {
  TrackingFigures f;
  f.sequences = 1;
  const BeliefSummary* last_summary = nullptr;
  const TruthRecord* last_truth = nullptr;
  for (const auto& [stamp_ns, summary] : summaries_) {
    const auto truth = truths_.find(stamp_ns);
    if (truth == truths_.end()) continue;
    ++f.frames;
    for (const TruthRecord::Object& object : truth->second.objects) {
      const ObjectSummary* estimate = find(summary, object.name);
      const auto index = belief::find_object(*scene_, object.name);
      if (estimate == nullptr || !index) continue;
      const geometry::SymmetryGroup& symmetry =
          scene_->model_of(scene_->objects[static_cast<std::size_t>(*index)]).symmetry;
      const Difference error = difference(estimate->X_WO, object.X_WO, symmetry);
      const bool right = object.present && error.shift <= kRightPosition && error.turn <= kRightTurn;
      const bool is_tracked = estimate->state == belief::TrackState::kTracked;
      f.believed += is_tracked;
      f.wrong += is_tracked && !right;
      f.surely_wrong += is_tracked && !right && estimate->confidence >= kConfident;
      const auto bin = std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * std::max(0.0, estimate->confidence)));
      ++f.by_confidence[bin];
      f.right_by_confidence[bin] += right;
      f.sure += estimate->confidence >= kSurelyRight;
      f.sure_right += estimate->confidence >= kSurelyRight && right;
      if (!object.present) continue;
      if (object.visible_share < kHiddenShare && estimate->state != belief::TrackState::kLost) {
        ++f.hidden;
        f.hidden_covered += region_holds(*estimate, object.X_WO);
      }
      if (object.visible_share < kVisibleShare) continue;
      ++f.visible;
      if (!is_tracked) continue;
      ++f.tracked;
      f.position_errors.push_back(error.shift);
      f.turn_errors.push_back(error.turn);
      if (last_summary == nullptr) continue;
      const ObjectSummary* before = find(*last_summary, object.name);
      const auto was = std::find_if(last_truth->objects.begin(), last_truth->objects.end(),
                                    [&](const TruthRecord::Object& other) { return other.name == object.name; });
      if (before == nullptr || before->state != belief::TrackState::kTracked || was == last_truth->objects.end() ||
          !was->present)
        continue;
      const Difference moved = difference(object.X_WO, was->X_WO, {});
      if (moved.shift > kStillShift || moved.turn > kStillTurn) continue;
      const Difference shown = difference(estimate->X_WO, before->X_WO, symmetry);
      f.still_shifts.push_back(shown.shift);
      f.still_turns.push_back(shown.turn);
    }
    last_summary = &summary;
    last_truth = &truth->second;
  }
  return f;
}

}  // namespace prescene::service
