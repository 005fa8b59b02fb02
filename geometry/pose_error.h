// SPDX-License-Identifier: Apache-2.0
// How far an estimated pose is from the true one, as object pose benchmarks measure it.
#pragma once

#include <vector>

#include "prescene/geometry/point_tree.h"
#include "prescene/geometry/pose.h"

namespace prescene::geometry {

/// Mean distance of model points under two poses (ADD) [Hinterstoisser et al. 2012], m. At least one point.
double add_error(const std::vector<Vector3d>& points, const Pose& X_estimate, const Pose& X_truth);
/// Mean over points of the true pose of the distance to the nearest point of the estimate (ADD-S) [Xiang et al. 2018],
/// m. Builds a tree each time; an evaluator of many poses keeps an AddsEvaluator.
double adds_error(const std::vector<Vector3d>& points, const Pose& X_estimate, const Pose& X_truth);

/// Both measures for many poses of one object. The search tree is over the model's own points, into whose frame the
/// points of the true pose are brought, so it is built once. adds() is exact and allocates nothing. Const use from any
/// thread.
class AddsEvaluator {
 public:
  explicit AddsEvaluator(std::vector<Vector3d> points);

  double add(const Pose& X_estimate, const Pose& X_truth) const;
  double adds(const Pose& X_estimate, const Pose& X_truth) const;

 private:
  std::vector<Vector3d> points_;
  PointTree tree_;
};

}  // namespace prescene::geometry
