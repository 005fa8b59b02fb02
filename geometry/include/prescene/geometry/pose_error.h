// SPDX-License-Identifier: Apache-2.0
// How far an estimated pose is from the true one, as object pose benchmarks measure it.
#pragma once

#include <vector>

#include "prescene/geometry/point_tree.h"
#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Both measures for many poses of one object. The search tree is over the model's own points, into whose frame the
/// points of the true pose are brought, so it is built once. Allocates nothing after that. Const use from any thread.
class AddsEvaluator {
 public:
  /// Points of the model's surface in its frame, m: at least one, all finite (checked).
  explicit AddsEvaluator(std::vector<Vector3d> points);

  /// Mean distance of the points under the two poses (ADD) [Hinterstoisser et al. 2012], m.
  double add(const Pose& X_estimate, const Pose& X_truth) const;
  /// Mean over the points of the true pose of the distance to the nearest point of the estimate (ADD-S)
  /// [Xiang et al. 2018], m; exact.
  double adds(const Pose& X_estimate, const Pose& X_truth) const;

 private:
  std::vector<Vector3d> points_;
  PointTree tree_;
};

}  // namespace prescene::geometry
