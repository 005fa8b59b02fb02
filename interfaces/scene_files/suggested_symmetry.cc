// SPDX-License-Identifier: Apache-2.0
// The `symmetry` that a model needs whose shape looks the same when it is turned.
#include <algorithm>
#include <cmath>
#include <optional>

#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"
#include "value_texts.h"

namespace prescene::interfaces {
namespace {

using geometry::Quaterniond;
using geometry::SymmetryGroup;
using geometry::Vector3d;

constexpr double kSameSurface = 0.02;     // of half the diagonal, as `prescene inspect` looks for symmetries
constexpr double kSameTurn = 0.02;        // rad
constexpr double kWrittenLength = 1e-4;   // m; a centre is written in steps of it, ...
constexpr double kWrittenNumber = 1e-4;   // ... directions and quaternions in steps of this
constexpr double kMiddleOfModel = 0.002;  // of half the diagonal: so near to the origin, the centre is the origin

Vector3d rounded(const Vector3d& v, double step) {
  // Adding zero makes a zero of a negative zero.
  return (v / step).array().round().matrix() / std::round(1.0 / step) + Vector3d::Zero();
}

bool same_rotations(const SymmetryGroup& a, const SymmetryGroup& b) {
  return a.rotations.size() == b.rotations.size() &&
         std::all_of(a.rotations.begin(), a.rotations.end(), [&](const Quaterniond& one) {
           return std::any_of(b.rotations.begin(), b.rotations.end(), [&](const Quaterniond& other) {
             return geometry::angle_between(one, other) < kSameTurn;
           });
         });
}

/// The axis of a group of equal turns, the positive one of its two directions; none where there are several axes.
std::optional<Vector3d> only_axis(const SymmetryGroup& group) {
  Vector3d axis = geometry::log_rotation(group.rotations.front()).normalized();
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0.0) axis = -axis;
  const SymmetryGroup turns = SymmetryGroup::cyclic(axis, static_cast<int>(group.rotations.size()) + 1);
  return same_rotations(turns, group) ? std::optional(axis) : std::nullopt;
}

std::string axis_text(const Vector3d& axis) {
  for (const auto& [letter, unit] :
       {std::pair("x", Vector3d(Vector3d::UnitX())), {"y", Vector3d::UnitY()}, {"z", Vector3d::UnitZ()}})
    if (axis.dot(unit) > std::cos(kSameTurn)) return letter;
  return value_text(rounded(axis, kWrittenNumber));
}

struct Suggestion {
  std::string turns;  ///< "by 180 degrees about x, y or z"
  std::string value;  ///< Of the key `symmetry`.
};

Suggestion suggestion_for(const SymmetryGroup& found, double half_diagonal) {
  const Vector3d center =
      found.p_BoC.norm() < kMiddleOfModel * half_diagonal ? Vector3d::Zero() : rounded(found.p_BoC, kWrittenLength);
  const std::string at = center.isZero(0.0) ? "" : ", center: " + value_text(center);
  if (found.ball) return {"in any way", value_text(SymmetryGroup::every_rotation(center))};
  if (found.axis) {
    const Vector3d axis = found.axis->cwiseAbs().maxCoeff() == found.axis->maxCoeff() ? *found.axis : -*found.axis;
    const bool flips = !found.rotations.empty();
    return {"by any angle about " + axis_text(axis) + (flips ? ", and upside down" : ""),
            "{axis: " + axis_text(axis) + ", continuous: true" + (flips ? ", flip: true" : "") + at + "}"};
  }
  if (same_rotations(SymmetryGroup::cuboid(), found))
    return {"by 180 degrees about x, y or z", value_text(SymmetryGroup::cuboid(center))};
  if (same_rotations(SymmetryGroup::cube(), found))
    return {"by 90 degrees about x, y or z", value_text(SymmetryGroup::cube(center))};
  if (const auto axis = only_axis(found)) {
    const auto order = static_cast<double>(found.rotations.size() + 1);
    return {"by " + core::rounded_text(360.0 / order) + " degrees about " + axis_text(*axis),
            "{axis: " + axis_text(*axis) + ", order: " + number_text(order) + at + "}"};
  }
  SymmetryGroup written;
  written.p_BoC = center;
  for (const Quaterniond& rotation : found.rotations) {
    const Vector3d v = rounded(rotation.vec(), kWrittenNumber);
    written.rotations.emplace_back(rounded({rotation.w(), 0.0, 0.0}, kWrittenNumber).x(), v.x(), v.y(), v.z());
  }
  return {"in " + std::to_string(found.rotations.size()) + " ways", value_text(written)};
}

}  // namespace

void suggest_symmetry(const LocatedValue& value, const belief::ObjectModel& model, Problems& problems) {
  if (model.look || model.learn_colors) return;
  const geometry::TriangleMesh shape = model.visual ? *model.visual : belief::collision_mesh(model.collision);
  const double half_diagonal = 0.5 * geometry::bounding_box(shape).diagonal().norm();
  if (shape.empty() || !(half_diagonal > 0.0)) return;
  const SymmetryGroup found = geometry::suggest_symmetry(shape, kSameSurface * half_diagonal);
  if (found.trivial()) return;
  const Suggestion suggestion = suggestion_for(found, half_diagonal);
  problems.remark(value.place, value.path,
                  "it looks the same when it is turned " + suggestion.turns +
                      ", but names no symmetry: where it is tracked, its confidence is shared among the turns",
                  "write 'symmetry: " + suggestion.value + "', or 'symmetry: none' if the turn counts");
}

}  // namespace prescene::interfaces
