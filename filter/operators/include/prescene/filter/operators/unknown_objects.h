// SPDX-License-Identifier: Apache-2.0
// Things that no model describes: what stands on a support and is explained by nothing gets a model of its own, a box
// or an upright cylinder about its points, and is tracked as any other object.
//
//   add_unknown_objects(frame, observation, known, options, spread, tools, stream, belief);
//   forget_unknown_objects(belief);
#pragma once

#include <optional>
#include <span>
#include <string>
#include <variant>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/operators/augment.h"

namespace prescene::filter {

/// Their names, and those of their models, are this and a number from 1 on.
inline constexpr const char* kUnknownObject = "unknown_";
/// Whether an object of this name was found, and not given by the scene.
bool is_unknown_object(const std::string& name);

/// What a model of its own is of: a box, or an upright cylinder, about its origin.
using UnknownShape = std::variant<geometry::BoxShape, geometry::Cylinder>;
/// The model of such an object, without a name: all else follows from its shape. Errors of
/// belief::with_derived_properties.
core::Result<belief::ObjectModel> unknown_object_model(const UnknownShape& shape);

/// A shape about points of which only what faces the camera was seen: upright on a support, from its height up to the
/// highest points.
struct SeenShape {
  Vector3d size = Vector3d::Zero();  ///< m, along x, y and up. Of a cylinder, x and y are its diameter.
  Pose X_WO;                         ///< Of its middle, z up.
};
/// The box of least area around the points' footprint (m; up to a share of outliers), which stands on `base` (height
/// along `up_W` from W's origin). Empty for fewer than ten points.
std::optional<SeenShape> box_about(std::span<const Vector3d> points_W, const Vector3d& up_W, double base);

/// Appends an object, with a model, to the belief and to a copy of its scene for each cluster of points that stands on
/// a support, ends within the image, is of a size that can be carried and is explained by nothing. `known`: depth of
/// everything tracked at frame.terms.camera. Returns how many.
int add_unknown_objects(const FilterFrame& frame, const belief::Observation& observation,
                        const geometry::DepthImage& known, const AugmentOptions& options,
                        const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                        belief::Belief& belief);

/// Takes those that are lost, and their models, out of the belief and of a copy of its scene: unlike an object that the
/// scene names, nobody expects them to come back. Returns how many.
int forget_unknown_objects(belief::Belief& belief);

}  // namespace prescene::filter
