// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/outside_json.h"

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "prescene/belief/json.h"

namespace prescene::service {
namespace {

// Bytes: what is refused for its long id is still reported to whoever sent it, unless that were a burden.
constexpr std::size_t kLongestIdKept = 4096;

}  // namespace

nlohmann::ordered_json parse_or_discard(std::string_view text, std::size_t most_bytes) {
  auto document = belief::parse_json(text, most_bytes);
  return document ? *std::move(document) : nlohmann::ordered_json(nlohmann::ordered_json::value_t::discarded);
}

bool is_stamp(const nlohmann::ordered_json& value) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max() / 2;
  return value.is_number_unsigned() && value.get<std::uint64_t>() <= kMost;
}

std::string id_of(std::string_view text) { return id_of_document(parse_or_discard(text)); }

std::string id_of_document(const nlohmann::ordered_json& document) {
  if (!document.is_object()) return "";
  const auto id = document.find("id");
  if (id == document.end() || !id->is_string()) return "";
  const auto& text = id->get_ref<const std::string&>();
  return text.size() <= kLongestIdKept ? text : "";
}

bool is_so_far(const nlohmann::ordered_json& answer) {
  if (!answer.is_object()) return false;
  const auto final = answer.find("final");
  return final != answer.end() && final->is_boolean() && !final->get<bool>();
}

bool text_is_so_far(std::string_view answer_text) {
  // Looked for first, as most answers are others and need not be parsed.
  return answer_text.find("\"final\"") != std::string_view::npos && is_so_far(parse_or_discard(answer_text));
}

}  // namespace prescene::service
