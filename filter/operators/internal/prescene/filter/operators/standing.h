// SPDX-License-Identifier: Apache-2.0
// What lies still on a support lies there on one of its faces: a frame that shows a box far away, which it may see
// some millimetres and degrees off, is not all that is known of how it lies.
//
//   const auto stands = standing_equations(shape, mesh, supports, up_W, X_WO, height_at, {H, g}, 0.5);
//   if (stands) H += stands->information, g += stands->gradient;
#pragma once

#include <functional>
#include <optional>

#include "prescene/filter/proposals/resting_starts.h"
#include "prescene/filter/proposals/support_surfaces.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

/// How far a support is above where it is believed to be, m, and to what standard deviation.
struct SupportHeight {
  double offset = 0.0;
  double sigma = 0.0;
};
/// Around a point p_WB of a support with the unit normal normal_W: by the median over the measured pixels that show it
/// between the distances `inner` and `outer` (m) from there, and by the scene, which is taken to know it to 5 mm.
/// `supports`: the depth of the supports alone in terms.camera, 0 = none. What stands there is as far off as the
/// support is.
SupportHeight support_height(const rendering::FrameTerms& terms, const geometry::DepthImage& supports, const Pose& X_CW,
                             const Vector3d& p_WB, const Vector3d& normal_W, double inner, double outer);

/// Gauss-Newton equations of a pose: rotation in O and translation in W, as geometry::box_plus takes them.
struct PoseEquations {
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
  geometry::Vector6d gradient = geometry::Vector6d::Zero();
};

/// For an object that rests at X_WO, of which a frame alone says what `seen` says about that pose: the face nearest to
/// the support below is flush with it and touches it, as three points of the face's border do to within a millimetre,
/// which is what meshes and supports are known to. Of the tilt that says more by a wide base than by a narrow one, and
/// next to nothing by the facets of a can that lies. It counts as far as it is probable by what frames show: some
/// things lie on something thin that is not known (flush, but higher), and some lean. Nothing where no flat and nearly
/// level part of a support is near to the face. `height_at`: support_height() at a point of the support, with its
/// normal. `common`: share of a frame's variance that is common to the frames in which the object lay still.
std::optional<PoseEquations> standing_equations(
    const RestingShape& shape, const rendering::RenderMesh& mesh, const SupportSurfaces& supports, const Vector3d& up_W,
    const Pose& X_WO, const std::function<SupportHeight(const Vector3d& p_WB, const Vector3d& normal_W)>& height_at,
    const PoseEquations& seen, double common);

/// nats, at most 0, of lying so deep in what carries it: the object's lowest point is below the surface there, which
/// the scene is taken to know to 5 mm. 0 beside and above supports.
double log_sunk(const rendering::RenderMesh& mesh, const SupportSurfaces& supports, const Vector3d& up_W,
                const Pose& X_WO);

/// Of an object that rests as it is followed, the odds that it rests turned otherwise.
class StandingOdds {
 public:
  /// All but the pose must outlive it.
  StandingOdds(const RestingShape& shape, const rendering::RenderMesh& mesh, const SupportSurfaces& supports,
               const Vector3d& up_W, const Pose& followed_X_WO);
  /// nats, on the support that is near below the middles of both: about a face on which it stands there as often as it
  /// comes to lie on one like it, about any other rotation as often as things lean so. At most 0; 0 where no support is
  /// near.
  double log_of(const Pose& X_WO) const;

 private:
  std::optional<double> log_standing_at(const Pose& X_WO) const;

  const RestingShape& shape_;
  const rendering::RenderMesh& mesh_;
  const SupportSurfaces& supports_;
  Vector3d up_W_;
  std::optional<double> followed_;
};

}  // namespace prescene::filter
