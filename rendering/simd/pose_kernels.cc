// SPDX-License-Identifier: Apache-2.0
#include "pose_kernels.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pose_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include "pose_equations-inl.h"
#include "pose_evidence-inl.h"
#include "pose_raster-inl.h"

#if HWY_ONCE
namespace prescene::rendering {

HWY_EXPORT(draw_kernel);
HWY_EXPORT(evidence_kernel);
HWY_EXPORT(equations_kernel);

void draw(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  HWY_DYNAMIC_DISPATCH(draw_kernel)(mesh, seen, tile);
}

void sum_evidence(const EvidenceTerms& terms, const PoseProjection& seen, const PoseTile& tile,
                  PoseEvidence* evidence) {
  HWY_DYNAMIC_DISPATCH(evidence_kernel)(terms, seen, tile, evidence);
}

void sum_equations(const FrameTerms& frame, const RenderMesh& mesh, const PoseProjection& seen, const PoseTile& tile,
                   const LineariseOptions& options, CameraEquations* equations) {
  HWY_DYNAMIC_DISPATCH(equations_kernel)(frame, mesh, seen, tile, options, equations);
}

}  // namespace prescene::rendering
#endif  // HWY_ONCE
