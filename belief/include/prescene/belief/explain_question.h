// SPDX-License-Identifier: Apache-2.0
// The question what happened, asked of whoever keeps the frames of the last seconds, and its JSON form:
//
//   PRESCENE_TRY(const ExplainQuestion question,
//                explain_question_from_json(R"({"id": "7", "explain": {"object": "carton", "last": 2.0}})"));
//   ... question.object
//
// docs/reference/explain.md has the keys. The answer is that of prescene/queries/explain.h.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "prescene/belief/outcome.h"
#include "prescene/belief/validation.h"
#include "prescene/core/status.h"

namespace prescene::belief {

/// s, of a window and its ends.
inline constexpr ScalarRange kWindowSeconds{1e-3, 3600.0, "give seconds between 0.001 and 3600"};
inline constexpr ScalarRange kWindowEnds{0.0, 1e9, "give seconds between 0 and 1000000000"};

struct ExplainQuestion {
  std::string id;      ///< Given back in the answer.
  std::string object;  ///< Empty: any that the frames show to be elsewhere.
  /// The window, s since the first frame of the session; both or neither. Neither: the last `last` seconds.
  std::optional<double> from, to;
  double last = 2.0;  ///< s before the newest frame.
  int frames = 10, runs = 4, points = 24;
  double half_width = 0.05;
  std::uint64_t seed = 1;
  /// Also the smallest change that would have led to the outcome `wanted`, or to the scene's that is called
  /// `wanted_name`; neither: that the object stays as it was.
  bool change = false;
  std::string wanted_name;
  std::optional<Outcome> wanted;
  std::optional<double> max_seconds;  ///< Wall time; empty: as much as whoever answers gives.
  bool stream = false;                ///< As belief::Query::stream.
  friend bool operator==(const ExplainQuestion&, const ExplainQuestion&) = default;
};

/// Whether it is this question, understood or not: a document with the key "explain".
bool asks_to_explain(std::string_view json);
/// {"id": "...", "explain": {...}}; kInvalidInput naming the key that is wrong.
core::Result<ExplainQuestion> explain_question_from_json(std::string_view json);
/// What explain_question_from_json reads.
nlohmann::ordered_json to_json(const ExplainQuestion& question);

}  // namespace prescene::belief
