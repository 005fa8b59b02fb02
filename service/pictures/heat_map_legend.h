// SPDX-License-Identifier: Apache-2.0
// What stands below a heat map: the scale of its colours, its lines, and how probable each outcome is.
#pragma once

#include <string>

#include "heat_map_part.h"
#include "prescene/service/pictures/ground_density.h"

namespace prescene::service {

/// "37 %", "<0.1 %"; certain only where it is.
std::string percent_text(double share);

class HeatMapLegend {
 public:
  HeatMapLegend(const belief::Scene& scene, const belief::PredictAnswer& answer, const HeatMapPart& part);
  int height() const;  ///< Pixels.
  void draw(const GroundDensity& density, int top, geometry::ColorImage& canvas) const;

 private:
  void draw_scale(const GroundDensity& density, int x, int y, geometry::ColorImage& canvas) const;
  void draw_outcomes(double x, double y, geometry::ColorImage& canvas) const;

  const HeatMapPart& part_;
  std::size_t bars_ = 0;            // endings that have one
  std::vector<std::string> lines_;  // every other outcome of the answer, and what is left out
  std::vector<std::string> notes_;
};

}  // namespace prescene::service
