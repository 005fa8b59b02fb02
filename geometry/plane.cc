// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/plane.h"

namespace prescene::geometry {

Plane transformed(const Plane& plane_B, const Pose& X_AB) {
  const Vector3d normal_A = X_AB.rotation * plane_B.normal;
  return {normal_A, plane_B.offset - normal_A.dot(X_AB.translation)};
}

}  // namespace prescene::geometry
