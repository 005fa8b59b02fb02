// SPDX-License-Identifier: Apache-2.0
// An event as it would have been with other parameters, or with its object elsewhere at the start: how it ends then.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/event.h"
#include "prescene/queries/explain.h"
#include "prescene/queries/shift_search.h"
#include "prescene/queries/tempered_smc.h"

namespace prescene::queries {

/// What may be changed, in units of its standard deviation.
struct ChangeCoordinate {
  std::string name;  ///< "speed", "place along x".
  std::string unit;  ///< "m/s"
};

struct ChangedDraw {
  LatentPoint draw;
  Shift shift;  ///< By coordinate.
};

class ChangedEvents {
 public:
  virtual ~ChangedEvents() = default;

  /// Parameters of the event but for its time where all lies still; standard normal under its priors. Then the place of
  /// the object at the start, along W's x laid flat, along the horizontal axis to the left of it, and, of what is held,
  /// upwards: of kPlaceDeviation each. The hand that holds it moves with it.
  virtual const std::vector<ChangeCoordinate>& coordinates() const = 0;
  /// Of a draw: the event's parameters, then what the start takes, all standard normal.
  virtual int dimensions() const = 0;
  /// Whether each has the outcome that is wanted; no if it can't be (nothing is touched, two things would
  /// overlap). `values`, where given, get the values of the coordinates of each in their units.
  virtual std::vector<std::uint8_t> outcomes(std::span<const ChangedDraw> draws,
                                             std::vector<std::vector<double>>* values = nullptr) = 0;
};

inline constexpr double kPlaceDeviation = 0.05;  ///< m

/// Of an event of an object that is there at the window's start, with the priors of the query; what is wanted is that
/// the object stays as it was (smallest_change.h). All must outlive it. Errors of explain().
core::Result<std::unique_ptr<ChangedEvents>> changed_events(const ExplainWindow& window, const ExplainQuery& query,
                                                            const ExplainContext& context, belief::EventKind kind);

}  // namespace prescene::queries
