// SPDX-License-Identifier: Apache-2.0
// What may be asked at most, whoever asks: the command line, JSON over the bus or a caller in C++. Every way in checks
// by these functions, so that no question takes for ever or more memory than there is.
//
//   PRESCENE_RETURN_IF_ERROR(belief::check_number(value, belief::kConfidences).at("--confidence"));
//   PRESCENE_RETURN_IF_ERROR(belief::validate(query));
#pragma once

#include <cstdint>
#include <string>

#include "prescene/belief/query.h"
#include "prescene/belief/validation.h"
#include "prescene/core/status.h"

namespace prescene::belief {

/// At the lower end intervals are finer than any simulator is right, and take millions of instances.
inline constexpr ScalarRange kTolerances{1e-4, 0.5, "give a half width between 0.0001 and 0.5, like 0.02"};
/// At the upper end an interval of a normal distribution reaches 3.9 standard deviations; at 1 it would be infinite.
inline constexpr ScalarRange kConfidences{0.5, 0.9999, "give a probability between 0.5 and 0.9999, like 0.95"};
inline constexpr int kMostInstances = 1 << 22;
inline constexpr ScalarRange kInstances{1.0, kMostInstances, "give a whole number between 1 and 4194304"};
inline constexpr ScalarRange kWallSeconds{1e-6, 1e6, "give seconds between 1e-06 and 1000000"};
inline constexpr ScalarRange kDurations{1e-12, 3600.0, "give seconds above 0 and up to 3600"};
inline constexpr ScalarRange kViewTimes{0.0, 3600.0, "give seconds between 0 and 3600"};
inline constexpr ScalarRange kMoves{1e-6, 1e3, "give metres between 1e-06 and 1000"};
inline constexpr ScalarRange kTurns{1e-6, 3.2, "give radians between 1e-06 and 3.2"};
/// The same in degrees, for JSON.
inline constexpr ScalarRange kTurnsDeg{6e-5, 183.0, "give degrees between 6e-05 and 183"};
/// m, of RelationsQuery.
inline constexpr ScalarRange kReaches{1e-3, 1e3, "give metres between 0.001 and 1000"};
/// Of RelationsQuery: with fewer no interval says much.
inline constexpr int kFewestRelationDraws = 16, kMostRelationDraws = 4096;
/// Of ViewQuery, and of NextViewQuery, where each draw is compared with each other.
inline constexpr int kFewestViewDraws = 16, kMostViewDraws = 256;
/// Of NextViewQuery.
inline constexpr std::size_t kMostViews = 64;
/// Pixels of a view that is asked for, at most.
inline constexpr std::int64_t kMostViewPixels = std::int64_t{1} << 22;
inline constexpr ScalarRange kWantedProbabilities{0.5, 0.999, "give a probability between 0.5 and 0.999, like 0.95"};
inline constexpr int kMostPaths = 1000;
inline constexpr std::size_t kMostFree = 16;
inline constexpr std::size_t kMostActions = 256;
/// Of single outcomes and of all groups' together; every one is judged in every instance.
inline constexpr std::size_t kMostOutcomes = 256;
inline constexpr std::size_t kMostConditions = 512;
inline constexpr std::size_t kLongestName = 128;  ///< Bytes of an outcome's or a group's name.
inline constexpr std::size_t kLongestId = 256;    ///< Bytes of a question's id.

/// "0.3 is out of range: give ..." unless the value lies within the closed range.
core::Status check_number(double value, const ScalarRange& range);

core::Status validate(const Effort& effort);
/// Numbers, counts and lengths; whether its names exist is known once there is a scene.
core::Status validate(const Query& query);

}  // namespace prescene::belief
