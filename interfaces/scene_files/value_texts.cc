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

}  // namespace prescene::interfaces
