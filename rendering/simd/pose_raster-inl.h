// SPDX-License-Identifier: Apache-2.0
// From a mesh and a pose to the nearest face at each pixel: clusters and their vertices (pose_vertices-inl.h), then
// faces in lanes, then each face's pixels. The operations are those of the reference backend's ObjectRaster, one by
// one.
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
#include "pose_vertices-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::rendering::HWY_NAMESPACE {

/// One coordinate of a cluster's vertices, looked up by their numbers.
class ClusterTable {
 public:
  explicit HWY_INLINE ClusterTable(const std::int32_t* values) : values_(values) {
    if constexpr (kInRegisters)
      for (std::size_t r = 0; r < kRegisters; ++r) part_[r] = hn::LoadU(DI(), values + r * kLanes);
  }
  HWY_INLINE I at(I numbers) const {
    const DI di;
    if constexpr (!kInRegisters) return hn::GatherIndex(di, values_, numbers);
#if HWY_TARGET == HWY_AVX3
    if constexpr (kRegisters == 2) return I{_mm512_permutex2var_epi32(part_[0].raw, numbers.raw, part_[1].raw)};
#endif
    const auto places = hn::IndicesFromVec(di, hn::And(numbers, set(static_cast<std::int32_t>(kLanes - 1))));
    I found = hn::TableLookupLanes(part_[0], places);
    for (std::size_t r = 1; r < kRegisters; ++r)
      found = hn::IfThenElse(hn::Gt(numbers, set(static_cast<std::int32_t>(r * kLanes - 1))),
                             hn::TableLookupLanes(part_[r], places), found);
    return found;
  }

 private:
  static constexpr std::size_t kLanes = hn::MaxLanes(DI());
  static constexpr std::size_t kRegisters = MeshClusters::kSize / kLanes;
  static constexpr bool kInRegisters = kRegisters <= 4;

  const std::int32_t* values_;
  I part_[kInRegisters ? kRegisters : 1];
};

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

/// Draws clusters of faces.
class FaceDrawer {
 public:
  FaceDrawer(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile)
      : mesh_(mesh.clusters), closed_(mesh.closed), seen_(seen), tile_(*tile) {}

  void draw_all() {
    for (std::size_t n = 0; n < tile_.listed; ++n) draw(n);
    draw_waiting();
  }

 private:
  // Pixels: faces that are wider or higher are drawn one by one, their pixels in lanes.
  static constexpr std::int32_t kLane = 6;
  // The same with numbers that 32 bits hold.
  static constexpr std::int32_t kExact = 60;
  static constexpr std::size_t kMostWaiting = 256;

  struct Places {
    I x, y;
  };

  /// The n-th of those listed.
  HWY_INLINE void draw(std::size_t n) {
    const auto cluster = static_cast<std::size_t>(tile_.cluster[n]);
    const ClusterTable x(tile_.screen_x.data() + n * MeshClusters::kSize);
    const ClusterTable y(tile_.screen_y.data() + n * MeshClusters::kSize);
    const std::size_t first = cluster * MeshClusters::kSize;
    for (std::size_t k = 0; k < mesh_.triangles[cluster]; k += hn::Lanes(DF())) draw_faces(first + k, x, y);
  }

