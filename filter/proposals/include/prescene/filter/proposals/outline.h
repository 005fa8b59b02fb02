// SPDX-License-Identifier: Apache-2.0
// Where an object ends in the depth image: the part of the evidence for a pose that depth residuals do not have. With
// these alone a thing slides along its own faces, and a handle says little about how a mug is turned.
//
//   const Outline outline(target, X_CO, camera, renderer);     // points on the body where it ends as seen from here
//   OutlineEquations equations = outline.linearise(X_CO, depth, terms);
#pragma once

#include <vector>

#include "prescene/filter/proposals/pose_search.h"
#include "prescene/rendering/renderer.h"

namespace prescene::filter {

/// Gauss-Newton equations of the outline, in the coordinates of rendering::PoseLinearisation and units of information.
struct OutlineEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  int points = 0;  ///< That saw an edge.
};

/// The outline of one object, as points of its surface. Follows [Stoiber et al. 2022] in looking along lines across the
/// outline for where the object ends; what is asked there is depth, not colour.
class Outline {
 public:
  /// The object is drawn alone at X_CO, about 64 pixels large; its outline are the edge points of that picture.
  /// `camera`: of the full image. Empty where nothing of it is in view or it can't be drawn.
  Outline(const SearchTarget& target, const Pose& X_CO, const geometry::PinholeCamera& camera,
          rendering::Renderer& renderer);

  bool empty() const { return points_.empty(); }

  /// The equations about X_CO, which may be some centimetres from where the outline was taken. `depth`: the full image
  /// (m, 0 = none) of the camera given before. Pixels of which `terms` knows another reason (supports, robot, other
  /// objects) count as background where they are measured there; nearer ones hide the line behind them.
  OutlineEquations linearise(const Pose& X_CO, const geometry::DepthImage& depth,
                             const rendering::FrameTerms& terms) const;

 private:
  struct Point {
    Vector3d p_O;         ///< Where the surface ends.
    Vector3d inwards_O;   ///< From there to the surface some pixels further in.
    Vector3d outwards_O;  ///< Unit, across the outline in the image plane of the pose at which it was taken.
  };

  geometry::PinholeCamera camera_;
  double share_ = 0.0;  // of a point's information: neighbouring points share errors
  double lever_ = 0.0;  // m, error of the levers, as facet_lever()
  Vector3d p_OQ_ = Vector3d::Zero();
  std::vector<Point> points_;
};

}  // namespace prescene::filter
