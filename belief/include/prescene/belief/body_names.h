// SPDX-License-Identifier: Apache-2.0
// The numbers of bodies that contacts speak of (objects, then supports, then robot bodies, then pushers of actions),
// and the rules by which motion and support are recognised.
#pragma once

#include <optional>
#include <string>

#include "prescene/belief/trajectory.h"

namespace prescene::belief {

std::optional<int> body_index(const Scene& scene, const std::string& name);
/// The name of the body of that number; "pusher", "pusher 2", ... for bodies that actions made.
std::string body_name(const Scene& scene, int index);
bool is_moving(const ObjectState& state);
/// Against gravity; W's z where there is none. Just (0, 0, 1) where gravity is along -z.
Vector3d up_of(const Scene& scene);
/// Whether `upper` lies on `lower` in this contact.
bool supports(const ContactInterval& contact, int lower, int upper);

}  // namespace prescene::belief