  HWY_INLINE void draw_faces(std::size_t first, const ClusterTable& screen_x, const ClusterTable& screen_y) {
    const DF d;
    const DI di;
    const F zero = hn::Zero(d);
    const F normal_x = hn::LoadU(d, mesh_.normal_x.data() + first);
    const F normal_y = hn::LoadU(d, mesh_.normal_y.data() + first);
    const F normal_z = hn::LoadU(d, mesh_.normal_z.data() + first);
    F distance =
        hn::Add(hn::Add(hn::Mul(normal_x, set(seen_.from_camera_O[0])), hn::Mul(normal_y, set(seen_.from_camera_O[1]))),
                hn::Mul(normal_z, set(seen_.from_camera_O[2])));
    distance = hn::Add(distance, hn::LoadU(d, mesh_.offset.data() + first));
    // Those of a mesh that is not closed are all turned to the camera.
    const auto faces_us = hn::RebindMask(di, closed_ ? hn::Lt(distance, zero) : hn::Ne(distance, zero));
    if (hn::AllFalse(di, faces_us)) return;
    const F facing = hn::Neg(hn::Abs(distance));
    hn::StoreU(facing, d, tile_.distance.data() + first);

    const auto corners = [&](const std::vector<std::int32_t>& vertices) HWY_ATTR {
      const I numbers = hn::LoadU(di, vertices.data() + first);
      return Places{screen_x.at(numbers), screen_y.at(numbers)};
    };
    const Places a = corners(mesh_.a);
    Places b = corners(mesh_.b);
    Places c = corners(mesh_.c);
    const I low_x = hn::Min(a.x, hn::Min(b.x, c.x)), high_x = hn::Max(a.x, hn::Max(b.x, c.x));
    const I low_y = hn::Min(a.y, hn::Min(b.y, c.y)), high_y = hn::Max(a.y, hn::Max(b.y, c.y));
    const I up = set(kSubpixels - 1);
    const I x_first = hn::Max(set(tile_.rect.x_first), hn::ShiftRight<8>(hn::Add(low_x, up)));
    const I y_first = hn::Max(set(tile_.rect.y_first), hn::ShiftRight<8>(hn::Add(low_y, up)));
    const I x_last = hn::Min(set(tile_.rect.x_last), hn::ShiftRight<8>(high_x));
    const I y_last = hn::Min(set(tile_.rect.y_last), hn::ShiftRight<8>(high_y));
    auto seen = hn::And(faces_us, hn::And(not_above(x_first, x_last), not_above(y_first, y_last)));
    if (hn::AllFalse(di, seen)) return;

    const I extent = hn::Max(hn::Sub(high_x, low_x), hn::Sub(high_y, low_y));
    const auto wide = hn::And(seen, hn::Gt(extent, set(kLane * kSubpixels)));
    seen = hn::AndNot(wide, seen);
    const I area =
        hn::Sub(hn::Mul(hn::Sub(b.x, a.x), hn::Sub(c.y, a.y)), hn::Mul(hn::Sub(b.y, a.y), hn::Sub(c.x, a.x)));

    const auto behind = hn::Gt(distance, zero);
    const auto turned = [&](int row) HWY_ATTR {
      const F normal = rotated(seen_, row, normal_x, normal_y, normal_z);
      return hn::IfThenElse(behind, hn::Neg(normal), normal);
    };
    const F scale = hn::Div(set(1.0f), facing);
    const FaceDepths depths = {hn::Mul(turned(2), scale), hn::Mul(hn::Mul(turned(0), set(seen_.inverse_fx)), scale),
                               hn::Mul(hn::Mul(turned(1), set(seen_.inverse_fy)), scale),
                               set(tile_.least_inverse_depth), set(tile_.most_inverse_depth)};
    if (!hn::AllFalse(di, wide)) draw_wide(first, wide, a, b, c, depths);
    seen = hn::And(seen, hn::Ne(area, hn::Zero(di)));
    if (hn::AllFalse(di, seen)) return;
    const auto swap = hn::Lt(area, hn::Zero(di));
    const auto exchange = [&](I& p, I& q) HWY_ATTR {
      const I kept = p;
      p = hn::IfThenElse(swap, q, p);
      q = hn::IfThenElse(swap, kept, q);
    };
    exchange(b.x, c.x);
    exchange(b.y, c.y);

    Side ab = side_of(a.x, a.y, b.x, b.y, x_first, y_first);
    Side bc = side_of(b.x, b.y, c.x, c.y, x_first, y_first);
    Side ca = side_of(c.x, c.y, a.x, a.y, x_first, y_first);
    const I zeros = hn::Zero(di);
    // Each lane goes through the pixels of its own box, row by row.
    const I one = set(1);
    const I columns = hn::Sub(x_last, x_first);
    const I pixels = hn::IfThenElseZero(seen, hn::Mul(hn::Add(columns, one), hn::Add(hn::Sub(y_last, y_first), one)));
    const std::int32_t most_pixels = hn::GetLane(hn::MaxOfLanes(di, pixels));
    const I face = hn::Iota(di, static_cast<std::int32_t>(first));
    const I stride = set(static_cast<std::int32_t>(tile_.stride()));
    const auto to_next_row = [&](const Side& side)
                                 HWY_ATTR { return hn::Sub(side.per_y, hn::Mul(columns, side.per_x)); };
    const I next_ab = to_next_row(ab), next_bc = to_next_row(bc), next_ca = to_next_row(ca);
    const I next_place = hn::Sub(stride, columns);
    I place = hn::Add(hn::Mul(y_first, stride), x_first);
    I column = hn::Zero(di);
    const F left = hn::ConvertTo(d, x_first);
    F x = left, y = hn::ConvertTo(d, y_first);
    for (std::int32_t pixel = 0; pixel < most_pixels; ++pixel) {
      const auto outside = hn::Lt(hn::Or(ab.value, hn::Or(bc.value, ca.value)), zeros);
      const auto inside = hn::AndNot(outside, hn::Lt(set(pixel), pixels));
      store_chosen(place, inside, di, places_ + waiting_);
      store_chosen(face, inside, di, drawn_ + waiting_);
      store_chosen(depths.at(seen_, x, y), hn::RebindMask(d, inside), d, nearness_ + waiting_);
      waiting_ += hn::CountTrue(di, inside);
      if (waiting_ > kMostWaiting) draw_waiting();
      const auto ends = hn::Eq(column, columns);
      const auto ends_f = hn::RebindMask(d, ends);
      ab.value = hn::Add(ab.value, hn::IfThenElse(ends, next_ab, ab.per_x));
      bc.value = hn::Add(bc.value, hn::IfThenElse(ends, next_bc, bc.per_x));
      ca.value = hn::Add(ca.value, hn::IfThenElse(ends, next_ca, ca.per_x));
      place = hn::Add(place, hn::IfThenElse(ends, next_place, one));
      column = hn::IfThenZeroElse(ends, hn::Add(column, one));
      x = hn::IfThenElse(ends_f, left, hn::Add(x, set(1.0f)));
      y = hn::Add(y, hn::IfThenElseZero(ends_f, set(1.0f)));
    }
  }

