// SPDX-License-Identifier: Apache-2.0
// From a mesh and a pose to vertices on the screen: which clusters are seen, and their vertices in lanes. What comes
// then is in pose_raster-inl.h.
#if defined(PRESCENE_RENDERING_POSE_VERTICES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_RENDERING_POSE_VERTICES_INL_H_
#undef PRESCENE_RENDERING_POSE_VERTICES_INL_H_
#else
#define PRESCENE_RENDERING_POSE_VERTICES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "pose_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::rendering::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::CappedTag<float, kBlock>;
using DI = hn::RebindToSigned<DF>;
using F = hn::Vec<DF>;
using I = hn::Vec<DI>;

HWY_INLINE F set(float value) { return hn::Set(DF(), value); }
HWY_INLINE I set(std::int32_t value) { return hn::Set(DI(), value); }

/// The lanes of the mask side by side, others behind them.
template <class D, class V>
HWY_INLINE V packed(V values, hn::Mask<D> chosen, [[maybe_unused]] D d) {
#if HWY_TARGET == HWY_AVX2
  // As the library's, but for its table, which compilers copy with each use.
  const DI di;
  HWY_ALIGN std::uint8_t bits[8];
  hn::StoreMaskBits(d, chosen, bits);
  const auto nibbles = hn::Set(hn::RebindToUnsigned<DI>(), kPackedLanes[bits[0]]);
  const auto shifts = hn::BitCast(hn::RebindToUnsigned<DI>(), hn::ShiftLeft<2>(hn::Iota(di, 0)));
  const auto places = hn::And(hn::Shr(nibbles, shifts), hn::Set(hn::RebindToUnsigned<DI>(), 7));
  return hn::TableLookupLanes(values, hn::IndicesFromVec(d, hn::BitCast(di, places)));
#else
  return hn::Compress(values, chosen);
#endif
}

/// Stores the lanes of the mask side by side, and others behind them: a whole vector, since storing a part of one is
/// slow on some processors.
template <class D, class V>
HWY_INLINE void store_chosen(V values, hn::Mask<D> chosen, D d, hn::TFromD<D>* to) {
  hn::StoreU(packed(values, chosen, d), d, to);
}

HWY_INLINE hn::Mask<DI> not_above(I a, I b) { return hn::Not(hn::Gt(a, b)); }

/// Row `row` of the rotation times (x, y, z).
HWY_INLINE F rotated(const PoseProjection& seen, int row, F x, F y, F z) {
  const float* r = seen.rotation + 3 * row;
  return hn::Add(hn::Add(hn::Mul(set(r[0]), x), hn::Mul(set(r[1]), y)), hn::Mul(set(r[2]), z));
}

/// As snapped() of triangle_raster.h.
HWY_INLINE I snapped_lanes(F value) {
  const F end = set(16000.0f * kSubpixels);
  const F whole = set(12582912.0f);
  const F clamped = hn::Min(hn::Max(hn::Mul(value, set(static_cast<float>(kSubpixels))), hn::Neg(end)), end);
  return hn::ConvertTo(DI(), hn::Sub(hn::Add(clamped, whole), whole));
}

/// Bounds of 1/z over all vertices.
HWY_INLINE void bound_depths(const MeshClusters& mesh, const PoseProjection& seen, PoseTile* tile) {
  const DF d;
  F nearest = set(std::numeric_limits<float>::max()), farthest = hn::Zero(d);
  for (std::size_t i = 0; i < mesh.vertex_x.size(); i += hn::Lanes(d)) {
    const F z = hn::Add(rotated(seen, 2, hn::LoadU(d, mesh.vertex_x.data() + i), hn::LoadU(d, mesh.vertex_y.data() + i),
                                hn::LoadU(d, mesh.vertex_z.data() + i)),
                        set(seen.translation[2]));
    nearest = hn::Min(nearest, z);
    farthest = hn::Max(farthest, z);
  }
  tile->most_inverse_depth = 1.0f / hn::GetLane(hn::MinOfLanes(d, nearest));
  tile->least_inverse_depth = 1.0f / hn::GetLane(hn::MaxOfLanes(d, farthest));
}

