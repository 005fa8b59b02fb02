// SPDX-License-Identifier: Apache-2.0
// From a mesh and a pose to the nearest face at each pixel: vertices in lanes, then faces in lanes, then each face's
// pixels. The operations are those of the reference backend's ObjectRaster, one by one.
#if defined(PRESCENE_RENDERING_POSE_RASTER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_RENDERING_POSE_RASTER_INL_H_
#undef PRESCENE_RENDERING_POSE_RASTER_INL_H_
#else
#define PRESCENE_RENDERING_POSE_RASTER_INL_H_
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

HWY_INLINE void project_vertices(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  const DF d;
  const DI di;
  const MeshLanes& lanes = mesh.lanes;
  I low_x = set(std::numeric_limits<std::int32_t>::max()), low_y = low_x;
  I high_x = hn::Neg(low_x), high_y = high_x;
  F least = set(std::numeric_limits<float>::max()), most = hn::Zero(d);
  for (std::size_t i = 0; i < lanes.x.size(); i += hn::Lanes(d)) {
    const F x = hn::LoadU(d, lanes.x.data() + i);
    const F y = hn::LoadU(d, lanes.y.data() + i);
    const F z = hn::LoadU(d, lanes.z.data() + i);
    const F x_C = hn::Add(rotated(seen, 0, x, y, z), set(seen.translation[0]));
    const F y_C = hn::Add(rotated(seen, 1, x, y, z), set(seen.translation[1]));
    const F z_C = hn::Add(rotated(seen, 2, x, y, z), set(seen.translation[2]));
    const F inverse_depth = hn::Div(set(1.0f), z_C);
    const I u = snapped_lanes(hn::Add(hn::Mul(hn::Mul(set(seen.fx), x_C), inverse_depth), set(seen.cx)));
    const I v = snapped_lanes(hn::Add(hn::Mul(hn::Mul(set(seen.fy), y_C), inverse_depth), set(seen.cy)));
    least = hn::Min(least, inverse_depth);
    most = hn::Max(most, inverse_depth);
    hn::StoreU(u, di, tile->screen_x.data() + i);
    hn::StoreU(v, di, tile->screen_y.data() + i);
    low_x = hn::Min(low_x, u);
    high_x = hn::Max(high_x, u);
    low_y = hn::Min(low_y, v);
    high_y = hn::Max(high_y, v);
  }
  const ScreenPoint low{hn::GetLane(hn::MinOfLanes(di, low_x)), hn::GetLane(hn::MinOfLanes(di, low_y))};
  const ScreenPoint high{hn::GetLane(hn::MaxOfLanes(di, high_x)), hn::GetLane(hn::MaxOfLanes(di, high_y))};
  tile->rect = pixels_between(low, high, {0, 0, seen.width - 1, seen.height - 1});
  tile->least_inverse_depth = hn::GetLane(hn::MinOfLanes(d, least));
  tile->most_inverse_depth = hn::GetLane(hn::MaxOfLanes(d, most));
  constexpr std::int32_t kMost = 65535;
  tile->packed = high.x - low.x <= kMost && high.y - low.y <= kMost;
  tile->packed_from = low;
  if (!tile->packed) return;
  for (std::size_t i = 0; i < lanes.x.size(); i += hn::Lanes(d)) {
    const I u = hn::Sub(hn::LoadU(di, tile->screen_x.data() + i), set(low.x));
    const I v = hn::Sub(hn::LoadU(di, tile->screen_y.data() + i), set(low.y));
    hn::StoreU(hn::Or(u, hn::ShiftLeft<16>(v)), di, tile->screen.data() + i);
  }
}

