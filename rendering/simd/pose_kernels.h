// SPDX-License-Identifier: Apache-2.0
// What is compiled for each instruction set.
#pragma once

#include "pose_tile.h"
#include "prescene/rendering/camera_equations.h"
#include "prescene/rendering/likelihood_batch.h"
#include "prescene/rendering/pixel_classes.h"

namespace prescene::rendering {

/// Images are read in blocks of this many pixels, which end within the image: none may be narrower.
inline constexpr int kBlock = 16;

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

void sum_equations(const FrameTerms& frame, const PoseProjection& seen, const PoseTile& tile,
                   const LineariseOptions& options, CameraEquations* equations);

}  // namespace prescene::rendering
