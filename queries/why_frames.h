// SPDX-License-Identifier: Apache-2.0
// What one frame says of an object's pose, and of others that it is compared with, pixel by pixel.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "prescene/filter/proposals/frame.h"
#include "prescene/queries/why.h"

namespace prescene::queries {

/// Against one of the poses that it is compared with.
struct JudgedComparison {
  WhyFrame frame;
  geometry::Image<float> nats;
  std::optional<WhyPlace> place;
};

struct JudgedFrame {
  WhyView view;
  std::vector<JudgedComparison> comparisons;  ///< In the order of the poses that were given.
  rendering::Tempering tempering;             ///< Of the frame's likelihood.
  int step = 1;                               ///< Full-image pixels between two of the likelihood's.
  double pixels = 0.0;                        ///< With depth, at the pose that has most of them.
};

class FrameJudge {
 public:
  /// Both must outlive it.
  FrameJudge(const WhyContext& context, const filter::FilterTools& tools) : context_(context), tools_(tools) {}

  /// `object`: of the frame's belief. `others`: where it would be instead; empty = nowhere. kResourceExhausted where so
  /// many images as `kept` say would not fit; errors of filter::prepare_frame.
  core::Result<JudgedFrame> judge(const WindowFrame& seen, std::size_t object, const belief::Pose& X_WO,
                                  std::span<const std::optional<belief::Pose>> others, std::size_t kept);

 private:
  const WhyContext& context_;
  const filter::FilterTools& tools_;
  std::map<int, filter::FrameCache> caches_;  // by camera
};

}  // namespace prescene::queries
