// SPDX-License-Identifier: Apache-2.0
// Follows a flat support from frame to frame: where the frame shows it, against where it is believed to be. A support
// that was found in a frame, and not given by the scene, is corrected by what later frames show.
//
//   if (auto seen = measure_support(sampled, X_WC, support)) correct_support(*seen, gain, support);
#pragma once

#include <optional>
#include <string>

#include "prescene/belief/scene.h"
#include "prescene/filter/proposals/segmentation.h"

namespace prescene::filter {

/// The name of the first support that was found in a frame; the others are support_plane_2 and so on.
inline constexpr const char* kFoundSupport = "support_plane";
/// Whether a support of this name was found, and not given by the scene.
bool is_found_support(const std::string& name);

/// A support as one frame shows it.
struct SupportMeasurement {
  std::string support;
  geometry::Plane plane_W;  ///< Its upper face, fitted to this frame alone; the normal points up from it.
  Vector3d p_WQ;            ///< The point of that plane above the middle of the believed face.
  double tilt = 0.0;        ///< rad between the measured normal and the believed one.
  double height = 0.0;      ///< m, of the measured face above the believed one, at its middle.
  int pixels = 0;           ///< That lie on it, of the sampled image.
  double share = 0.0;       ///< Of the pixels that should show it and show nothing nearer.
  double rms = 0.0;         ///< m, distance of these from the plane.
};

/// Empty for supports that are no single box, and where too little of the upper (+z) face is seen.
std::optional<SupportMeasurement> measure_support(const SampledDepth& sampled, const Pose& X_WC,
                                                  const belief::Support& support);

/// Moves the support by `gain` (0 .. 1) of the way to where it was measured: tilted about the face's middle and lifted.
void correct_support(const SupportMeasurement& measured, double gain, belief::Support& support);

}  // namespace prescene::filter
