// SPDX-License-Identifier: Apache-2.0
#include "relations_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "prescene/belief/observed_timeline.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "verb.h"

namespace prescene::service {
namespace {

using Json = nlohmann::ordered_json;
using core::fixed_text;

/// Less probable relations are left to --json.
constexpr double kLeastShown = 0.05;

std::string in_brackets(const Json& relation) { return " (" + fixed_text(relation.value("probability", 0.0), 2) + ")"; }

/// "a, b and c".
std::string listed(const std::vector<std::string>& parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return text;
}

/// The relations of one object, as text.
class ObjectRelations {
 public:
  ObjectRelations(const Json& relations, std::string object) : relations_(relations), object_(std::move(object)) {}

  /// "the table (0.98) and the tray (0.40)": the others of these relations, likely ones; "" = none.
  std::string others(const std::string& word, bool is_subject = true) {
    std::vector<std::string> parts;
    for (const Json& relation : relations_) {
      if (relation.value("relation", "") != word || relation.value("probability", 0.0) < kLeastShown) continue;
      if (relation.value(is_subject ? "subject" : "other", "") != object_) continue;
      const std::string other = relation.value(is_subject ? "other" : "subject", "");
      reported_.push_back(other);
      parts.push_back("the " + other + in_brackets(relation));
    }
    return listed(parts);
  }
  /// What it touches, besides what was reported already.
  std::string touched() const {
    std::vector<std::string> parts;
    for (const Json& relation : relations_) {
      if (relation.value("relation", "") != "touches" || relation.value("probability", 0.0) < kLeastShown) continue;
      const std::string first = relation.value("subject", ""), second = relation.value("other", "");
      if (first != object_ && second != object_) continue;
      const std::string& other = first == object_ ? second : first;
      if (std::ranges::find(reported_, other) == reported_.end())
        parts.push_back("the " + other + in_brackets(relation));
    }
    return listed(parts);
  }
  /// Of one thing; null = not judged.
  const Json* alone(const std::string& word) const {
    for (const Json& relation : relations_)
      if (relation.value("relation", "") == word && relation.value("subject", "") == object_) return &relation;
    return nullptr;
  }

