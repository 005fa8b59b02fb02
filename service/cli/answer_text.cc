// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "achieve_options.h"
#include "explanation_text.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "relations_options.h"
#include "verb.h"
#include "view_options.h"
#include "why_options.h"

namespace prescene::service {
namespace {

using core::fixed_text;

std::string interval(const nlohmann::ordered_json& p) {
  const auto limits = p.value("interval", std::vector<double>{0.0, 1.0});
  return fixed_text(p.value("probability", 0.0), 3) + " (" + fixed_text(limits.at(0), 3) + " to " +
         fixed_text(limits.at(1), 3) + ")";
}

/// What a probability rests on: few instances, wide intervals.
std::string basis(const nlohmann::ordered_json& answer) {
  std::string text = "from " + counted(answer.value("instances", std::size_t{0}), "instance") + ", " +
                     fixed_text(answer.value("wall_seconds", 0.0), 1) + " s\n";
  for (const std::string& remark : answer.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text;
}

/// The document without pictures and other long texts: whoever wants them takes --json.
void leave_out_long_texts(nlohmann::ordered_json& document) {
  constexpr std::size_t kLongest = 400;
  if (document.is_string() && document.get_ref<const std::string&>().size() > kLongest)
    document = counted(document.get_ref<const std::string&>().size(), "byte") + ", with --json";
  else if (document.is_structured())
    for (nlohmann::ordered_json& part : document) leave_out_long_texts(part);
}

std::string document_text(nlohmann::ordered_json document) {
  leave_out_long_texts(document);
  return belief::json_text(document, 2) + "\n";
}

/// What was learned of an object's physical parameters, a line each; "" = nothing was.
std::string learned_text(const nlohmann::ordered_json& item) {
  const int lessons = item.value("lessons", 0);
  if (lessons == 0 || !item.contains("parameters")) return "";
  std::string text;
  for (const auto& parameter : item.at("parameters"))
    text += "  " + parameter.value("name", "") + " " + fixed_text(parameter.value("mean", 0.0), 3) + " +- " +
            fixed_text(parameter.value("standard_deviation", 0.0), 3) +
            " (90 %: " + fixed_text(parameter.value("low", 0.0), 3) + " to " +
            fixed_text(parameter.value("high", 0.0), 3) + ")\n";
  std::string when;  // not given by a service of another version
  if (const auto learned = item.find("learned_s"); learned != item.end() && learned->is_number())
    when = learned->get<double>() < 0.0 ? ", the last in an earlier session"
                                        : ", the last at " + fixed_text(learned->get<double>(), 1) + " s";
  return item.value("object", "") + ", learned from " + counted(static_cast<std::size_t>(lessons), "motion") + when +
         ":\n" + text;
}

/// Where else an object may be, a line each; "" = nowhere.
std::string alternatives_text(const nlohmann::ordered_json& item) {
  std::string text;
  const auto alternatives = item.find("alternatives");
  if (alternatives == item.end()) return text;  // of a service of another version
  const auto mean = belief::pose_from_json(item.at("estimate").at("mean"));
  for (const auto& other : *alternatives) {
    const auto pose = belief::pose_from_json(other.at("pose"));
    if (!mean || !pose) continue;
    const double turn = geometry::log_rotation(mean->rotation.conjugate() * pose->rotation).norm();
    text += item.value("object", "") + ", with " + fixed_text(other.value("probability", 0.0), 2) + ": at " +
            fixed_text(pose->translation.x(), 3) + " " + fixed_text(pose->translation.y(), 3) + " " +
            fixed_text(pose->translation.z(), 3) + ", turned by " + fixed_text(turn * geometry::kDegreesPerRadian, 0) +
            " degrees\n";
  }
  return text;
}

/// "slide at 0.213 +- 0.002 m", a line each; "" = there is none.
std::string joints_text(const nlohmann::ordered_json& where) {
  std::string text;
  const auto joints = where.find("joints");
  if (joints == where.end()) return text;
  for (const auto& joint : *joints) {
    const bool hinge = joint.value("unit", "") == "rad";
    const auto number = [&](const char* key) {
      const double value = joint.value(key, 0.0);
      return hinge ? fixed_text(value * geometry::kDegreesPerRadian, 1) : fixed_text(value, 3);
    };
    text += joint.value("joint", "") + " at " + number("position") + " +- " + number("standard_deviation") +
            (hinge ? " degrees" : " m") + "\n";
  }
  return text;
}

std::string impulse_text(const nlohmann::ordered_json& impulse) {
  return impulse.is_number() ? fixed_text(impulse.get<double>(), 3) : "more";
}

/// How hard it may be knocked, and what its removal does; "" = neither was asked for.
std::string stability_detail_text(const nlohmann::ordered_json& stability) {
  std::string text;
  if (const auto margin = stability.find("margin"); margin != stability.end()) {
    const auto& d = margin->at("weakest_direction");
    text += "falls most easily along (" + fixed_text(d.at(0).get<double>(), 2) + " " +
            fixed_text(d.at(1).get<double>(), 2) + " " + fixed_text(d.at(2).get<double>(), 2) + "):";
    for (const auto& fall : margin->at("falls"))
      text += (fall.is_object() && &fall != &margin->at("falls").front() ? ", " : " ") + std::string("in ") +
              fixed_text(100.0 * fall.value("share", 0.0), 0) + " % at " + impulse_text(fall.at("impulse")) + " N s (" +
              impulse_text(fall.at("interval").at(0)) + " to " + impulse_text(fall.at("interval").at(1)) + ")";
    text += "\n";
  }
  if (const auto removal = stability.find("removal"); removal != stability.end()) {
    text += "if it is taken away, the others stay: " + interval(removal->at("others_stay")) + "\n";
    for (const auto& other : removal->at("moves"))
      if (other.value("probability", 0.0) > 0.0)
        text += "  " + other.value("name", "") + " moves: " + interval(other) + "\n";
  }
  return text;
}

std::string short_form(const nlohmann::ordered_json& answer) {
  if (const auto stability = answer.find("stability"); stability != answer.end()) {
    return stability->value("object", "") + " stays as it is: " + interval(stability->at("stable")) + "\n" +
           stability_detail_text(*stability) + basis(*stability);
  }
  if (const auto explain = answer.find("explain"); explain != answer.end()) return explanation_text(*explain);
  if (const auto why = answer.find("why"); why != answer.end()) return why_text(*why);
  if (const auto achieve = answer.find("achieve"); achieve != answer.end()) return achieve_text(*achieve);
  if (const auto relations = answer.find("relations"); relations != answer.end()) return relations_text(*relations);
  if (const auto timeline = answer.find("timeline"); timeline != answer.end()) return timeline_text(*timeline);
  if (const auto next = answer.find("next_view"); next != answer.end()) return next_view_text(*next);
  if (const auto view = answer.find("view"); view != answer.end()) return view_text(*view);
  if (const auto predict = answer.find("predict"); predict != answer.end()) {
    std::vector<std::vector<std::string>> rows = {{"outcome", "group", "probability"}};
    for (const auto& outcome : predict->at("outcomes")) {
      rows.push_back({outcome.value("name", ""), outcome.value("group", ""), interval(outcome)});
    }
    std::string text = table(rows) + basis(*predict);
    if (const auto names = predict->value("left_out", std::vector<std::string>{}); !names.empty()) {
      text += "not judged, as an object that they need is lost or was not found:";
      for (const std::string& name : names) text += " " + name;
      text += "\n";
    }
    return text;
  }
  if (const auto where = answer.find("where"); where != answer.end()) {
    std::vector<std::vector<std::string>> rows = {{"object", "state", "confidence", "position, m"}};
    std::string learned, elsewhere;
    for (const auto& item : where->at("items")) {
      const auto& p = item.at("estimate").at("mean").at("position");
      rows.push_back({item.value("object", ""), item.value("state", ""),
                      fixed_text(item.at("estimate").value("confidence", 0.0), 2),
                      fixed_text(p.at(0).get<double>(), 3) + " " + fixed_text(p.at(1).get<double>(), 3) + " " +
                          fixed_text(p.at(2).get<double>(), 3)});
      learned += learned_text(item);
      elsewhere += alternatives_text(item);
    }
    return table(rows) + elsewhere + joints_text(*where) + learned;
  }
  return document_text(answer);
}

}  // namespace

std::string answer_text(const nlohmann::ordered_json& answer) {
  try {
    const bool nothing_seen = !answer.contains("step") || answer.at("step") == 0;
    return short_form(answer) + (nothing_seen ? "no frame was seen yet: this is what the scene file says\n" : "");
  } catch (const nlohmann::ordered_json::exception&) {  // somebody else's answer, of another form
    return document_text(answer);
  } catch (const std::out_of_range&) {
    return document_text(answer);
  }
}

}  // namespace prescene::service
