// SPDX-License-Identifier: Apache-2.0
// JSON of questions about relations and timelines, both ways, and of their answers.
#pragma once

#include "json_values.h"
#include "prescene/belief/observed_timeline.h"

namespace prescene::belief {

Json relations_json(const RelationsQuery& query);
RelationsQuery relations_from(JsonObject& fields);
Json relations_answer_json(const RelationsAnswer& answer);
Json timeline_question_json(const TimelineQuery& query);
TimelineQuery timeline_question_from(JsonObject& fields);
Json timeline_answer_json(const TimelineAnswer& answer);

}  // namespace prescene::belief
