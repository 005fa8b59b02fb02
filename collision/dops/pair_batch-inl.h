// SPDX-License-Identifier: Apache-2.0
// Pairs of triangles collected until there are 16 to be tested at once. Included once for each instruction set.
#if defined(PRESCENE_COLLISION_DOPS_PAIR_BATCH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_COLLISION_DOPS_PAIR_BATCH_INL_H_
#undef PRESCENE_COLLISION_DOPS_PAIR_BATCH_INL_H_
#else
#define PRESCENE_COLLISION_DOPS_PAIR_BATCH_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>

#include "prescene/collision/exact_triangles.h"
#include "prescene/collision/mesh.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/transform.h"
#include "prescene/collision/triangle_pairs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {

/// Triangle i of float[9][16] for pair i, put into A's frame.
struct SixteenPlaced {
  const float* rows_B;
  const Transform* X_AB;
  HWY_INLINE Corners<PairTag> operator()(PairTag d, std::size_t first) const {
    return placed(d, *X_AB, load_corners(d, rows_B, 16, first));
  }
};

class PairBatch {
 public:
  PairBatch(const Mesh& a, const Mesh& b, const Transform& X_AB, QueryCounts* counts)
      : mesh_a_(a), mesh_b_(b), X_AB_(X_AB), counts_(counts) {}

  /// Triangles of the two meshes. Returns whether a pair of those collected so far is known to intersect.
  HWY_INLINE bool add(std::uint32_t a, std::uint32_t b) {
    store(mesh_a_, a, corners_a_.data());
    store(mesh_b_, b, corners_b_.data());
    a_[count_] = a;
    b_[count_] = b;
    return ++count_ == 16 && flush();
  }

  /// Tests those that are left.
  bool flush() {
    if (count_ == 0) return false;
    const PairVerdict verdict =
        test_16(SixteenOf{corners_a_.data()}, SixteenPlaced{corners_b_.data(), &X_AB_}, (1U << count_) - 1U);
    if (counts_ != nullptr) {
      counts_->triangle_tests += count_;
      counts_->exact_tests += static_cast<std::uint64_t>(std::popcount(verdict.unsure));
    }
    count_ = 0;
    if (verdict.hit != 0) return true;
    for (std::uint32_t rest = verdict.unsure; rest != 0; rest &= rest - 1) {
      const auto pair = static_cast<std::size_t>(std::countr_zero(rest));
      Triangle b = mesh_b_.corners(b_[pair]);
      for (Vector3f& corner : b) corner = X_AB_ * corner;
      if (triangles_intersect(mesh_a_.corners(a_[pair]), b)) return true;
    }
    return false;
  }

 private:
  HWY_INLINE void store(const Mesh& mesh, std::uint32_t triangle, float* rows) const {
    const TriangleIndices& indices = mesh.triangles()[triangle];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const float* p = mesh.vertices()[indices[corner]].data();
      float* to = rows + 48 * corner + count_;
      to[0] = p[0];
      to[16] = p[1];
      to[32] = p[2];
    }
  }

  const Mesh& mesh_a_;
  const Mesh& mesh_b_;
  const Transform& X_AB_;
  QueryCounts* counts_;
  std::size_t count_ = 0;
  // Unused columns hold whatever they held; a verdict on them is not asked for.
  alignas(64) std::array<float, 144> corners_a_ = {};
  alignas(64) std::array<float, 144> corners_b_ = {};
  std::array<std::uint32_t, 16> a_ = {};
  std::array<std::uint32_t, 16> b_ = {};
};

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
