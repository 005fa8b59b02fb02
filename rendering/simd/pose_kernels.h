// SPDX-License-Identifier: Apache-2.0
// What is compiled for each instruction set.
#pragma once

#include <array>
#include <cstdint>

#include "pose_tile.h"
#include "prescene/rendering/sensor/camera_equations.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/pixel_classes.h"

namespace prescene::rendering {

/// Images are read in blocks of this many pixels, which end within the image: none may be narrower.
inline constexpr int kBlock = 16;

/// For each set of 8 lanes (a bit each) the numbers of its lanes in order, then of the others, 4 bits each.
inline constexpr std::array<std::uint32_t, 256> kPackedLanes = [] {
  std::array<std::uint32_t, 256> packed{};
  for (std::uint32_t set = 0; set < 256; ++set) {
    std::uint32_t place = 0;
    for (const bool chosen : {true, false})
      for (std::uint32_t lane = 0; lane < 8; ++lane)
        if (((set >> lane & 1u) != 0) == chosen) packed[set] |= lane << (4 * place++);
  }
  return packed;
}();

/// What evidence is summed with.
struct EvidenceTerms {
  const FrameTerms* frame = nullptr;
  const PixelClasses* classes = nullptr;
  const geometry::Image<float>* color_ratio = nullptr;  ///< Null: no colour.
};

/// Draws a mesh that the near plane leaves whole: tile->rect and what lies in it.
void draw(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile);

/// Sums over the pixels that are drawn; counts and log ratios of `evidence`, not `tempered`.
void sum_evidence(const EvidenceTerms& terms, const PoseProjection& seen, const PoseTile& tile, PoseEvidence* evidence);

/// Of the mesh that is drawn.
void sum_equations(const FrameTerms& frame, const RenderMesh& mesh, const PoseProjection& seen, const PoseTile& tile,
                   const LineariseOptions& options, CameraEquations* equations);

}  // namespace prescene::rendering
