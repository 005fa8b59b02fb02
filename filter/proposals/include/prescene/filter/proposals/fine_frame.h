// SPDX-License-Identifier: Apache-2.0
// The frame at a finer resolution. The coarse image of the likelihood is enough to find poses; whether a pose is right
// is seen where the object ends, and that a coarse image tells to half a pixel at best, 5 to 10 mm on a table.
//
//   const FineFrame fine = fine_frame_if_sharp(frame, *scene, observation, tools);
//   std::vector<Detection> found = detect(terms, fine, known, sampled, surroundings, wanted, options, tools, stream);
#pragma once

#include <span>
#include <vector>

#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/edge_smear.h"

namespace prescene::filter {

/// Width of the fine image, about: the observation is sampled every so many pixels that fit best. A pixel is then 3 to
/// 4 mm wide at 1 m. Measured: docs/studies/tracking.md.
inline constexpr int kFineWidth = 320;

/// What finds are judged in.
struct FineFrame {
  rendering::FrameTerms terms;
  geometry::ColorImage color;  ///< Of terms.camera; empty = none.
  EdgeSmear smear;             ///< Of the observation.
};

/// About kFineWidth pixels wide (no more than the observation), otherwise as frame.terms, with the robot put in.
/// `scene` and `observation` are those that the frame was prepared with.
FineFrame fine_frame(const FilterFrame& frame, const belief::Scene& scene, const belief::Observation& observation,
                     const FilterTools& tools);
/// The same of a camera whose smear is known: measuring it takes as long as the rest.
FineFrame fine_frame(const FilterFrame& frame, const belief::Scene& scene, const belief::Observation& observation,
                     const FilterTools& tools, const EdgeSmear& smear);
/// The same where the camera is sharp; else its smear alone, without terms, since finds are not judged in them.
FineFrame fine_frame_if_sharp(const FilterFrame& frame, const belief::Scene& scene,
                              const belief::Observation& observation, const FilterTools& tools);

/// detect() where poses that were found in `terms` are judged in `fine`, with the same known things put in, if the
/// camera shows sharply where surfaces end: what the fine image adds is the two pixels beside an outline, and a camera
/// that smears edges over more of them would speak against right poses. Otherwise, and where a learned judge decides,
/// poses are judged in `terms`, whose two pixels, 16 of 640, are wider than what real cameras smear.
std::vector<Detection> detect(const rendering::FrameTerms& terms, const FineFrame& fine,
                              const geometry::DepthImage& known, const SampledDepth& sampled,
                              const Surroundings& surroundings, std::span<const WantedModel> wanted,
                              const DetectionOptions& options, const FilterTools& tools,
                              const core::RandomStream& stream, DetectionTrace* trace = nullptr);

/// Puts known things into the fine image whose depth is rendered in a coarser camera of the same view. What is measured
/// within one coarse pixel of their outline and at their depth is taken for theirs.
void with_coarse_known(const geometry::DepthImage& known, const geometry::PinholeCamera& camera,
                       rendering::FrameTerms& fine);

/// `terms` with the walls, the supports that the scene does not list and the sides of supports in it, as they are
/// measured: they are no evidence of an object, and where they are seen beside one, the object ends.
rendering::FrameTerms with_background(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                                      const Surroundings& surroundings);
/// The same with the walls and the sides of supports alone.
rendering::FrameTerms with_walls(const rendering::FrameTerms& terms, const SampledDepth& sampled,
                                 const Surroundings& surroundings);

}  // namespace prescene::filter
