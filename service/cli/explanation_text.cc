// SPDX-License-Identifier: Apache-2.0
#include "explanation_text.h"

#include <nlohmann/json.hpp>

#include "prescene/belief/event.h"
#include "prescene/core/text.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using nlohmann::ordered_json;

// Less probable events are left out of the table, but for the first ones.
constexpr double kWorthARow = 0.0005;
constexpr std::size_t kFirstRows = 2;

/// "2.31 (2.28 to 2.35)"; "" where it is not there.
std::string value_text(const ordered_json& explanation, const char* key, int decimals) {
  const auto value = explanation.find(key);
  if (value == explanation.end()) return "";
  return fixed_text(value->at("mean").get<double>(), decimals) + " (" +
         fixed_text(value->at("interval").at(0).get<double>(), decimals) + " to " +
         fixed_text(value->at("interval").at(1).get<double>(), decimals) + ")";
}

std::string percent_text_of(const ordered_json& value, int decimals) {
  return fixed_text(100.0 * value.get<double>(), decimals);
}

/// " (gone already)" of what the belief held to be there when the window began; " (there already)" the other way round.
std::string at_start_text(const ordered_json& explanation) {
  const auto present = explanation.find("present_at_start");
  if (present == explanation.end()) return "";
  return present->get<bool>() ? " (there already)" : " (gone already)";
}

}  // namespace

ExplanationTables explanation_tables(const ordered_json& explained) {
  ExplanationTables tables;
  tables.events = {{"event", "object", "probability, %", "interval, %", "log Bayes factor", "time, s", "towards, deg",
                    "speed, m/s", "tips, %", "falls, %"}};
  for (const ordered_json& e : explained.at("explanations")) {
    if (e.at("probability").get<double>() < kWorthARow && tables.events.size() > 1 + kFirstRows) continue;
    const std::string partner = e.value("partner", "");
    const auto effects = e.find("effects");
    tables.events.push_back(
        {e.value("event", "") + at_start_text(e), e.value("object", "") + (partner.empty() ? "" : ", " + partner),
         percent_text_of(e.at("probability"), 1),
         percent_text_of(e.at("interval").at(0), 1) + " to " + percent_text_of(e.at("interval").at(1), 1),
         fixed_text(e.value("log_bayes_factor", 0.0), 1), value_text(e, "time", 2), value_text(e, "towards_deg", 0),
         value_text(e, "speed", 2), effects != e.end() ? percent_text_of(effects->at("tips"), 0) : "",
         effects != e.end() ? percent_text_of(effects->at("falls"), 0) : ""});
  }
  tables.places = {{"object", "there, %", "at the end, m", "90 % within, cm", ""}};
  for (const ordered_json& object : explained.at("objects")) {
    const auto& p = object.at("mean");
    tables.places.push_back({object.value("object", ""), percent_text_of(object.at("present"), 0),
                             fixed_text(p.at(0).get<double>(), 3) + ", " + fixed_text(p.at(1).get<double>(), 3) + ", " +
                                 fixed_text(p.at(2).get<double>(), 3),
                             percent_text_of(object.at("radius_90"), 1),
                             object.value("out_of_sight", false) ? "out of sight" : ""});
  }
  // Against itself, that nothing happened is worth 0 in every frame.
  const ordered_json& events = explained.at("explanations");
  const bool something =
      !events.empty() && events.front().value("event", "") != belief::name_of(belief::EventKind::kNothing);
  const ordered_json& frames = explained.at("frames");
  const bool several = !frames.empty() && frames.front().contains("camera");
  tables.frames = {{"frame, s", "against the second, nats"}};
  if (several) tables.frames.front().push_back("camera");
  if (something) tables.frames.front().insert(tables.frames.front().begin() + 1, "against nothing, nats");
  for (const ordered_json& frame : frames) {
    std::vector<std::string>& row = tables.frames.emplace_back();
    row.push_back(fixed_text(frame.value("time", 0.0), 2));
    if (something) row.push_back(fixed_text(frame.value("against_nothing", 0.0), 1));
    row.push_back(fixed_text(frame.value("against_second", 0.0), 1));
    if (several) row.push_back(frame.value("camera", ""));
  }
  return tables;
}

std::string explanation_work_text(const ordered_json& explained) {
  return std::to_string(explained.value("weighed_instances", 0)) + " instances weighed, " +
         std::to_string(explained.value("simulated_instances", 0)) + " simulated, in " +
         fixed_text(explained.value("wall_seconds", 0.0), 1) + " s";
}

std::string explanation_text(const ordered_json& explained) {
  const ExplanationTables tables = explanation_tables(explained);
  std::string text = explained.value("text", "") + "\n";
  for (const auto* rows : {&tables.events, &tables.places, &tables.frames}) text += "\n" + table(*rows);
  for (const std::string& remark : explained.value("remarks", std::vector<std::string>{})) text += remark + "\n";
  return text + explanation_work_text(explained) + "\n";
}

}  // namespace prescene::service
