// SPDX-License-Identifier: Apache-2.0
#include "value_texts.h"

#include <cmath>

#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {

using geometry::Vector3d;

std::string flow_list(const std::vector<std::string>& items) {
  std::string text = "[";
  for (const std::string& item : items) text.append(text.size() > 1 ? ", " : "").append(item);
  return text + "]";
}

std::string value_text(const Vector3d& v) {
  return flow_list({number_text(v.x()), number_text(v.y()), number_text(v.z())});
}

std::string value_text(const geometry::Matrix3d& m) {
  return flow_list({value_text(Vector3d(m.row(0))), value_text(Vector3d(m.row(1))), value_text(Vector3d(m.row(2)))});
}

std::string value_text(const belief::ScalarDistribution& distribution) {
  if (const auto* fixed = std::get_if<belief::FixedScalar>(&distribution)) return number_text(fixed->value);
  if (const auto* uniform = std::get_if<belief::UniformScalar>(&distribution))
    return "{uniform: " + flow_list({number_text(uniform->low), number_text(uniform->high)}) + "}";
  if (const auto* sampled = std::get_if<belief::SampledScalar>(&distribution)) {
    std::vector<std::string> samples;
    for (const double sample : sampled->samples) samples.push_back(number_text(sample));
    return "{samples: " + flow_list(samples) + "}";
  }
  const auto& normal = std::get<belief::NormalScalar>(distribution);
  std::string text = "{normal: " + flow_list({number_text(normal.mean), number_text(normal.standard_deviation)});
  if (std::isfinite(normal.low)) text += ", min: " + number_text(normal.low);
  if (std::isfinite(normal.high)) text += ", max: " + number_text(normal.high);
  return text + "}";
}

std::string value_text(const belief::Vector3Distribution& v) {
  return flow_list({value_text(v.x), value_text(v.y), value_text(v.z)});
}

std::string value_text(const geometry::Quaterniond& q) {
  return "{quaternion_wxyz: " +
         flow_list({number_text(q.w()), number_text(q.x()), number_text(q.y()), number_text(q.z())}) + "}";
}

std::string value_text(const geometry::SymmetryGroup& group) {
  if (group.trivial()) return "none";
  const std::string center = group.p_BoC.isZero(0.0) ? "" : ", center: " + value_text(group.p_BoC);
  if (group.ball) return center.empty() ? "ball" : "{ball: true" + center + "}";
  if (group.axis)
    return "{axis: " + value_text(*group.axis) + ", continuous: true" +
           (group.rotations.empty() ? "" : ", flip: true") + center + "}";
  if (geometry::SymmetryGroup::cuboid(group.p_BoC) == group)
    return center.empty() ? "cuboid" : "{cuboid: true" + center + "}";
  if (geometry::SymmetryGroup::cube(group.p_BoC) == group)
    return center.empty() ? "cube" : "{cube: true" + center + "}";
  const auto order = static_cast<int>(group.rotations.size()) + 1;
  for (const Vector3d& axis : {Vector3d(Vector3d::UnitX()), Vector3d(Vector3d::UnitY()), Vector3d(Vector3d::UnitZ())})
    if (geometry::SymmetryGroup::cyclic(axis, order, group.p_BoC) == group)
      return "{axis: " + value_text(axis) + ", order: " + std::to_string(order) + center + "}";
  std::string rotations;
  for (const geometry::Quaterniond& rotation : group.rotations)
    rotations.append(rotations.empty() ? "" : ", ").append(value_text(rotation));
  return "{rotations: [" + rotations + "]" + center + "}";
}

}  // namespace prescene::interfaces
