// SPDX-License-Identifier: Apache-2.0
// JSON that questions about frames that were seen have in common: their window, their effort, and what is
// around their key.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "json_values.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"

namespace prescene::belief {

inline constexpr std::size_t kLongestFramesQuestion = std::size_t{1} << 16;  // bytes

/// The keys `from` and `to`, or `last`, s: of what frames a question is asked.
struct WindowFields {
  std::optional<double> from, to, last;
};
/// `at`: the object of these fields, where an error about several of them is.
WindowFields read_window(const JsonAt& at, JsonObject& fields);
void write_window(const WindowFields& window, Json& asked);
/// The key `effort`: wall time, s.
std::optional<double> read_max_seconds(JsonObject& fields);
/// Whether a text is a question about frames that were seen, with this key.
bool asks_of_frames(std::string_view json, std::string_view key);
/// Such a question: its `id` and `stream`, and what `read(JsonAt, Question&)` takes from its key.
template <class Question, class Read>
core::Result<Question> question_of_frames(std::string_view json, const std::string& key, Read read) {
  PRESCENE_TRY(const Json document, parse_json(json, kLongestFramesQuestion));
  JsonErrors errors;
  Question question;
  {
    JsonObject object({document, "", errors});
    if (const auto id = object.find("id")) {
      question.id = id->text();
      if (question.id.size() > kLongestId)
        id->fail("the text has " + std::to_string(question.id.size()) + " bytes: give at most " +
                 std::to_string(kLongestId));
    }
    if (const auto stream = object.find("stream")) question.stream = stream->boolean();
    if (const auto asked = object.require(key)) read(*asked, question);
  }
  if (!errors.ok()) return errors.status();
  return question;
}

/// What question_of_frames reads: `asked` under its key, with the effort.
template <class Question>
Json json_of_frames_question(const Question& question, const char* key, Json asked) {
  if (question.max_seconds) asked["effort"] = {{"max_seconds", *question.max_seconds}};
  Json json = Json::object();
  if (!question.id.empty()) json["id"] = question.id;
  if (question.stream) json["stream"] = true;
  json[key] = std::move(asked);
  return json;
}

}  // namespace prescene::belief