 private:
  const Json& relations_;
  std::string object_;
  std::vector<std::string> reported_;
};

std::string object_text(const Json& relations, const Json& item) {
  const std::string object = item.value("object", "");
  ObjectRelations of_object(relations, object);
  const std::string on = of_object.others("on"), in = of_object.others("in");
  std::string text =
      "The " + object + " is on " + (on.empty() ? "nothing" : on) + " and in " + (in.empty() ? "nothing" : in) + ".";
  if (const std::string hand = of_object.others("holds", false); !hand.empty()) text += " It is held by " + hand + ".";
  if (const std::string borne = of_object.others("supports"); !borne.empty()) text += " It bears " + borne + ".";
  if (const std::string touched = of_object.touched(); !touched.empty()) text += " It touches " + touched + ".";
  std::vector<std::string> alone;
  const auto add = [&](const char* word, const std::string& is, const std::string& is_not) {
    const Json* relation = of_object.alone(word);
    if (!relation) return;
    const bool holds = relation->value("probability", 0.0) >= 0.5;
    std::string with = fixed_text(relation->value("probability", 0.0), 2);
    if (relation->contains("share") && holds)
      with += "; " + fixed_text(100.0 * relation->value("share", 0.0), 0) + " % of what faces the camera";
    alone.push_back((holds ? is : is_not) + " (" + with + ")");
  };
  add("upright", "upright", "not upright");
  add("visible", "visible", "hidden");
  add("within_reach", "within reach", "out of reach");
  if (!alone.empty()) text += " It is " + listed(alone) + ".";
  return text + "\n";
}

std::string pattern_text(const Json& interval) {
  const std::string other = interval.value("other", "");
  return interval.value("relation", "") + " " + interval.value("subject", "") + (other.empty() ? "" : " " + other);
}

std::string interval_text(const Json& interval) {
  const bool began = interval.value("began_before", false), goes_on = interval.value("goes_on", false);
  return pattern_text(interval) + " [" + (began ? "from " : "") + fixed_text(interval.value("begin", 0.0), 2) + ", " +
         fixed_text(interval.value("end", 0.0), 2) + (goes_on ? " and on" : "") + ")";
}

}  // namespace

void add_timeline_options(CLI::App& verb, TimelineOptions& options) {
  verb.add_option("--interval", options.first,
                  "Of the timeline: intervals, as 'touches carton mug' or 'falls carton'; * is anything")
      ->check(utf8_text());
  verb.add_option("--other", options.second, "Of the timeline: intervals to compare these with")->check(utf8_text());
  verb.add_option("--relation", options.relations,
                  "Of the timeline: how --interval lies to --other (before, meets, overlaps, starts, during, "
                  "finishes, equals, and *_by, contains, after); repeatable; default: any")
      ->check(utf8_text());
}

core::Result<Json> timeline_question(const TimelineOptions& options) {
  Json timeline = Json::object();
  if (options.first.empty() && !(options.second.empty() && options.relations.empty()))
    return core::invalid_input("--other and --relation need --interval: give it, too");
  const auto add = [&](const char* key, const char* option, const std::string& text) -> core::Status {
    if (text.empty()) return {};
    timeline[key] = text;
    return belief::pattern_from_text(text).status().at(option);
  };
  PRESCENE_RETURN_IF_ERROR(add("first", "--interval", options.first));
  PRESCENE_RETURN_IF_ERROR(add("second", "--other", options.second));
  if (!options.relations.empty()) timeline["relation"] = options.relations;
  return Json{{"timeline", std::move(timeline)}};
}

core::Result<Json> relations_question(const std::string& object, const std::string& reach) {
  Json relations = Json::object();
  if (!object.empty()) relations["object"] = object;
  if (reach.empty()) return Json{{"relations", std::move(relations)}};
  const std::size_t colon = reach.rfind(':');
  double radius = 0.0;
  core::Status form = core::invalid_input("--reach " + reach +
                                          ": give a point or a robot body and metres, as 0.4,0,0.9:0.8 or hand:0.8");
  if (colon == std::string::npos || colon == 0 || !interfaces::parse_number(reach.substr(colon + 1), &radius))
    return form;
  const std::string of = reach.substr(0, colon);
  relations["reach"]["of"] = of;
  if (of.find(',') != std::string::npos) {
    Json point = Json::array();
    for (std::size_t begin = 0; begin <= of.size();) {
      const std::size_t end = std::min(of.find(',', begin), of.size());
      double number = 0.0;
      if (!interfaces::parse_number(of.substr(begin, end - begin), &number)) return form;
      point.push_back(number);
      begin = end + 1;
    }
    if (point.size() != 3) return form;
    relations["reach"]["of"] = std::move(point);
  }
  relations["reach"]["radius"] = radius;
  return Json{{"relations", std::move(relations)}};
}

std::string relations_text(const Json& answer) {
  std::string text;
  for (const Json& item : answer.at("objects")) text += object_text(answer.at("relations"), item);
  text += "from " + counted(answer.value("draws", std::size_t{0}), "draw") + "; --json has the intervals\n";
  for (const std::string& remark : answer.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text;
}

std::string timeline_text(const Json& answer) {
  const Json& intervals = answer.at("intervals");
  std::string text = "observed from " + fixed_text(answer.value("from", 0.0), 2) + " to " +
                     fixed_text(answer.value("to", 0.0), 2) + " s, in " +
                     counted(answer.value("frames", std::size_t{0}), "frame") + "\n";
  const auto note = [&](const char* key, const char* thing, const std::string& what) {
    if (const auto count = answer.value(key, std::size_t{0}); count > 0) text += counted(count, thing) + what + "\n";
  };
  if (const auto pairs = answer.find("pairs"); pairs != answer.end()) {
    if (pairs->empty()) text += "No two intervals lie so.\n";
    for (const Json& pair : *pairs)
      text += interval_text(intervals.at(pair.value("first", std::size_t{0}))) + " " + pair.value("relation", "") +
              " " + interval_text(intervals.at(pair.value("second", std::size_t{0}))) + in_brackets(pair) +
              (pair.value("may_change", false) ? ", so far" : "") + "\n";
  } else {
    if (intervals.empty()) text += "No such interval.\n";
    for (const Json& interval : intervals) text += interval_text(interval) + in_brackets(interval) + "\n";
  }
  note("skipped_frames", "frame", " between them not looked at, as they came too fast");
  note("failed_frames", "frame", " without an answer, the last because: " + answer.value("last_failure", ""));
  note("forgotten", "interval", " forgotten for want of room");
  return text;
}

}  // namespace prescene::service
