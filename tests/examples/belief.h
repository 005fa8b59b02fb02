// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of belief take for granted.
#pragma once

#include <span>

#include "prescene/belief/belief.h"
#include "prescene/belief/observed_timeline.h"
#include "prescene/belief/query_limits.h"

namespace prescene::belief::given_belief::physical_belief_h {
extern const ObjectModel model;
extern const ObjectBelief object;
extern const std::span<const double> uniforms;
}  // namespace prescene::belief::given_belief::physical_belief_h

namespace prescene::belief::given_belief::observed_timeline_h {
extern const ObservedTimeline timeline;
extern const TimelineQuery question;
}  // namespace prescene::belief::given_belief::observed_timeline_h

namespace prescene::belief::given_belief::query_limits_h {
extern const double value;
extern const Query query;
}  // namespace prescene::belief::given_belief::query_limits_h

namespace prescene::belief::given_belief::joint_h {
extern const Pose X_WP, X_WC;
extern const Twist V_WC;
}  // namespace prescene::belief::given_belief::joint_h

namespace prescene::belief::given_belief::next_view_h {
extern const Pose X_WL, X_WR;
}  // namespace prescene::belief::given_belief::next_view_h
