// SPDX-License-Identifier: Apache-2.0
// JSON of the question why a pose is believed, both ways.
#include "json_values.h"
#include "prescene/belief/explain_question.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/belief/validation.h"
#include "prescene/belief/why_question.h"

namespace prescene::belief {
namespace {

constexpr std::size_t kLongestWhyQuestion = std::size_t{1} << 16;

void read_against(const JsonAt& at, WhyQuestion& question) {
  if (at.value.is_object()) {
    question.against = WhyAgainst::kPose;
    question.X_WO = pose_from(at);
    if (const core::Status possible = check_pose(*question.X_WO); !possible.ok()) at.fail(possible.message());
    return;
  }
  const std::string word = at.value.is_string() ? at.text() : "";
  if (word == name_of(WhyAgainst::kAbsence))
    question.against = WhyAgainst::kAbsence;
  else if (word == name_of(WhyAgainst::kAlternative))
    question.against = WhyAgainst::kAlternative;
  else
    at.fail("give \"absence\", \"alternative\" or a pose {\"position\": [x, y, z], \"rotation\": {...}}");
}

void read_why(const JsonAt& at, WhyQuestion& question) {
  JsonObject fields(at);
  if (const auto name = fields.require("object")) {
    question.object = name->text();
    if (question.object.empty() || question.object.size() > kLongestName)
      name->fail("the name has " + std::to_string(question.object.size()) + " bytes: give 1 to " +
                 std::to_string(kLongestName));
  }
  if (const auto against = fields.find("against")) read_against(*against, question);
  question.from = read_number(fields, "from", kWindowEnds);
  question.to = read_number(fields, "to", kWindowEnds);
  question.last = read_number(fields, "last", kWindowSeconds);
  if (question.from.has_value() != question.to.has_value())
    at.fail("'from' and 'to' go together: give both, or 'last'");
  else if (question.from && question.last)
    at.fail("'last' and 'from' are two windows: give one of them");
  else if (question.from && !(*question.from < *question.to))
    at.fail("'from' is not before 'to': exchange them");
  if (const auto images = fields.find("images")) question.images = static_cast<int>(images->integer(0, kMostWhyImages));
  if (const auto effort = fields.find("effort")) {
    JsonObject limits(*effort);
    question.max_seconds = read_number(limits, "max_seconds", kWallSeconds);
  }
}

}  // namespace

const char* name_of(WhyAgainst against) {
  switch (against) {
    case WhyAgainst::kAbsence:
      return "absence";
    case WhyAgainst::kAlternative:
      return "alternative";
    case WhyAgainst::kPose:
      return "pose";
    case WhyAgainst::kAbsenceAndAlternative:
      break;
  }
  return "";
}

bool asks_why(std::string_view json) {
  // Looked for first, as most questions are others and need not be parsed twice.
  // A backslash may write the key in another way.
  if (json.find("\"why\"") == std::string_view::npos && json.find('\\') == std::string_view::npos) return false;
  const auto document = parse_json(json, kLongestWhyQuestion);
  return document && document->is_object() && document->contains("why");
}

core::Result<WhyQuestion> why_question_from_json(std::string_view json) {
  PRESCENE_TRY(const Json document, parse_json(json, kLongestWhyQuestion));
  JsonErrors errors;
  WhyQuestion question;
  {
    JsonObject object({document, "", errors});
    if (const auto id = object.find("id")) {
      question.id = id->text();
      if (question.id.size() > kLongestId)
        id->fail("the text has " + std::to_string(question.id.size()) + " bytes: give at most " +
                 std::to_string(kLongestId));
    }
    if (const auto stream = object.find("stream")) question.stream = stream->boolean();
    if (const auto asked = object.require("why")) read_why(*asked, question);
  }
  if (!errors.ok()) return errors.status();
  return question;
}

Json to_json(const WhyQuestion& question) {
  Json asked = {{"object", question.object}};
  if (question.against == WhyAgainst::kPose && question.X_WO)
    asked["against"] = to_json(*question.X_WO);
  else if (question.against != WhyAgainst::kAbsenceAndAlternative)
    asked["against"] = name_of(question.against);
  if (question.from && question.to) {
    asked["from"] = *question.from;
    asked["to"] = *question.to;
  } else if (question.last) {
    asked["last"] = *question.last;
  }
  asked["images"] = question.images;
  if (question.max_seconds) asked["effort"] = {{"max_seconds", *question.max_seconds}};
  Json json = Json::object();
  if (!question.id.empty()) json["id"] = question.id;
  if (question.stream) json["stream"] = true;
  json["why"] = std::move(asked);
  return json;
}

}  // namespace prescene::belief
