// SPDX-License-Identifier: Apache-2.0
// Where one body is relative to another, in single precision: what every query takes.
//
//   PRESCENE_TRY(const Transform X_AB, relative_transform(X_WA, X_WB));
//   bool touching = collide(tree_a, tree_b, X_AB, scratch);
//
// A query on meshes A and B puts B's vertices into A's frame by `X_AB * p_BQ`, each operation rounded to single
// precision in the order written there, and answers exactly for the triangles that result. So all trees, instruction
// sets and references are asked the same question.
#pragma once

#include <Eigen/Core>
#include <array>

#include "prescene/collision/mesh.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// X_AB: rotation row by row, and translation in metres. One made by hand is not checked: with numbers that are not
/// finite queries answer as if the bodies were apart, and what is no rotation scales or shears B.
struct Transform {
  std::array<float, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::array<float, 3> translation = {0, 0, 0};

  friend bool operator==(const Transform&, const Transform&) = default;
};

/// p_AQ. Each product and sum is rounded: ((r0 x + r1 y) + r2 z) + t.
inline Vector3f operator*(const Transform& X_AB, const Vector3f& p_BQ) {
  const auto& r = X_AB.rotation;
  const auto& t = X_AB.translation;
  return {((r[0] * p_BQ.x() + r[1] * p_BQ.y()) + r[2] * p_BQ.z()) + t[0],
          ((r[3] * p_BQ.x() + r[4] * p_BQ.y()) + r[5] * p_BQ.z()) + t[1],
          ((r[6] * p_BQ.x() + r[7] * p_BQ.y()) + r[8] * p_BQ.z()) + t[2]};
}

/// Exactly, in double precision.
Eigen::Matrix3d rotation_matrix(const Transform& X_AB);
Eigen::Vector3d translation_vector(const Transform& X_AB);
/// Each number rounded, and nothing checked.
Transform rounded_transform(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB);

/// X_BA, rounded: inverse(X) * (X * p) is p within a few units in the last place of |p| and the translation.
Transform inverse(const Transform& X_AB);

/// X_AB from the poses in the world, composed in double precision and then rounded. Fails with kInvalidInput when a
/// pose is not finite, its quaternion is not of unit length within 1e-3 (it is then normalised), or the bodies are
/// further apart than kLargestCoordinate.
core::Result<Transform> relative_transform(const geometry::Pose& X_WA, const geometry::Pose& X_WB);
/// X_AB itself, under the same conditions.
core::Result<Transform> to_transform(const geometry::Pose& X_AB);
/// The upper 3 x 4 of a homogeneous matrix. Fails with kInvalidInput when it is not finite, not a rotation within 1e-3
/// (scales, shears and reflections are refused) or its last row is not (0, 0, 0, 1).
core::Result<Transform> to_transform(const Eigen::Matrix4d& X_AB);

}  // namespace prescene::collision