/// Lists the faces that are turned to the camera; those of a mesh that is not closed are all turned.
HWY_INLINE void turn_faces(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  const DF d;
  const DI di;
  const MeshLanes& lanes = mesh.lanes;
  const F zero = hn::Zero(d);
  std::size_t count = 0;
  for (std::size_t i = 0; i < lanes.a.size(); i += hn::Lanes(d)) {
    const F x = hn::LoadU(d, lanes.normal_x.data() + i);
    const F y = hn::LoadU(d, lanes.normal_y.data() + i);
    const F z = hn::LoadU(d, lanes.normal_z.data() + i);
    F distance = hn::Add(hn::Add(hn::Mul(x, set(seen.from_camera_O[0])), hn::Mul(y, set(seen.from_camera_O[1]))),
                         hn::Mul(z, set(seen.from_camera_O[2])));
    distance = hn::Add(distance, hn::LoadU(d, lanes.offset.data() + i));
    const auto faces_us = mesh.closed ? hn::Lt(distance, zero) : hn::Ne(distance, zero);
    if (hn::AllFalse(d, faces_us)) continue;
    const auto behind = hn::Gt(distance, zero);
    const auto turned = [&](int row) HWY_ATTR {
      const F normal = rotated(seen, row, x, y, z);
      return hn::IfThenElse(behind, hn::Neg(normal), normal);
    };
    store_chosen(turned(0), faces_us, d, tile->normal_x.data() + count);
    store_chosen(turned(1), faces_us, d, tile->normal_y.data() + count);
    store_chosen(turned(2), faces_us, d, tile->normal_z.data() + count);
    store_chosen(hn::Neg(hn::Abs(distance)), faces_us, d, tile->distance.data() + count);
    const auto chosen = hn::RebindMask(di, faces_us);
    store_chosen(hn::LoadU(di, lanes.a.data() + i), chosen, di, tile->a.data() + count);
    store_chosen(hn::LoadU(di, lanes.b.data() + i), chosen, di, tile->b.data() + count);
    store_chosen(hn::LoadU(di, lanes.c.data() + i), chosen, di, tile->c.data() + count);
    count += hn::CountTrue(d, faces_us);
  }
  tile->faces = count;
}

/// 1/z over the image of faces in lanes: a plane, kept within the object's depths.
struct FaceDepths {
  F at_centre, along_x, along_y, least, most;

  HWY_INLINE F at(const PoseProjection& seen, F x, F y) const {
    const F linear = hn::Add(hn::Add(at_centre, hn::Mul(along_x, hn::Sub(x, set(seen.cx)))),
                             hn::Mul(along_y, hn::Sub(y, set(seen.cy))));
    return hn::Max(least, hn::Min(most, linear));
  }
};

/// A side of faces in lanes: what it is at a pixel, >= 0 inside of it.
struct Side {
  I value, per_x, per_y;
};

/// Of the line from p to q, at pixel (x, y): exact as long as all are within 2^14.
HWY_INLINE Side side_of(I px, I py, I qx, I qy, I x, I y) {
  const I dx = hn::Sub(qx, px);
  const I dy = hn::Sub(qy, py);
  const I zero = hn::Zero(DI());
  const auto owns_line = hn::Or(hn::Lt(dy, zero), hn::And(hn::Eq(dy, zero), hn::Gt(dx, zero)));
  const I value = hn::Sub(hn::Mul(dx, hn::Sub(hn::ShiftLeft<8>(y), py)), hn::Mul(dy, hn::Sub(hn::ShiftLeft<8>(x), px)));
  return {hn::Add(value, hn::IfThenElse(owns_line, zero, set(-1))), hn::Neg(hn::ShiftLeft<8>(dy)),
          hn::ShiftLeft<8>(dx)};
}

/// Draws what of one face is in the lanes of a row.
HWY_INLINE void draw_row(hn::Mask<DF> inside, F inverse_depth, std::int32_t face, float* depths, std::int32_t* faces) {
  const DF d;
  const DI di;
  const F old_depth = hn::LoadU(d, depths);
  const I old_face = hn::LoadU(di, faces);
  // Of equal depths the first face counts, in whatever order they are drawn.
  const auto before = hn::RebindMask(d, hn::Lt(set(face), old_face));
  const auto nearer = hn::Or(hn::Gt(inverse_depth, old_depth), hn::And(hn::Eq(inverse_depth, old_depth), before));
  const auto drawn = hn::And(inside, nearer);
  hn::BlendedStore(inverse_depth, drawn, d, depths);
  hn::BlendedStore(set(face), hn::RebindMask(di, drawn), di, faces);
}

