// SPDX-License-Identifier: Apache-2.0
// JSON of the question why a pose is believed, both ways.
#include "json_frames_question.h"
#include "prescene/belief/explain_question.h"
#include "prescene/belief/query_limits.h"
#include "prescene/belief/validation.h"
#include "prescene/belief/why_question.h"

namespace prescene::belief {
namespace {

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
  const WindowFields window = read_window(at, fields);
  question.from = window.from;
  question.to = window.to;
  question.last = window.last;
  if (const auto images = fields.find("images")) question.images = static_cast<int>(images->integer(0, kMostWhyImages));
  question.max_seconds = read_max_seconds(fields);
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

bool asks_why(std::string_view json) { return asks_of_frames(json, "why"); }

core::Result<WhyQuestion> why_question_from_json(std::string_view json) {
  return question_of_frames<WhyQuestion>(json, "why", read_why);
}

Json to_json(const WhyQuestion& question) {
  Json asked = {{"object", question.object}};
  if (question.against == WhyAgainst::kPose && question.X_WO)
    asked["against"] = to_json(*question.X_WO);
  else if (question.against != WhyAgainst::kAbsenceAndAlternative)
    asked["against"] = name_of(question.against);
  write_window({question.from, question.to, question.last}, asked);
  asked["images"] = question.images;
  return json_of_frames_question(question, "why", std::move(asked));
}

}  // namespace prescene::belief
