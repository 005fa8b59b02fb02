// SPDX-License-Identifier: Apache-2.0
// Any bytes as a question, as it comes over the bus, about what will be or what happened: understood, or refused with a
// reason; what is understood can be written down and read again.
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "prescene/belief/explain_question.h"
#include "prescene/belief/json.h"
#include "prescene/core/check.h"

namespace {

void check_explain(std::string_view text) {
  using namespace prescene::belief;
  const auto question = explain_question_from_json(text);
  if (!question) {
    PRESCENE_CHECK(!question.status().message().empty());
    return;
  }
  PRESCENE_CHECK(asks_to_explain(text));
  const auto again = explain_question_from_json(to_json(*question).dump());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(to_json(*again) == to_json(*question));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_explain(text);
  const auto query = belief::query_from_json(text);
  if (!query) {
    PRESCENE_CHECK(!query.status().message().empty());
    return 0;
  }
  const auto again = belief::query_from_json(belief::to_json(*query).dump());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(again->id == query->id && again->what.index() == query->what.index());
  return 0;
}
