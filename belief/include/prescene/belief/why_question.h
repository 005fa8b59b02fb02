// SPDX-License-Identifier: Apache-2.0
// The question why a pose is believed, asked of whoever keeps the frames of the last seconds, and its JSON form:
//
//   PRESCENE_TRY(const WhyQuestion question, why_question_from_json(R"({"id": "9", "why": {"object": "mug"}})"));
//   ... question.object
//
// docs/reference/queries.md has the keys. The answer is that of prescene/queries/why.h.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::belief {

/// What an object's most probable pose is compared with.
enum class WhyAgainst : std::uint8_t {
  kAbsenceAndAlternative,  ///< With both of the two below, as far as the belief has an alternative.
  kAbsence,                ///< That the object is not there.
  kAlternative,            ///< The most probable of the belief's alternatives (alternative_poses.h).
  kPose,                   ///< A given pose.
};
/// "absence", "alternative", "pose"; "" of kAbsenceAndAlternative.
const char* name_of(WhyAgainst against);

struct WhyQuestion {
  std::string id;  ///< Given back in the answer.
  std::string object;
  WhyAgainst against = WhyAgainst::kAbsenceAndAlternative;
  std::optional<geometry::Pose> X_WO;  ///< Of kPose, and of no other.
  /// The window, s since the first frame of the session; both or neither.
  std::optional<double> from, to;
  /// s before the newest frame, where `from` is not given; empty: 2 s, or as much of them as is kept.
  std::optional<double> last;
  int images = 3;                     ///< Of each comparison, frames whose pixels are given. In [0, 16].
  std::optional<double> max_seconds;  ///< Wall time; empty: as much as whoever answers gives.
  bool stream = false;                ///< As belief::Query::stream; there is nothing to tell before the answer.
  friend bool operator==(const WhyQuestion&, const WhyQuestion&) = default;
};
inline constexpr int kMostWhyImages = 16;

/// Whether it is this question, understood or not: a document with the key "why".
bool asks_why(std::string_view json);
/// {"id": "...", "why": {...}}; kInvalidInput naming the key that is wrong.
core::Result<WhyQuestion> why_question_from_json(std::string_view json);
/// What why_question_from_json reads.
nlohmann::ordered_json to_json(const WhyQuestion& question);

}  // namespace prescene::belief
