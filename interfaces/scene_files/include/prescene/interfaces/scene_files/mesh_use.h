// SPDX-License-Identifier: Apache-2.0
// What a mesh collides as, and what is lost where that is its convex hull.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/object_model.h"

namespace prescene::interfaces {

/// The words of the key `use` of a mesh.
const std::vector<std::pair<std::string, belief::MeshUse>>& mesh_uses();
const std::string& word_of(belief::MeshUse use);

/// A hull that is empty by more than this share of its volume is worth a warning: a mug is by about 0.6, a box with
/// rounded edges by less than 0.05. What falls into the hollow of such a mesh lands on top of its hull instead.
inline constexpr double kLargestHiddenHollow = 0.1;

/// Of a closed mesh that collides as its convex hull, or the hulls of its parts, the share of their volume that the
/// mesh leaves empty: hollows and what lies between protruding parts. Nothing for other uses, for meshes that are not
/// closed and for flat ones.
std::optional<double> hidden_hollow(const belief::MeshShape& shape);

}  // namespace prescene::interfaces
