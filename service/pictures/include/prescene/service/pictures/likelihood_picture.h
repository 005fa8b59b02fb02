// SPDX-License-Identifier: Apache-2.0
// Why poses are believed: what each pixel of a frame says about the object that is believed to be seen there.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/core/status.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/service/backends.h"

namespace prescene::service {

/// One object at its heaviest particle's pose, against all pixels of the frame (the filter looks at fewer).
struct ObjectEvidence {
  std::string object;
  rendering::PoseEvidence evidence;
  /// Log ratios, nats, of the frame's size; NaN where the object is not seen or something known stands in front.
  geometry::Image<float> log_ratios;
};

/// Of each object that is not lost, in the belief's order. `observation` is the frame of the belief's last step. Errors
/// of filter::prepare_frame.
core::Result<std::vector<ObjectEvidence>> evidence_of_pixels(const belief::Belief& belief,
                                                             const belief::Observation& observation,
                                                             const filter::ColorModels& colors,
                                                             const filter::FrameOptions& options, Backends& backends);

/// The camera's picture in grey, with the log ratios in colour: orange for the pose, blue against it; below it the
/// scale and what the pixels of each object say together.
geometry::ColorImage likelihood_picture(const belief::Observation& observation,
                                        const std::vector<ObjectEvidence>& objects);

}  // namespace prescene::service
