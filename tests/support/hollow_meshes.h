// SPDX-License-Identifier: Apache-2.0
// Closed meshes of hollow things: what convex shapes can't stand for.
#pragma once

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// A cup without a handle, its outer bottom at z = 0; lengths in m.
geometry::TriangleMesh cup(double radius, double height, double wall, int segments = 48);
/// A bowl: part of a spherical shell of the given outer radius, its lowest point at z = 0.
geometry::TriangleMesh bowl(double radius, double depth, double wall, int segments = 48);
/// A ring of the given tube in the x-z plane about the origin, from angle `from` to `to` (rad, from x towards z),
/// closed by flat ends where it is not whole.
geometry::TriangleMesh arc(double radius, double tube, double from, double to, int along = 24, int around = 16);
/// A cup of 40 mm radius and 90 mm height with a handle on the side of +x; its hole is 40 mm high and 20 mm wide.
geometry::TriangleMesh mug();
/// A spoon of 15 cm whose stem goes up along z from its bowl.
geometry::TriangleMesh spoon();

}  // namespace prescene::tests