HWY_INLINE void draw_pixel(float inverse_depth, std::int32_t face, float* depth, std::int32_t* faces) {
  if (inverse_depth < *depth || (inverse_depth == *depth && face >= *faces)) return;
  *depth = inverse_depth;
  *faces = face;
}

/// Draws faces, kBlock or fewer at a time.
class FaceDrawer {
 public:
  FaceDrawer(const PoseProjection& seen, PoseTile* tile) : seen_(seen), tile_(*tile) {}

  template <bool kPacked>
  HWY_INLINE void draw(std::size_t first) {
    const DF d;
    const DI di;
    const auto there = hn::FirstN(di, tile_.faces - first);
    const auto corners = [&](const std::vector<std::int32_t>& vertices) HWY_ATTR {
      return place_of<kPacked>(hn::IfThenElseZero(there, hn::LoadU(di, vertices.data() + first)));
    };
    const Places a = corners(tile_.a);
    Places b = corners(tile_.b);
    Places c = corners(tile_.c);
    const I low_x = hn::Min(a.x, hn::Min(b.x, c.x)), high_x = hn::Max(a.x, hn::Max(b.x, c.x));
    const I low_y = hn::Min(a.y, hn::Min(b.y, c.y)), high_y = hn::Max(a.y, hn::Max(b.y, c.y));
    const I up = set(kSubpixels - 1);
    const I x_first = hn::Max(set(tile_.rect.x_first), hn::ShiftRight<8>(hn::Add(low_x, up)));
    const I y_first = hn::Max(set(tile_.rect.y_first), hn::ShiftRight<8>(hn::Add(low_y, up)));
    const I x_last = hn::Min(set(tile_.rect.x_last), hn::ShiftRight<8>(high_x));
    const I y_last = hn::Min(set(tile_.rect.y_last), hn::ShiftRight<8>(high_y));
    auto seen = hn::And(there, hn::And(not_above(x_first, x_last), not_above(y_first, y_last)));
    if (hn::AllFalse(di, seen)) return;

    const I extent = hn::Max(hn::Sub(high_x, low_x), hn::Sub(high_y, low_y));
    const auto wide = hn::And(seen, hn::Gt(extent, set(kLane * kSubpixels)));
    seen = hn::AndNot(wide, seen);
    const I area =
        hn::Sub(hn::Mul(hn::Sub(b.x, a.x), hn::Sub(c.y, a.y)), hn::Mul(hn::Sub(b.y, a.y), hn::Sub(c.x, a.x)));
    seen = hn::And(seen, hn::Ne(area, hn::Zero(di)));
    const auto swap = hn::Lt(area, hn::Zero(di));
    const auto exchange = [&](I& p, I& q) HWY_ATTR {
      const I kept = p;
      p = hn::IfThenElse(swap, q, p);
      q = hn::IfThenElse(swap, kept, q);
    };
    exchange(b.x, c.x);
    exchange(b.y, c.y);

    const F scale = hn::Div(set(1.0f), hn::LoadU(d, tile_.distance.data() + first));
    const FaceDepths depths = {
        hn::Mul(hn::LoadU(d, tile_.normal_z.data() + first), scale),
        hn::Mul(hn::Mul(hn::LoadU(d, tile_.normal_x.data() + first), set(seen_.inverse_fx)), scale),
        hn::Mul(hn::Mul(hn::LoadU(d, tile_.normal_y.data() + first), set(seen_.inverse_fy)), scale),
        set(tile_.least_inverse_depth), set(tile_.most_inverse_depth)};
    if (!hn::AllFalse(di, wide)) draw_wide(first, wide, depths);
    if (hn::AllFalse(di, seen)) return;

    Side ab = side_of(a.x, a.y, b.x, b.y, x_first, y_first);
    Side bc = side_of(b.x, b.y, c.x, c.y, x_first, y_first);
    Side ca = side_of(c.x, c.y, a.x, a.y, x_first, y_first);
    const I columns = hn::IfThenElseZero(seen, hn::Sub(x_last, x_first));
    const I rows = hn::IfThenElseZero(seen, hn::Sub(y_last, y_first));
    const std::int32_t most_columns = hn::GetLane(hn::MaxOfLanes(di, columns));
    const std::int32_t most_rows = hn::GetLane(hn::MaxOfLanes(di, rows));
    const I face = hn::Iota(di, static_cast<std::int32_t>(first));
    const auto stride = static_cast<std::int32_t>(tile_.stride());
    I row_start = hn::Add(hn::Mul(y_first, set(stride)), x_first);
    float* const depth_of = tile_.inverse_depth(0);
    std::int32_t* const face_of = tile_.face(0);
    HWY_ALIGN std::int32_t places[2 * kBlock];
    HWY_ALIGN std::int32_t drawn[2 * kBlock];
    HWY_ALIGN float nearness[2 * kBlock];
    for (std::int32_t row = 0; row <= most_rows; ++row) {
      const auto in_rows = hn::And(seen, not_above(set(row), rows));
      const F y = hn::ConvertTo(d, hn::Add(y_first, set(row)));
      I at_ab = ab.value, at_bc = bc.value, at_ca = ca.value;
      for (std::int32_t column = 0; column <= most_columns; ++column) {
        const auto outside = hn::Lt(hn::Or(at_ab, hn::Or(at_bc, at_ca)), hn::Zero(di));
        const auto inside = hn::AndNot(outside, hn::And(in_rows, not_above(set(column), columns)));
        if (!hn::AllFalse(di, inside)) {
          const F x = hn::ConvertTo(d, hn::Add(x_first, set(column)));
          const std::size_t count = hn::CountTrue(di, inside);
          store_chosen(hn::Add(row_start, set(column)), inside, di, places);
          store_chosen(face, inside, di, drawn);
          store_chosen(depths.at(seen_, x, y), hn::RebindMask(d, inside), d, nearness);
          for (std::size_t k = 0; k < count; ++k)
            draw_pixel(nearness[k], drawn[k], depth_of + places[k], face_of + places[k]);
        }
        at_ab = hn::Add(at_ab, ab.per_x);
        at_bc = hn::Add(at_bc, bc.per_x);
        at_ca = hn::Add(at_ca, ca.per_x);
      }
      ab.value = hn::Add(ab.value, ab.per_y);
      bc.value = hn::Add(bc.value, bc.per_y);
      ca.value = hn::Add(ca.value, ca.per_y);
      row_start = hn::Add(row_start, set(stride));
    }
  }

