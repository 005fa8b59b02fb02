// SPDX-License-Identifier: Apache-2.0
// RapidCheck generators of geometry. Values are small fractions that are not exact in binary and shrink towards zero,
// identity or the simplest shape.
//
//   EXPECT_TRUE(check_law([] {
//     const Pose X_AB = *tests::poses();
//     RC_ASSERT(X_AB.inverse().inverse() == X_AB);
//   }));
#pragma once

#include <iosfwd>

#include "prescene/geometry/pose.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/triangle_mesh.h"
#include "tests/support/laws.h"

namespace prescene::tests {

/// A number in [low, high] in steps of a millionth of the range; shrinks towards low.
rc::Gen<double> numbers(double low, double high);
/// Coordinates in [-reach, reach].
rc::Gen<geometry::Vector3d> vectors(double reach = 2.0);
/// Unit vectors.
rc::Gen<geometry::Vector3d> directions();
/// Unit quaternions over all rotations (not uniform), often small ones and half turns.
rc::Gen<geometry::Quaterniond> rotations();
rc::Gen<geometry::Pose> poses(double reach = 2.0);
/// Error coordinates of a pose with a rotation of less than pi.
rc::Gen<geometry::Vector6d> pose_errors();
/// All five kinds, lengths from 1 cm to 1 m.
rc::Gen<geometry::Primitive> primitives();
/// Closed, outward oriented meshes: primitives, bins, cartons and lathes in a random pose.
rc::Gen<geometry::TriangleMesh> closed_meshes();

}  // namespace prescene::tests

// Found by RapidCheck when it prints a counter-example.
namespace prescene::geometry {

// NOLINTBEGIN(readability-identifier-naming): the name that RapidCheck looks up.
void showValue(const Pose& X, std::ostream& out);
void showValue(const Primitive& primitive, std::ostream& out);
/// Numbers of vertices and triangles, and the vertices when they are few.
void showValue(const TriangleMesh& mesh, std::ostream& out);
// NOLINTEND(readability-identifier-naming)

}  // namespace prescene::geometry
