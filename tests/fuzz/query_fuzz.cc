// SPDX-License-Identifier: Apache-2.0
// Any bytes as a question, as it comes over the bus, about what will be or what happened: understood, or refused with a
// reason; what is understood can be written down and read again.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "prescene/belief/explain_question.h"
#include "prescene/belief/json.h"
#include "prescene/belief/why_question.h"
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

void check_why(std::string_view text) {
  using namespace prescene::belief;
  const auto question = why_question_from_json(text);
  if (!question) {
    PRESCENE_CHECK(!question.status().message().empty());
    return;
  }
  PRESCENE_CHECK(asks_why(text));
  const auto again = why_question_from_json(to_json(*question).dump());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(to_json(*again) == to_json(*question));
}

/// Numbers up to rounding: reading makes quaternions unit ones and degrees radians, again and again.
bool is_same(const nlohmann::ordered_json& a, const nlohmann::ordered_json& b) {
  if (a.is_number() && b.is_number()) {
    const double x = a.get<double>(), y = b.get<double>();
    return x == y || std::abs(x - y) <= 1e-9 * std::max(std::abs(x), std::abs(y)) + 1e-15;
  }
  if (a.type() != b.type() || a.size() != b.size()) return false;
  if (a.is_array()) return std::equal(a.begin(), a.end(), b.begin(), is_same);
  if (!a.is_object()) return a == b;
  for (const auto& [key, value] : a.items())
    if (!b.contains(key) || !is_same(value, b.at(key))) return false;
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check_explain(text);
  check_why(text);
  const auto query = belief::query_from_json(text);
  if (!query) {
    PRESCENE_CHECK(!query.status().message().empty());
    return 0;
  }
  const auto again = belief::query_from_json(belief::to_json(*query).dump());
  PRESCENE_CHECK_MSG(again.ok(), again.status().message());
  PRESCENE_CHECK(again->what.index() == query->what.index());
  PRESCENE_CHECK(is_same(belief::to_json(*again), belief::to_json(*query)));
  return 0;
}