 private:
  // Pixels: faces that are wider or higher are drawn one by one, their pixels in lanes.
  static constexpr std::int32_t kLane = 6;
  // The same with numbers that 32 bits hold.
  static constexpr std::int32_t kExact = 60;

  struct Places {
    I x, y;
  };
  template <bool kPacked>
  HWY_INLINE Places place_of(I vertices) const {
    const DI di;
    if constexpr (!kPacked)
      return {hn::GatherIndex(di, tile_.screen_x.data(), vertices),
              hn::GatherIndex(di, tile_.screen_y.data(), vertices)};
    const I both = hn::GatherIndex(di, tile_.screen.data(), vertices);
    const auto unsigned_both = hn::BitCast(hn::RebindToUnsigned<DI>(), both);
    return {hn::Add(hn::And(both, set(0xffff)), set(tile_.packed_from.x)),
            hn::Add(hn::BitCast(di, hn::ShiftRight<16>(unsigned_both)), set(tile_.packed_from.y))};
  }

  void draw_wide(std::size_t first, hn::Mask<DI> wide, const FaceDepths& depths) {
    const DF d;
    const DI di;
    HWY_ALIGN float at_centre[kBlock], along_x[kBlock], along_y[kBlock];
    HWY_ALIGN std::int32_t chosen[2 * kBlock];
    hn::Store(depths.at_centre, d, at_centre);
    hn::Store(depths.along_x, d, along_x);
    hn::Store(depths.along_y, d, along_y);
    const std::size_t count = hn::CountTrue(di, wide);
    store_chosen(hn::Iota(di, 0), wide, di, chosen);
    for (std::size_t k = 0; k < count; ++k) {
      const auto lane = static_cast<std::size_t>(chosen[k]);
      draw_one(first + lane, {set(at_centre[lane]), set(along_x[lane]), set(along_y[lane]), depths.least, depths.most});
    }
  }

