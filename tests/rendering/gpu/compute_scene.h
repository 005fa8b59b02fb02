// SPDX-License-Identifier: Apache-2.0
// A frame, things and poses of them that the tests of the compute backend share.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

/// Depths of two planes with holes and noise, a known surface in front of a part, two colour models, and `count` poses
/// of round, flat, open and fine things, about one in twelve cut by the near plane, behind the camera or out of view.
struct ComputeScene {
  ComputeScene(int width, int count);

  FrameTerms frame;
  std::vector<MeshHandle> meshes;
  std::vector<SurfaceMaterial> materials;
  std::vector<PoseHypothesis> hypotheses;
};

/// The bits of all that was computed.
std::vector<std::uint64_t> bits_of(const std::vector<PoseEvidence>& evidences);
std::vector<std::uint64_t> bits_of(const std::vector<PoseLinearisation>& linearisations);

}  // namespace prescene::rendering
