// SPDX-License-Identifier: Apache-2.0
// JSON of questions about what brings an outcome about, and of their answers. `duration` and `effort` are read and
// written with those of the other questions.
#pragma once

#include "json_values.h"
#include "prescene/belief/achieve.h"

namespace prescene::belief {

AchieveQuery achieve_from(JsonObject& fields);
Json achieve_json(const AchieveQuery& achieve);
Json achieve_answer_json(const AchieveAnswer& answer);

}  // namespace prescene::belief
