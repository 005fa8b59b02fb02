// SPDX-License-Identifier: Apache-2.0
// Where an object ends in the depth image: the part of the evidence for a pose that depth residuals do not have. With
// these alone a thing slides along its own faces, and a handle says little about how a mug is turned.
//
//   Outline outline(target, X_CO, camera, renderer);     // points on the body where it ends as seen from here
//   outline.see_colors(X_CO, depth, color, terms);       // where there is a colour image
//   OutlineEquations equations = outline.linearise(X_CO, depth, terms, &color);
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "prescene/filter/proposals/pose_search.h"
#include "prescene/rendering/renderer.h"

namespace prescene::filter {

class EdgeColors;

/// Gauss-Newton equations of the outline, in the coordinates of rendering::PoseLinearisation and units of information.
struct OutlineEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  int points = 0;  ///< That saw an edge.
};

/// The outline of one object, as points of its surface. Follows [Stoiber et al. 2022] in looking along lines across the
/// outline for where the object ends, in depth and, as there, by colours within and around it.
class Outline {
 public:
  /// The object is drawn alone at X_CO, about 64 pixels large; its outline are the edge points of that picture.
  /// `camera`: of the full image. Empty where nothing of it is in view or it can't be drawn.
  Outline(const SearchTarget& target, const Pose& X_CO, const geometry::PinholeCamera& camera,
          rendering::Renderer& renderer);

  bool empty() const { return points_.empty(); }

  /// Learns from a frame in which the object is at about X_CO which colours it has within its outline, and which are
  /// around it, at more than the 15 mm to either side that linearise() looks at. Nothing is learned from pixels of
  /// something nearer, or from too few. Images: of the camera given before, full size.
  void see_colors(const Pose& X_CO, const geometry::DepthImage& depth, const geometry::ColorImage& color,
                  const rendering::FrameTerms& terms);

  /// The equations about X_CO, which may be some centimetres from where the outline was taken. `depth`: the full image
  /// (m, 0 = none) of the camera given before. Pixels of which `terms` knows another reason (supports, robot, other
  /// objects) count as background where they are measured there; nearer ones hide the line behind them. `color`: of the
  /// same size; null = depth alone. Where colours were seen, pixels count by depth and colour together: what one says
  /// against the other is taken for no edge, and pixels without a return count by their colour.
  OutlineEquations linearise(const Pose& X_CO, const geometry::DepthImage& depth, const rendering::FrameTerms& terms,
                             const geometry::ColorImage* color = nullptr) const;

 private:
  struct Point {
    Vector3d p_O;           ///< Where the surface ends.
    Vector3d inwards_O;     ///< From there to the surface some pixels further in.
    Vector3d outwards_O;    ///< Unit, across the outline in the image plane of the pose at which it was taken.
    double width;           ///< How far it goes on inwards, in pixels of a focal length of 1.
    double contrast = 0.0;  ///< 0 to 1, how well colours tell the two sides apart here.
  };
  /// Pixels across the outline at a point, in the image.
  struct Line {
    Vector3d p;              ///< The point in C.
    Eigen::Vector2d u, n;    ///< Where it is seen; the direction outwards.
    int reach = 0;           ///< Pixels to either side.
    double slope = 0.0;      ///< m a pixel, how the depth changes on the object's side.
    double tolerance = 0.0;  ///< m, within which a measurement is the object's.
    /// m, depth of the object's surface at pixel `s`, as far as it goes on.
    double expected(int s) const { return p.z() + std::max(0, -s) * slope; }
    Eigen::Vector2i pixel(int s) const {
      return {static_cast<int>(std::lround(u.x() + s * n.x())), static_cast<int>(std::lround(u.y() + s * n.y()))};
    }
  };
  enum class Seen : std::int8_t { kNothing, kObject, kBackground };

  std::optional<Line> line_at(const Point& point, const Pose& X_CO, const rendering::FrameTerms& terms) const;
  /// Whether the line's pixel `s`, at (x, y) with a measurement of z (0 = none), shows something before the object.
  static bool is_hidden(const Line& line, int s, int x, int y, double z, const rendering::FrameTerms& terms);
  static Seen seen_at(const Line& line, int s, int x, int y, double z, const rendering::FrameTerms& terms);

  geometry::PinholeCamera camera_;
  double share_ = 0.0;  // of a point's information: neighbouring points share errors
  double lever_ = 0.0;  // m, error of the levers, as facet_lever()
  Vector3d p_OQ_ = Vector3d::Zero();
  std::vector<Point> points_;
  std::shared_ptr<const EdgeColors> colors_;  // null where they tell nothing
};

}  // namespace prescene::filter
