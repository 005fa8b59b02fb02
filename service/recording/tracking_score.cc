// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/tracking_score.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/core/order_statistics.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::service {
namespace {

constexpr double kVisibleShare = 0.5;
constexpr double kWrong = 0.05;  // m

/// 0 for no values.
double quantile_or_zero(std::vector<double> values, double share) {
  return values.empty() ? 0.0 : core::quantile(std::move(values), share);
}

}  // namespace

void TrackingScore::add(const TruthRecord& truth) {
  TruthRecord& kept = truths_[truth.stamp_ns];
  kept = {truth.stamp_ns, {}};
  for (const TruthRecord::Object& object : truth.objects) {
    const bool twice = std::any_of(kept.objects.begin(), kept.objects.end(),
                                   [&](const TruthRecord::Object& other) { return other.name == object.name; });
    if (!twice && belief::find_object(*scene_, object.name)) kept.objects.push_back(object);
  }
}

std::optional<FrameError> TrackingScore::error_at(core::TimeNs stamp_ns, const std::string& name) const {
  const auto truth = truths_.find(stamp_ns);
  const auto summary = summaries_.find(stamp_ns);
  if (truth == truths_.end() || summary == summaries_.end()) return std::nullopt;
  const auto same_name = [&](const auto& object) { return object.name == name; };
  const auto& true_objects = truth->second.objects;
  const auto& estimates = summary->second.objects;
  const auto true_object = std::find_if(true_objects.begin(), true_objects.end(), same_name);
  const auto estimate = std::find_if(estimates.begin(), estimates.end(), same_name);
  if (true_object == true_objects.end() || estimate == estimates.end() || !true_object->present) return std::nullopt;
  geometry::SymmetryGroup symmetry;
  if (const auto index = belief::find_object(*scene_, name)) {
    symmetry = scene_->model_of(scene_->objects[static_cast<std::size_t>(*index)]).symmetry;
  }
  const geometry::Pose X_WO = geometry::closest_equivalent(estimate->X_WO, true_object->X_WO, symmetry);
  return FrameError{(X_WO.translation - true_object->X_WO.translation).norm(),
                    geometry::symmetric_angle(estimate->X_WO, true_object->X_WO, symmetry), true_object->visible_share};
}

std::vector<ObjectTrackingScore> TrackingScore::rows() const {
  std::vector<ObjectTrackingScore> rows;
  if (truths_.empty()) return rows;
  for (const TruthRecord::Object& named : truths_.begin()->second.objects) {
    ObjectTrackingScore row;
    row.object = named.name;
    std::vector<double> position_errors;
    std::vector<double> turn_errors;
    int tracked = 0;
    int wrong = 0;
    for (const auto& [stamp_ns, summary] : summaries_) {
      const std::optional<FrameError> error = error_at(stamp_ns, named.name);
      if (!error) continue;
      const bool is_tracked =
          std::any_of(summary.objects.begin(), summary.objects.end(), [&](const ObjectSummary& object) {
            return object.name == named.name && object.state == belief::TrackState::kTracked;
          });
      ++row.frames;
      wrong += is_tracked && error->position_error > kWrong ? 1 : 0;
      if (error->visible_share < kVisibleShare) continue;
      ++row.visible_frames;
      tracked += is_tracked ? 1 : 0;
      position_errors.push_back(error->position_error);
      turn_errors.push_back(error->turn_error);
    }
    row.median_position_error = quantile_or_zero(position_errors, 0.5);
    row.p90_position_error = quantile_or_zero(position_errors, 0.9);
    row.median_turn_error = quantile_or_zero(turn_errors, 0.5);
    row.share_tracked = row.visible_frames > 0 ? static_cast<double>(tracked) / row.visible_frames : 0.0;
    row.share_confidently_wrong = row.frames > 0 ? static_cast<double>(wrong) / row.frames : 0.0;
    rows.push_back(row);
  }
  return rows;
}

nlohmann::ordered_json to_json(const ObjectTrackingScore& score) {
  return {{"object", score.object},
          {"frames", score.frames},
          {"visible_frames", score.visible_frames},
          {"median_position_error_m", score.median_position_error},
          {"p90_position_error_m", score.p90_position_error},
          {"median_turn_error_rad", score.median_turn_error},
          {"share_tracked", score.share_tracked},
          {"share_confidently_wrong", score.share_confidently_wrong}};
}

}  // namespace prescene::service
