// SPDX-License-Identifier: Apache-2.0
// How long a start stays one object.
#include "prediction_parts.h"
#include "prescene/belief/body_names.h"
#include "prescene/simulation/uncertain/common_flight.h"

namespace prescene::queries {

std::optional<belief::FlightForecast> forecast_flight(const Foresight& foresight, const Prior& prior,
                                                      const QueryContext& context) {
  if (!context.shapes) return std::nullopt;
  const belief::Scene& scene = *foresight.scene;
  const auto bodies = simulation::FlightBodies::make(scene, *context.shapes);
  if (!bodies) return std::nullopt;
  const auto make_simulator = [&](const belief::Scene& flown) {
    return context.make_simulator(std::make_shared<const belief::Scene>(flown));
  };
  const auto flight = simulation::common_flight(scene, *bodies, prior.starts, foresight.request, make_simulator,
                                                prior.stream, *context.pool, {}, context.cancellation);
  if (!flight) return std::nullopt;
  belief::FlightForecast forecast;
  forecast.apart_until = flight->apart_until;
  forecast.end = flight->end;
  for (const simulation::FlightOpening& opening : flight->openings)
    forecast.may_touch.push_back({belief::body_name(scene, opening.first), belief::body_name(scene, opening.second),
                                  opening.probability, opening.probability_error});
  return forecast;
}

}  // namespace prescene::queries