  /// How many there are is hard to foresee for a processor: many at once.
  void draw_waiting() {
    float* const depth_of = tile_.inverse_depth(0);
    std::int32_t* const face_of = tile_.face(0);
    for (std::size_t k = 0; k < waiting_; ++k)
      draw_pixel(nearness_[k], drawn_[k], depth_of + places_[k], face_of + places_[k]);
    waiting_ = 0;
  }

  void draw_wide(std::size_t first, hn::Mask<DI> wide, const Places& a, const Places& b, const Places& c,
                 const FaceDepths& depths) {
    const DF d;
    const DI di;
    HWY_ALIGN float at_centre[kBlock], along_x[kBlock], along_y[kBlock];
    HWY_ALIGN std::int32_t chosen[2 * kBlock], corners[6][kBlock];
    hn::Store(depths.at_centre, d, at_centre);
    hn::Store(depths.along_x, d, along_x);
    hn::Store(depths.along_y, d, along_y);
    std::size_t row = 0;
    for (const Places* places : {&a, &b, &c}) {
      hn::Store(places->x, di, corners[row++]);
      hn::Store(places->y, di, corners[row++]);
    }
    const std::size_t count = hn::CountTrue(di, wide);
    store_chosen(hn::Iota(di, 0), wide, di, chosen);
    for (std::size_t k = 0; k < count; ++k) {
      const auto lane = static_cast<std::size_t>(chosen[k]);
      draw_one(static_cast<std::int32_t>(first + lane), {corners[0][lane], corners[1][lane]},
               {corners[2][lane], corners[3][lane]}, {corners[4][lane], corners[5][lane]},
               {set(at_centre[lane]), set(along_x[lane]), set(along_y[lane]), depths.least, depths.most});
    }
  }

  void draw_one(std::int32_t face, ScreenPoint a, ScreenPoint b, ScreenPoint c, const FaceDepths& depths) {
    const PixelRect box = bounding_pixels(a, b, c, tile_.rect);
    const std::int64_t area = std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
    if (area == 0) return;
    if (area < 0) std::swap(b, c);
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

  const MeshClusters& mesh_;
  bool closed_;
  const PoseProjection& seen_;
  PoseTile& tile_;
  // Pixels of small faces that are still to be drawn.
  HWY_ALIGN std::int32_t places_[kMostWaiting + 2 * kBlock];
  HWY_ALIGN std::int32_t drawn_[kMostWaiting + 2 * kBlock];
  HWY_ALIGN float nearness_[kMostWaiting + 2 * kBlock];
  std::size_t waiting_ = 0;
};

void draw_kernel(const RenderMesh& mesh, const PoseProjection& seen, PoseTile* tile) {
  bound_depths(mesh.clusters, seen, tile);
  list_clusters(mesh, seen, tile);
  project_vertices(mesh.clusters, seen, tile);
  if (tile->rect.empty()) return;
  tile->clear();
  FaceDrawer(mesh, seen, tile).draw_all();
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
