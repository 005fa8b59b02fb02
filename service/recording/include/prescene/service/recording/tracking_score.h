// SPDX-License-Identifier: Apache-2.0
// How well a simulated recording was tracked: estimates against the truth of the same frame.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/recording/simulated_recording.h"

namespace prescene::service {

struct ObjectTrackingScore {
  std::string object;
  int frames = 0;          ///< With an estimate and a truth.
  int visible_frames = 0;  ///< At least half of it seen.
  /// m, over visible frames, of the origin (on the axis' line for continuous symmetry).
  double median_position_error = 0.0;
  double p90_position_error = 0.0;
  double median_turn_error = 0.0;        ///< rad, modulo the model's symmetry.
  double share_tracked = 0.0;            ///< Visible frames in state tracked.
  double share_confidently_wrong = 0.0;  ///< Of all frames: tracked, yet more than 5 cm off.
};

/// One object in one frame, against the truth.
struct FrameError {
  double position_error = 0.0;  ///< m, as in ObjectTrackingScore.
  double turn_error = 0.0;      ///< rad, modulo the model's symmetry.
  double visible_share = 0.0;   ///< The true one.
};

/// Collects summaries and truths in any order and scores those with equal stamps.
class TrackingScore {
 public:
  explicit TrackingScore(std::shared_ptr<const belief::Scene> scene) : scene_(std::move(scene)) {}
  void add(const BeliefSummary& summary) { summaries_[summary.stamp_ns] = summary; }
  /// Objects that the scene does not have are left out: nothing estimates them.
  void add(const TruthRecord& truth);
  /// One row an object of the truth, in its order; empty without truth.
  std::vector<ObjectTrackingScore> rows() const;
  /// Empty where the frame has no truth, or no estimate, of this object.
  std::optional<FrameError> error_at(core::TimeNs stamp_ns, const std::string& object) const;

 private:
  std::shared_ptr<const belief::Scene> scene_;
  std::map<core::TimeNs, BeliefSummary> summaries_;
  std::map<core::TimeNs, TruthRecord> truths_;
};
nlohmann::ordered_json to_json(const ObjectTrackingScore& score);

}  // namespace prescene::service
