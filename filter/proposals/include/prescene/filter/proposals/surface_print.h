// SPDX-License-Identifier: Apache-2.0
// What is printed on a model: the brightness of its surface, and how well a frame's brightness agrees with it at a
// pose. It tells what depth cannot: the turn of a can, the front of a box, the face of a cube.
//
//   const SurfacePrint print(mesh, material);                     // once a model; print.says_anything()
//   const PrintView view(print, camera, depth, color, X_CO, 40);  // once an object and frame
//   const double share = view.independent_share(X_CO);
//   double nats = view.match(X_CO * X_OS).log_ratio(share) - view.match(X_CO).log_ratio(share);
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/pose.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::filter {

using geometry::Pose;
using geometry::Vector3d;

/// The brightness (luma of sRGB, 1 to 255) of a surface, in a grid of cubes around it: a cube that the surface does not
/// cross has that of the nearest one that it does, up to `kReach` away. A measured point therefore finds its brightness
/// although depth is noisy.
class SurfacePrint {
 public:
  static constexpr double kReach = 0.012;  ///< m. Larger than the errors of depth and pose; smaller than most walls.

  /// No print.
  SurfacePrint() = default;
  /// Of a mesh with its look (in O). `material` gives the colour where the look has none.
  SurfacePrint(const rendering::RenderMesh& mesh, const rendering::SurfaceMaterial& material);

  /// Whether the brightness differs between neighbouring places of the surface, on at least a fiftieth of it.
  bool says_anything() const { return says_anything_; }
  /// At a point in O; 0 where no surface is near.
  std::uint8_t at(const Vector3d& p_O) const {
    const Vector3d cell = (p_O - p_O_corner_) * per_metre_;
    for (int k = 0; k < 3; ++k)
      if (!(cell[k] >= 0.0 && cell[k] < size_[static_cast<std::size_t>(k)])) return 0;
    return cells_[index(static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()))];
  }
  const Vector3d& centre() const { return p_OQ_; }  ///< Of a sphere about it, in O.
  double radius() const { return radius_; }         ///< Of that sphere, m.

 private:
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(x);
  }
  void lay_out(const rendering::RenderMesh& mesh);
  /// Mean brightness of the cubes that samples fell into, then spread to those near.
  void fill(const std::vector<float>& sums, const std::vector<std::uint32_t>& counts);

  std::array<int, 3> size_{};
  Vector3d p_O_corner_ = Vector3d::Zero();
  double per_metre_ = 0.0;
  Vector3d p_OQ_ = Vector3d::Zero();
  double radius_ = 0.0;
  bool says_anything_ = false;
  std::vector<std::uint8_t> cells_;
};

/// How the brightness of a frame agrees with a print at one pose.
struct PrintMatch {
  /// Of the brightness less its mean around each cell, over its deviation there, in [-1, 1]: light that is scaled, or
  /// that changes slowly over the object, changes nothing.
  double correlation = 0.0;
  int cells = 0;  ///< That were compared.

  /// Log ratio, nats, of the frame's brightness if it is the print's, up to a gain and noise of an unknown size, and if
  /// it is not (regression against none, both marginal over the variance by the criterion of [Schwarz 1978]), with a
  /// share of things that are printed otherwise. 0 where nothing agrees or nothing is compared; never less: a print
  /// refutes no pose, it prefers one.
  /// `independent_share`: PrintView::independent_share, the same for all poses that are compared.
  double log_ratio(double independent_share) const;
  /// All cells together are worth at most so many: errors of shape, calibration and reflections are shared by them.
  static constexpr double kMostIndependent = 60.0;
  static constexpr double kOutlierShare = 0.05;
};

/// What a frame shows around an object, in square cells of several pixels.
class PrintView {
 public:
  /// `depth` (m, 0 = none) and `color` are full images of `camera`. The object's sphere at X_CO is about `cells` cells
  /// wide, or one pixel a cell where it is smaller than that. The print must outlive the view.
  PrintView(const SurfacePrint& print, const geometry::PinholeCamera& camera, const geometry::DepthImage& depth,
            const geometry::ColorImage& color, const Pose& X_CO, int cells);

  /// At the cells whose measured points lie on the surface, and those around them too.
  PrintMatch match(const Pose& X_CO) const;
  /// Of the cells of a match at X_CO, the share that is independent, by how far both brightnesses are correlated with
  /// themselves [Bartlett 1935; Clifford et al. 1989]; 0 where nothing is compared.
  double independent_share(const Pose& X_CO) const;

 private:
  struct Compared {
    std::vector<std::uint8_t> mask;
    std::vector<float> print, frame;  ///< Normalised; 0 outside of the mask.
    int cells = 0;
  };
  Compared compare(const Pose& X_CO) const;
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }

  const SurfacePrint* print_;
  int width_ = 0, height_ = 0;
  std::vector<Vector3d> points_C_;  ///< z = 0 where nothing was measured.
  std::vector<float> brightness_;
};

}  // namespace prescene::filter
