// SPDX-License-Identifier: Apache-2.0
// The Gauss-Newton equations of a drawn hypothesis, in lanes: the operations on a pixel are those of the reference
// backend's EquationSum. Lanes are summed in single precision over a few rows, then in double.
#if defined(PRESCENE_RENDERING_POSE_EQUATIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef PRESCENE_RENDERING_POSE_EQUATIONS_INL_H_
#undef PRESCENE_RENDERING_POSE_EQUATIONS_INL_H_
#else
#define PRESCENE_RENDERING_POSE_EQUATIONS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "pose_evidence-inl.h"
#include "pose_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::rendering::HWY_NAMESPACE {

class EquationLanes {
 public:
  EquationLanes(const FrameTerms& frame, const MeshClusters& mesh, const PoseProjection& seen,
                const LineariseOptions& options)
      : mesh_(mesh),
        seen_(seen),
        two_over_gate_(static_cast<float>(2.0 / options.gate)),
        min_cosine_(static_cast<float>(options.min_cosine)),
        precision_(HitPrecision(frame.model.options()).scale) {}

  HWY_INLINE void add(int y, std::size_t place, const Pixels& p) {
    const DF d;
    if (y / kRows != rows_) {
      flush();
      rows_ = y / kRows;
    }
    const F zero = hn::Zero(d);
    const M used = hn::AndNot(hn::Or(hn::Eq(p.measured, zero), hn::Lt(p.cosine, set(min_cosine_))), p.covered);
    if (hn::AllFalse(d, used)) return;
    pixels_ += hn::CountTrue(d, used);
    const F residual = hn::Mul(p.slope, hn::Sub(p.measured, p.depth));
    const F scaled = hn::Mul(set(two_over_gate_), residual);
    const F root = hn::Div(set(1.0f), hn::Add(set(1.0f), hn::Mul(scaled, scaled)));
    const F robust = hn::IfThenElseZero(used, hn::Mul(root, root));
    const F precision = hn::Mul(hn::Mul(set(precision_), p.inverse_depth), p.inverse_depth);
    const F weight = hn::IfThenElseZero(used, hn::Mul(hn::Mul(robust, precision), precision));
    const F zeroed = hn::IfThenElseZero(used, residual);
    F n[3];
    normal_at(p.face, n);
    const F depth = hn::IfThenElseZero(used, p.depth);
    const F to[3] = {hn::Sub(hn::Mul(p.ray_x, depth), set(seen_.translation[0])),
                     hn::Sub(hn::Mul(p.ray_y, depth), set(seen_.translation[1])),
                     hn::Sub(depth, set(seen_.translation[2]))};
    const F row[6] = {hn::Sub(hn::Mul(to[1], n[2]), hn::Mul(to[2], n[1])),
                      hn::Sub(hn::Mul(to[2], n[0]), hn::Mul(to[0], n[2])),
                      hn::Sub(hn::Mul(to[0], n[1]), hn::Mul(to[1], n[0])),
                      n[0],
                      n[1],
                      n[2]};
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const F weighted = hn::Mul(weight, row[i]);
      for (std::size_t j = i; j < 6; ++j) add_to(k++, place, hn::Mul(weighted, row[j]));
      add_to(kRight + i, place, hn::Mul(weighted, zeroed));
    }
    add_to(kWeight, place, robust);
    add_to(kSquares, place, hn::Mul(hn::Mul(robust, zeroed), zeroed));
  }

  void finish(CameraEquations* equations) {
    flush();
    for (std::size_t k = 0; k < kRight; ++k) equations->H[k] = totals_[k];
    for (std::size_t i = 0; i < 6; ++i) equations->g[i] = totals_[kRight + i];
    equations->pixels = static_cast<int>(pixels_);
    equations->weight = totals_[kWeight];
    equations->squares = totals_[kSquares];
  }

 private:
  static constexpr int kRows = 4;            // that are summed in single precision
  static constexpr std::size_t kRight = 21;  // of the equations' right side, after H
  static constexpr std::size_t kWeight = 27;
  static constexpr std::size_t kSquares = 28;
  static constexpr std::size_t kSums = 29;

  /// Of faces turned to the camera, C.
  HWY_INLINE void normal_at(I face, F (&n)[3]) const {
    const DF d;
    const F x = hn::GatherIndex(d, mesh_.normal_x.data(), face);
    const F y = hn::GatherIndex(d, mesh_.normal_y.data(), face);
    const F z = hn::GatherIndex(d, mesh_.normal_z.data(), face);
    F distance = hn::Add(hn::Add(hn::Mul(x, set(seen_.from_camera_O[0])), hn::Mul(y, set(seen_.from_camera_O[1]))),
                         hn::Mul(z, set(seen_.from_camera_O[2])));
    distance = hn::Add(distance, hn::GatherIndex(d, mesh_.offset.data(), face));
    const auto behind = hn::Gt(distance, hn::Zero(d));
    for (int row = 0; row < 3; ++row) {
      const F normal = rotated(seen_, row, x, y, z);
      n[row] = hn::IfThenElse(behind, hn::Neg(normal), normal);
    }
  }
  HWY_INLINE void add_to(std::size_t sum, std::size_t place, F value) {
    const DF d;
    float* lanes = sums_[sum] + place;
    hn::Store(hn::Add(hn::Load(d, lanes), value), d, lanes);
  }
  void flush() {
    for (std::size_t k = 0; k < kSums; ++k) {
      double sum = 0.0;
      for (float& lane : sums_[k]) {
        sum += static_cast<double>(lane);
        lane = 0.0f;
      }
      totals_[k] += sum;
    }
  }

  const MeshClusters& mesh_;
  const PoseProjection& seen_;
  float two_over_gate_, min_cosine_;
  float precision_;  // of a frontal hit at 1 m
  HWY_ALIGN float sums_[kSums][kBlock] = {};
  double totals_[kSums] = {};
  int rows_ = 0;
  std::size_t pixels_ = 0;
};

void equations_kernel(const FrameTerms& frame, const RenderMesh& mesh, const PoseProjection& seen, const PoseTile& tile,
                      const LineariseOptions& options, CameraEquations* equations) {
  EquationLanes lanes(frame, mesh.clusters, seen, options);
  for_each_block(frame, seen, tile,
                 [&](int y, std::size_t place, const Pixels& p) HWY_ATTR { lanes.add(y, place, p); });
  lanes.finish(equations);
}

}  // namespace prescene::rendering::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
