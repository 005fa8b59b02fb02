// SPDX-License-Identifier: Apache-2.0
// Events: what may happen to an object without anybody saying so. Each is a schema with parameters and priors; the
// question `explain` asks which of them makes what was seen most probable (docs/reference/explain.md has the table).
#pragma once

#include <array>
#include <cstddef>

namespace prescene::belief {

/// The schemas. What an event leads to (slides, tips over, falls) is simulated, and is not a schema of its own.
enum class EventKind {
  kNothing,    ///< Nothing but what is known to be done.
  kPushed,     ///< Something unseen pushes for a while.
  kBumped,     ///< A short blow.
  kSlipped,    ///< The hand that holds it lets go, or it slips out of it.
  kMoved,      ///< Somebody takes it and puts it down elsewhere.
  kTakenAway,  ///< Somebody takes it away.
  kPutIn,      ///< It was not there, and somebody puts it in.
  kExchanged,  ///< It changes places with another of the same shape.
  kOther,      ///< Any other motion.
};
inline constexpr std::size_t kEventKinds = 9;

/// Their names, in the order of the kinds.
inline constexpr std::array<const char*, kEventKinds> kEventNames = {
    "nothing", "pushed", "bumped", "slipped", "moved", "taken_away", "put_in", "exchanged", "other"};
inline const char* name_of(EventKind kind) { return kEventNames[static_cast<std::size_t>(kind)]; }

/// How probable each kind is before anything was seen, up to a common factor; >= 0, not all 0.
/// What can't be (nothing slips that is not held) does not count, and the rest is scaled to sum to one. The weight of a
/// kind is shared evenly by the objects that it may happen to.
struct EventWeights {
  std::array<double, kEventKinds> weight = {0.5, 0.12, 0.12, 0.12, 0.06, 0.06, 0.06, 0.03, 0.02};
  double of(EventKind kind) const { return weight[static_cast<std::size_t>(kind)]; }
  friend bool operator==(const EventWeights&, const EventWeights&) = default;
};

/// Priors of the schemas' parameters, the same for every object. Log-normal ones are given by their median and the
/// standard deviation of their logarithm. The time of an event is uniform over the window, directions are uniform over
/// the horizontal circle.
struct EventPriors {
  double push_speed = 0.25, push_speed_spread = 0.6;        ///< m/s of what pushes.
  double push_duration = 0.45, push_duration_spread = 0.5;  ///< s.
  double pusher_radius = 0.015;                             ///< m.
  /// Where it is touched: share of its height above its lowest point, and sideways share of its half width; uniform.
  double lowest_touch = 0.1, highest_touch = 0.95, sideways_touch = 0.6;
  double bump_speed = 0.7, bump_speed_spread = 0.6;  ///< Impulse over mass, m/s.
  double slip_speed = 0.05, slip_rate = 0.5;         ///< Deviations of what the hand adds on each axis, m/s and rad/s.
  double carry_duration = 0.4, carry_duration_spread = 0.6;  ///< s between taking and putting down.
  double carry_distance = 0.25, carry_height = 0.08;  ///< Deviations of where it is put down, along each axis, m.
};

}  // namespace prescene::belief
