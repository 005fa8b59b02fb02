// SPDX-License-Identifier: Apache-2.0
// How long a start stays one object.
#include "flight_forecast.h"
#include "prescene/belief/body_names.h"
#include "prescene/simulation/outcomes/common_flight.h"

namespace prescene::queries {

core::Status forecast_flight(const Foresight& foresight, const Prior& prior, const QueryContext& context,
                             belief::PredictAnswer& answer) {
  if (!context.shapes) return core::ok_status();
  const belief::Scene& scene = *foresight.scene;
  if (!scene.joints.empty()) return core::unsupported("flights of things on joints are not followed");
  const double length_scale = foresight.simulator->length_scale();
  const auto bodies = simulation::FlightBodies::make(scene, *context.shapes, length_scale);
  if (!bodies) return bodies.status();
  const auto flight =
      simulation::common_flight(scene, *bodies, prior.starts, foresight.request, context.make_simulator, prior.stream,
                                *context.pool, simulation::CommonFlightOptions::of(length_scale), context.cancellation);
  if (!flight) return flight.status().code() == core::StatusCode::kCancelled ? core::ok_status() : flight.status();
  belief::FlightForecast& forecast = answer.flight.emplace();
  forecast.apart_until = flight->apart_until;
  forecast.end = flight->end;
  for (const simulation::FlightOpening& opening : flight->openings)
    forecast.may_touch.push_back({belief::body_name(scene, opening.first), belief::body_name(scene, opening.second),
                                  opening.probability, opening.probability_error});
  return core::ok_status();
}

}  // namespace prescene::queries
