// SPDX-License-Identifier: Apache-2.0
// JSON of questions about what cameras will see, both ways, and of their answers.
#pragma once

#include "json_values.h"
#include "prescene/belief/query.h"

namespace prescene::belief {

/// Everything but the actions.
void add_view_question(const ViewQuery& query, Json& json);
ViewQuery view_question_from(JsonObject& fields);
Json view_answer_json(const ViewAnswer& answer);
Json next_view_json(const NextViewQuery& query);
NextViewQuery next_view_from(JsonObject& fields);
Json next_view_answer_json(const NextViewAnswer& answer);

}  // namespace prescene::belief