/// Lists the clusters that may have a face turned to the camera.
HWY_INLINE void list_clusters(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  const DF d;
  const DI di;
  const MeshClusters& clusters = mesh.clusters;
  tile->listed = 0;
  if (!mesh.closed) {
    for (std::size_t i = 0; i < clusters.count; ++i) tile->cluster[tile->listed++] = static_cast<std::int32_t>(i);
    return;
  }
  for (std::size_t i = 0; i < clusters.count; i += hn::Lanes(d)) {
    const auto load = [&](const std::vector<float>& values) HWY_ATTR { return hn::LoadU(d, values.data() + i); };
    const F x = hn::Add(load(clusters.centre_x), set(seen.from_camera_O[0]));
    const F y = hn::Add(load(clusters.centre_y), set(seen.from_camera_O[1]));
    const F z = hn::Add(load(clusters.centre_z), set(seen.from_camera_O[2]));
    const F distance = hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z)));
    const F along = hn::Add(hn::Add(hn::Mul(x, load(clusters.axis_x)), hn::Mul(y, load(clusters.axis_y))),
                            hn::Mul(z, load(clusters.axis_z)));
    // With room for rounding: a face of a cluster that is left out is never turned to the camera.
    const F least = hn::Add(hn::Mul(hn::Add(load(clusters.cutoff), set(1e-3f)), distance),
                            hn::Mul(load(clusters.radius), set(1.001f)));
    const auto there = hn::FirstN(di, clusters.count - i);
    const auto listed = hn::And(there, hn::RebindMask(di, hn::Lt(along, least)));
    const I numbers = hn::Iota(di, static_cast<std::int32_t>(i));
    store_chosen(numbers, listed, di, tile->cluster.data() + tile->listed);
    tile->listed += hn::CountTrue(di, listed);
  }
}

/// Where the vertices of the listed clusters are seen, and their bounding box.
HWY_INLINE void project_vertices(const MeshClusters& mesh, const PoseProjection& seen, PoseTile* tile) {
  const DF d;
  const DI di;
  I low_x = set(std::numeric_limits<std::int32_t>::max()), low_y = low_x;
  I high_x = hn::Neg(low_x), high_y = high_x;
  for (std::size_t n = 0; n < tile->listed; ++n) {
    const std::size_t from = static_cast<std::size_t>(tile->cluster[n]) * MeshClusters::kSize;
    const std::size_t to = n * MeshClusters::kSize;
    for (std::size_t i = 0; i < MeshClusters::kSize; i += hn::Lanes(d)) {
      const F x = hn::LoadU(d, mesh.x.data() + from + i);
      const F y = hn::LoadU(d, mesh.y.data() + from + i);
      const F z = hn::LoadU(d, mesh.z.data() + from + i);
      const F x_C = hn::Add(rotated(seen, 0, x, y, z), set(seen.translation[0]));
      const F y_C = hn::Add(rotated(seen, 1, x, y, z), set(seen.translation[1]));
      const F z_C = hn::Add(rotated(seen, 2, x, y, z), set(seen.translation[2]));
      const F inverse_depth = hn::Div(set(1.0f), z_C);
      const I u = snapped_lanes(hn::Add(hn::Mul(hn::Mul(set(seen.fx), x_C), inverse_depth), set(seen.cx)));
      const I v = snapped_lanes(hn::Add(hn::Mul(hn::Mul(set(seen.fy), y_C), inverse_depth), set(seen.cy)));
      hn::StoreU(u, di, tile->screen_x.data() + to + i);
      hn::StoreU(v, di, tile->screen_y.data() + to + i);
      low_x = hn::Min(low_x, u);
      high_x = hn::Max(high_x, u);
      low_y = hn::Min(low_y, v);
      high_y = hn::Max(high_y, v);
    }
  }
  const ScreenPoint low{hn::GetLane(hn::MinOfLanes(di, low_x)), hn::GetLane(hn::MinOfLanes(di, low_y))};
  const ScreenPoint high{hn::GetLane(hn::MaxOfLanes(di, high_x)), hn::GetLane(hn::MaxOfLanes(di, high_y))};
  tile->rect = pixels_between(low, high, {0, 0, seen.width - 1, seen.height - 1});
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
