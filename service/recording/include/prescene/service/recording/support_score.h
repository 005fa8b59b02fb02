// SPDX-License-Identifier: Apache-2.0
// How still a support stays over a sequence: each frame's own measurement of its plane against the first one. Where
// nothing moves, this is the error of camera poses, depth and tracking together.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/clock.h"
#include "prescene/filter/proposals/support_tracking.h"

namespace prescene::service {

/// One support in one frame.
struct SupportFrame {
  core::TimeNs stamp_ns = 0;
  filter::SupportMeasurement measured;
  double tilt = 0.0;    ///< rad between its normal and that of the first measurement.
  double height = 0.0;  ///< m, of its plane above the first one, along that one's normal at the middle of its face.
};

struct SupportRow {
  std::string support;
  int frames = 0;                                    ///< Steps since it was measured first.
  int measured = 0;                                  ///< Of these, the steps in which it was measured.
  double median_tilt = 0.0, largest_tilt = 0.0;      ///< rad
  double median_height = 0.0, largest_height = 0.0;  ///< m, of the absolute values.
  double median_rms = 0.0;                           ///< m, of the points that lie on it.
  double median_share = 0.0;                         ///< Of the pixels that should show it.
};

class SupportScore {
 public:
  /// The measurements of one step, in the order of time; returns them with what they are compared to.
  std::vector<SupportFrame> add(core::TimeNs stamp_ns, const std::vector<filter::SupportMeasurement>& measurements);
  /// One row a support, in the order in which they appeared.
  std::vector<SupportRow> rows() const;
  /// All of them, by support as in rows().
  const std::vector<std::vector<SupportFrame>>& frames() const { return frames_; }

 private:
  std::vector<std::vector<SupportFrame>> frames_;  // by support
  std::vector<int> steps_;                         // since each was measured first
};

/// {"name", "normal" (W), "height_mm", "tilt_deg", "pixels", "share", "rms_mm"}
nlohmann::ordered_json to_json(const SupportFrame& frame);
nlohmann::ordered_json to_json(const SupportRow& row);

}  // namespace prescene::service
