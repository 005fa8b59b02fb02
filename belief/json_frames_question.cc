// SPDX-License-Identifier: Apache-2.0
#include "json_frames_question.h"

#include "prescene/belief/explain_question.h"

namespace prescene::belief {

WindowFields read_window(const JsonAt& at, JsonObject& fields) {
  WindowFields window;
  window.from = read_number(fields, "from", kWindowEnds);
  window.to = read_number(fields, "to", kWindowEnds);
  window.last = read_number(fields, "last", kWindowSeconds);
  if (window.from.has_value() != window.to.has_value())
    at.fail("'from' and 'to' go together: give both, or 'last'");
  else if (window.from && window.last)
    at.fail("'last' and 'from' are two windows: give one of them");
  else if (window.from && !(*window.from < *window.to))
    at.fail("'from' is not before 'to': exchange them");
  return window;
}

void write_window(const WindowFields& window, Json& asked) {
  if (window.from && window.to) {
    asked["from"] = *window.from;
    asked["to"] = *window.to;
  } else if (window.last) {
    asked["last"] = *window.last;
  }
}

std::optional<double> read_max_seconds(JsonObject& fields) {
  const auto effort = fields.find("effort");
  if (!effort) return std::nullopt;
  JsonObject limits(*effort);
  return read_number(limits, "max_seconds", kWallSeconds);
}

bool asks_of_frames(std::string_view json, std::string_view key) {
  // Looked for first, as most questions are others and need not be parsed twice. A backslash may write the key in
  // another way.
  const std::string quoted = '"' + std::string(key) + '"';
  if (json.find(quoted) == std::string_view::npos && json.find('\\') == std::string_view::npos) return false;
  const auto document = parse_json(json, kLongestFramesQuestion);
  return document && document->is_object() && document->contains(key);
}

}  // namespace prescene::belief
