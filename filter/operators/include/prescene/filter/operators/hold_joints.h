// SPDX-License-Identifier: Apache-2.0
// Keeps what hangs on a joint where the joint allows it to be: a measurement of the child's pose against its parent's
// in the five directions that the joint holds, and of its velocity there, each with a small variance. Frames decide the
// sixth, and so how far a drawer is open.
//
//   hold_joints(belief);   // after predict, after weight and after recovery
//
// Each particle of a child gets one Gaussian update with its own covariance, and weighs less the further it was off
// against that covariance. Parents are not changed: what is seen of a child says nothing of its parent.
#pragma once

#include "prescene/belief/belief.h"

namespace prescene::filter {

/// Children that are held by a hand, whose parent is not there, or that have no particles are left as they are.
void hold_joints(belief::Belief& belief);

}  // namespace prescene::filter
