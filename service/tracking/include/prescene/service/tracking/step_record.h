// SPDX-License-Identifier: Apache-2.0
// What a belief step was made of, in a recording and in replay.
#pragma once

#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/core/status.h"
#include "prescene/service/tracking/frame_assembler.h"

namespace prescene::service {

/// Times beyond it, in the year 2116, are written as this one and read as damage. The sum of two is in range.
inline constexpr core::TimeNs kLatestRecordedNs = std::numeric_limits<core::TimeNs>::max() / 2;

/// What was done in one belief step: enough to repeat it. JSON form on kStepTopic.
struct StepRecord {
  std::uint64_t step = 0;
  /// Messages with a number up to this one had been taken in; the frame was chosen as if at `now_ns`.
  MessageIndex after = 0;
  core::TimeNs now_ns = 0;
  core::TimeNs stamp_ns = 0;  ///< Of the frame.
  int camera = 0;             ///< Of the scene whose frame it is.
  MessageIndex depth = 0;
  std::optional<MessageIndex> color;
  MessageIndex camera_info = 0;
  MessageIndex tf_until = 0;
  std::vector<SkippedFrame> skipped;  ///< Since the step before.
  std::vector<std::string> degraded;  ///< What could not be done fully.
  std::string belief_hash;            ///< Of all bits of the belief after the step.
  double seconds = 0.0;               ///< Wall time it took; not replayed.
};
nlohmann::ordered_json to_json(const StepRecord& record);
/// kInvalidInput naming the key that is missing or is not what to_json() writes; lists and seconds may be missing.
core::Result<StepRecord> step_record_from_json(const std::string& text);

}  // namespace prescene::service
