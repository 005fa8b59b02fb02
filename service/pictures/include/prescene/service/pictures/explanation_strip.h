// SPDX-License-Identifier: Apache-2.0
// What a frame showed, what an explanation says that it should show, and where the two differ.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/queries/explain.h"
#include "prescene/service/backends.h"

namespace prescene::service {

struct ExplanationStrip {
  double time = 0.0;             ///< s from the window's start.
  std::string camera;            ///< Whose frame it is; "" of the only one.
  double against_nothing = 0.0;  ///< Nats, as DecidingFrame.
  geometry::ColorImage seen;
  geometry::ColorImage explained;  ///< Of the best explanation's most probable instance, in the models' colours.
  /// Measured minus explained depth: blue where something is nearer than the explanation has it, orange where it is
  /// further, full colours from 5 cm on; white where both agree, grey where nothing was measured or drawn.
  geometry::ColorImage difference;
};

/// Of the (at most) `most` frames that decide most, in the order of time: those that speak most for or against the best
/// explanation, against nothing and against the second best. Empty where the answer knows no poses. Errors of the
/// renderer.
core::Result<std::vector<ExplanationStrip>> explanation_strips(const queries::ExplainWindow& window,
                                                               const queries::ExplainAnswer& answer, std::size_t most,
                                                               Backends& backends);
/// The three pictures from left to right, with a gap.
geometry::ColorImage side_by_side(const ExplanationStrip& strip);
/// Depths of the same size, m, 0 = none; as ExplanationStrip::difference.
geometry::ColorImage depth_difference_picture(const geometry::DepthImage& measured,
                                              const geometry::DepthImage& explained);

}  // namespace prescene::service
