// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/support_score.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include "prescene/core/order_statistics.h"
#include "prescene/geometry/angles.h"

namespace prescene::service {
namespace {

SupportFrame compared(core::TimeNs stamp_ns, const filter::SupportMeasurement& measured,
                      const filter::SupportMeasurement& first) {
  SupportFrame frame{stamp_ns, measured, 0.0, 0.0};
  const geometry::Vector3d& normal = measured.plane_W.normal;
  const double cosine = normal.dot(first.plane_W.normal);
  frame.tilt = std::atan2(normal.cross(first.plane_W.normal).norm(), cosine);
  if (cosine > 0.0) frame.height = -measured.plane_W.signed_distance(first.p_WQ) / cosine;
  return frame;
}

}  // namespace

std::vector<SupportFrame> SupportScore::add(core::TimeNs stamp_ns,
                                            const std::vector<filter::SupportMeasurement>& measurements) {
  std::vector<SupportFrame> added;
  for (int& steps : steps_) ++steps;
  for (const filter::SupportMeasurement& measured : measurements) {
    auto known = std::find_if(frames_.begin(), frames_.end(),
                              [&](const auto& of) { return of.front().measured.support == measured.support; });
    if (known == frames_.end()) {
      frames_.push_back({compared(stamp_ns, measured, measured)});
      steps_.push_back(1);
      known = frames_.end() - 1;
    } else {
      known->push_back(compared(stamp_ns, measured, known->front().measured));
    }
    added.push_back(known->back());
  }
  return added;
}

std::vector<SupportRow> SupportScore::rows() const {
  std::vector<SupportRow> rows;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    SupportRow row;
    row.support = frames_[i].front().measured.support;
    row.frames = steps_[i];
    row.measured = static_cast<int>(frames_[i].size());
    std::vector<double> tilts, heights, residuals, shares;
    for (const SupportFrame& frame : frames_[i]) {
      tilts.push_back(frame.tilt);
      heights.push_back(std::abs(frame.height));
      residuals.push_back(frame.measured.rms);
      shares.push_back(frame.measured.share);
    }
    row.largest_tilt = *std::max_element(tilts.begin(), tilts.end());
    row.largest_height = *std::max_element(heights.begin(), heights.end());
    // The first measurement is the reference: it says nothing of itself.
    row.median_tilt = core::upper_median({tilts.begin() + 1, tilts.end()});
    row.median_height = core::upper_median({heights.begin() + 1, heights.end()});
    row.median_rms = core::upper_median(residuals);
    row.median_share = core::upper_median(shares);
    rows.push_back(row);
  }
  return rows;
}

nlohmann::ordered_json to_json(const SupportFrame& frame) {
  const geometry::Vector3d& n = frame.measured.plane_W.normal;
  return {{"name", frame.measured.support},
          {"normal", {n.x(), n.y(), n.z()}},
          {"tilt_deg", frame.tilt * geometry::kDegreesPerRadian},
          {"height_mm", 1e3 * frame.height},
          {"pixels", frame.measured.pixels},
          {"share", frame.measured.share},
          {"rms_mm", 1e3 * frame.measured.rms}};
}

nlohmann::ordered_json to_json(const SupportRow& row) {
  return {{"name", row.support},
          {"frames", row.frames},
          {"measured", row.measured},
          {"median_tilt_deg", row.median_tilt * geometry::kDegreesPerRadian},
          {"largest_tilt_deg", row.largest_tilt * geometry::kDegreesPerRadian},
          {"median_height_mm", 1e3 * row.median_height},
          {"largest_height_mm", 1e3 * row.largest_height},
          {"median_rms_mm", 1e3 * row.median_rms},
          {"median_share", row.median_share}};
}

}  // namespace prescene::service
