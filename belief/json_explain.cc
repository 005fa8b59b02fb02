// SPDX-License-Identifier: Apache-2.0
// JSON of the question what happened, both ways.
#include "json_frames_question.h"
#include "prescene/belief/explain_question.h"
#include "prescene/belief/query_limits.h"

namespace prescene::belief {
namespace {

constexpr ScalarRange kHalfWidths{1e-3, 0.5, "give a half width between 0.001 and 0.5, like 0.05"};

void read_count(JsonObject& fields, const std::string& key, int low, int high, int& to) {
  if (const auto at = fields.find(key)) to = static_cast<int>(at->integer(low, high));
}

void read_fields(const JsonAt& at, ExplainQuestion& question) {
  JsonObject fields(at);
  if (const auto name = fields.find("object")) {
    question.object = name->text();
    if (question.object.size() > kLongestName)
      name->fail("the name has " + std::to_string(question.object.size()) + " bytes: give at most " +
                 std::to_string(kLongestName));
  }
  const WindowFields window = read_window(at, fields);
  question.from = window.from;
  question.to = window.to;
  question.last = window.last.value_or(question.last);
  read_count(fields, "frames", 2, 64, question.frames);
  read_count(fields, "runs", 2, 64, question.runs);
  read_count(fields, "points", 8, 4096, question.points);
  question.half_width = read_number(fields, "half_width", kHalfWidths).value_or(question.half_width);
  if (const auto seed = fields.find("seed")) question.seed = seed->unsigned_integer();
  if (const auto change = fields.find("change")) question.change = change->boolean();
  if (const auto wanted = fields.find("wanted")) {
    question.change = true;
    if (wanted->value.is_string()) {
      question.wanted_name = wanted->text();
      if (question.wanted_name.empty()) wanted->fail("the name is empty: give an outcome of the scene, or a predicate");
    } else if (wanted->value.is_object()) {
      // As one of a list of outcomes.
      Json list = Json::array({wanted->value});
      if (!list[0].contains("name")) list[0]["name"] = "wanted";
      const std::vector<Outcome> outcomes = outcomes_from({list, wanted->path, wanted->errors}, question.object);
      if (!outcomes.empty()) question.wanted = outcomes.front();
    } else {
      wanted->fail("an outcome's name or an outcome {...} is needed, not " + wanted->type());
    }
  }
  question.max_seconds = read_max_seconds(fields);
}

}  // namespace

bool asks_to_explain(std::string_view json) { return asks_of_frames(json, "explain"); }

core::Result<ExplainQuestion> explain_question_from_json(std::string_view json) {
  return question_of_frames<ExplainQuestion>(json, "explain", read_fields);
}

Json to_json(const ExplainQuestion& question) {
  Json asked = Json::object();
  if (!question.object.empty()) asked["object"] = question.object;
  write_window({question.from, question.to, question.last}, asked);
  asked["frames"] = question.frames;
  asked["runs"] = question.runs;
  asked["points"] = question.points;
  asked["half_width"] = question.half_width;
  asked["seed"] = question.seed;
  if (question.change) asked["change"] = true;
  if (!question.wanted_name.empty()) asked["wanted"] = question.wanted_name;
  if (question.wanted) asked["wanted"] = to_json(*question.wanted);
  return json_of_frames_question(question, "explain", std::move(asked));
}

}  // namespace prescene::belief