  void draw_one(std::size_t index, const FaceDepths& depths) {
    const auto corner = [&](const std::vector<std::int32_t>& corners) {
      const auto vertex = static_cast<std::size_t>(corners[index]);
      return ScreenPoint{tile_.screen_x[vertex], tile_.screen_y[vertex]};
    };
    const ScreenPoint a = corner(tile_.a);
    ScreenPoint b = corner(tile_.b);
    ScreenPoint c = corner(tile_.c);
    const PixelRect box = bounding_pixels(a, b, c, tile_.rect);
    const std::int64_t area = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
    if (area == 0) return;
    if (area < 0) std::swap(b, c);
    const auto face = static_cast<std::int32_t>(index);
    const std::int32_t extent = std::max(std::max({a.x, b.x, c.x}) - std::min({a.x, b.x, c.x}),
                                         std::max({a.y, b.y, c.y}) - std::min({a.y, b.y, c.y}));
    if (extent > kExact * kSubpixels) return draw_huge(face, a, b, c, box, depths);
    const DI di;
    const auto lanes = static_cast<std::int32_t>(hn::Lanes(di));
    const I ramp = hn::Iota(di, 0);
    const auto side = [&](ScreenPoint p, ScreenPoint q) HWY_ATTR {
      Side s = side_of(set(p.x), set(p.y), set(q.x), set(q.y), set(box.x_first), set(box.y_first));
      s.value = hn::Add(s.value, hn::Mul(s.per_x, ramp));
      s.per_x = hn::Mul(s.per_x, set(lanes));
      return s;
    };
    Side ab = side(a, b), bc = side(b, c), ca = side(c, a);
    for (int y = box.y_first; y <= box.y_last; ++y) {
      I at_ab = ab.value, at_bc = bc.value, at_ca = ca.value;
      for (int x = box.x_first; x <= box.x_last; x += lanes) {
        const auto outside = hn::Lt(hn::Or(at_ab, hn::Or(at_bc, at_ca)), hn::Zero(di));
        const auto inside = hn::AndNot(outside, hn::FirstN(di, static_cast<std::size_t>(box.x_last - x + 1)));
        if (!hn::AllFalse(di, inside)) draw_block(inside, x, y, face, depths);
        at_ab = hn::Add(at_ab, ab.per_x);
        at_bc = hn::Add(at_bc, bc.per_x);
        at_ca = hn::Add(at_ca, ca.per_x);
      }
      ab.value = hn::Add(ab.value, ab.per_y);
      bc.value = hn::Add(bc.value, bc.per_y);
      ca.value = hn::Add(ca.value, ca.per_y);
    }
  }

  HWY_INLINE void draw_block(hn::Mask<DI> inside, int x, int y, std::int32_t face, const FaceDepths& depths) {
    const DF d;
    const F along = hn::Add(set(static_cast<float>(x)), hn::Iota(d, 0.0f));
    draw_row(hn::RebindMask(d, inside), depths.at(seen_, along, set(static_cast<float>(y))), face,
             tile_.inverse_depth(y) + x, tile_.face(y) + x);
  }

  void draw_huge(std::int32_t face, ScreenPoint a, ScreenPoint b, ScreenPoint c, const PixelRect& box,
                 const FaceDepths& depths) {
    const DI di;
    for_each_covered_pixel(a, b, c, box, [&](int x, int y) { draw_block(hn::FirstN(di, 1), x, y, face, depths); });
  }

  const PoseProjection& seen_;
  PoseTile& tile_;
};

void draw_kernel(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  project_vertices(mesh, seen, tile);
  tile->faces = 0;
  if (tile->rect.empty()) return;
  tile->clear();
  turn_faces(mesh, seen, tile);
  FaceDrawer drawer(seen, tile);
  for (std::size_t first = 0; first < tile->faces; first += hn::Lanes(DF())) {
    if (tile->packed) {
      drawer.draw<true>(first);
    } else {
      drawer.draw<false>(first);
    }
  }
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
