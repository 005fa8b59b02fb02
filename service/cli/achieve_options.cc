// SPDX-License-Identifier: Apache-2.0
#include "achieve_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "prescene/belief/action_schema.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> parts_of(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
}

core::Result<double> number_of(const std::string& text, const std::string& place) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    return core::invalid_input(place + ": '" + text + "' is not a number");
  return value;
}

/// "name" and what is behind "=", if anything is.
std::pair<std::string, std::optional<std::string>> named(const std::string& text) {
  const std::size_t sign = text.find('=');
  if (sign == std::string::npos) return {text, std::nullopt};
  return {text.substr(0, sign), text.substr(sign + 1)};
}

core::Status add_free(const std::string& text, Json& free) {
  for (const std::string& part : parts_of(text, ',')) {
    const auto [name, range] = named(part);
    if (name.empty()) return core::invalid_input("--free " + text + ": a name is missing: give some, as position,yaw");
    if (free.contains(name)) return core::invalid_input("--free: '" + name + "' is there twice: name it once");
    free[name] = nullptr;
    if (!range) continue;
    const std::vector<std::string> ends = parts_of(*range, ':');
    if (ends.size() != 2) return core::invalid_input("--free " + part + ": give a range as " + name + "=LOW:HIGH");
    PRESCENE_TRY(const double low, number_of(ends[0], "--free " + part));
    PRESCENE_TRY(const double high, number_of(ends[1], "--free " + part));
    free[name] = {low, high};
  }
  return core::ok_status();
}

core::Status add_fixed(const std::string& text, Json& fixed) {
  for (const std::string& part : parts_of(text, ',')) {
    const auto [name, value] = named(part);
    if (name.empty() || !value) return core::invalid_input("--fix " + part + ": give it as NAME=VALUE");
    if (fixed.contains(name)) return core::invalid_input("--fix: '" + name + "' is there twice: give it once");
    PRESCENE_TRY(const double number, number_of(*value, "--fix " + part));
    fixed[name] = number;
  }
  return core::ok_status();
}

std::string values_text(const Json& values) {
  std::string text;
  for (const auto& [name, value] : values.items())
    text += (text.empty() ? "" : ", ") + name + " " + core::rounded_text(value.get<double>());
  return text;
}

std::string probability_text(const Json& choice) {
  if (choice.value("instances", std::size_t{0}) == 0) return "P not known: no fresh instance was run";
  return "P " + core::fixed_text(choice.value("probability", 0.0), 3) + " (" +
         core::fixed_text(choice.at("interval").at(0).get<double>(), 3) + " to " +
         core::fixed_text(choice.at("interval").at(1).get<double>(), 3) + "), " +
         counted(choice.value("instances", std::size_t{0}), "fresh instance");
}

std::string percent_text(double share) { return core::fixed_text(100.0 * share, 1) + " %"; }

/// The map as letters, for terminals: 10 steps of a share, '#' for what is in the way.
std::string map_text(const Json& map, const Json& parameters) {
  const auto nx = map.at("nx").get<std::size_t>(), ny = map.at("ny").get<std::size_t>();
  const auto range_text = [&](const std::string& name) {
    for (const auto& parameter : parameters)
      if (parameter.value("name", "") == name)
        return name + " from " + core::rounded_text(parameter.at("range").at(0).get<double>()) + " to " +
               core::rounded_text(parameter.at("range").at(1).get<double>()) + " " + parameter.value("unit", "");
    return name;
  };
  std::string text = "Share of instances with the outcome (0 to 9, * = all, # = something is in the way):\n";
  for (std::size_t row = 0; row < ny; ++row) {
    text += "  ";
    for (std::size_t ix = 0; ix < nx; ++ix) {
      const double share = map.at("share").at((ny - 1 - row) * nx + ix).get<double>();
      text += share < 0.0 ? '#' : share >= 1.0 ? '*' : static_cast<char>('0' + static_cast<int>(10.0 * share));
    }
    text += "\n";
  }
  return text + "  to the right " + range_text(map.value("x", "")) + ", upwards " + range_text(map.value("y", "")) +
         "\n";
}

}  // namespace

void add_achieve_options(CLI::App& verb, AchieveOptions& options) {
  std::string actions;
  for (const belief::ActionSchema& schema : belief::action_schemas())
    actions += (actions.empty() ? "" : ", ") + schema.name;
  verb.add_option("--action", options.action, "What is done: " + actions)->check(utf8_text())->capture_default_str();
  verb.add_option("--object", options.object, "That it is done with; default: the one that is held")
      ->check(utf8_text());
  verb.add_option("--support", options.support,
                  "What an object is placed above; default: the one that the outcome names")
      ->check(utf8_text());
  verb.add_option("--free", options.free,
                  "Parameters to choose, as position,yaw or height=0:0.1 (NAME=LOW:HIGH); may be given several times")
      ->check(utf8_text());
  verb.add_option("--fix", options.fixed, "Other parameters, as height=0.01; may be given several times")
      ->check(utf8_text());
  verb.add_option("--position-error", options.position_error,
                  "Standard deviation of where an object is placed, m, along each axis")
      ->check(number_between(0.0, 10.0));
  verb.add_option("--rotation-error", options.rotation_error,
                  "The same of how it is turned, degrees about each of its axes")
      ->check(number_between(0.0, 180.0));
  verb.add_option("--delay", options.delay, "Of all but a place: how late it begins, s; the mean")
      ->check(number_between(0.0, 3600.0));
  verb.add_option("--delay-error", options.delay_error, "Standard deviation of the delay, s")
      ->check(number_between(0.0, 3600.0));
  verb.add_option("--lateral-error", options.lateral_error, "Standard deviation of a push's line to its left, m")
      ->check(number_between(0.0, 10.0));
  verb.add_option("--probability", options.probability, "That the outcome is to have; default 0.95")
      ->check(in_range(belief::kWantedProbabilities));
  verb.add_option("--confidence", options.confidence, "Of what is claimed, and of the intervals; default 0.95")
      ->check(in_range(belief::kConfidences));
  verb.add_option("--max-instances", options.max_instances, "Most simulated instances of the search; default 8192")
      ->check(CLI::Range(1, belief::kMostInstances));
  verb.add_option("--max-seconds", options.max_seconds,
                  "Wall time, s, after which no more instances begin; the answer then depends on the machine's speed")
      ->check(in_range(belief::kWallSeconds));
  verb.add_option("--duration", options.duration, "Longest simulated time, s; default: the scene's, of ask stability 3")
      ->check(in_range(belief::kDurations));
  verb.add_flag("--first", options.first_only,
                "End with the first certified choice: without the most robust one, the map and the reasons");
}

core::Result<nlohmann::ordered_json> achieve_question(const AchieveOptions& options) {
  if (options.outcome.empty()) return core::invalid_input("--outcome: name the outcome that is wanted");
  if (options.free.empty()) return core::invalid_input("--free: name the parameters to choose, as --free position,yaw");
  Json free = Json::object(), fixed = Json::object(), errors = Json::object(), effort = Json::object();
  for (const std::string& text : options.free) PRESCENE_RETURN_IF_ERROR(add_free(text, free));
  for (const std::string& text : options.fixed) PRESCENE_RETURN_IF_ERROR(add_fixed(text, fixed));
  if (options.position_error) errors["position"] = *options.position_error;
  if (options.rotation_error) errors["rotation_deg"] = *options.rotation_error;
  if (options.delay_error)
    errors["delay"] = {{"normal", {options.delay.value_or(0.0), *options.delay_error}}, {"min", 0.0}};
  else if (options.delay)
    errors["delay"] = *options.delay;
  if (options.lateral_error) errors["lateral_error"] = {{"normal", {0.0, *options.lateral_error}}};
  if (options.confidence) effort["confidence"] = *options.confidence;
  if (options.max_instances) effort["max_instances"] = *options.max_instances;
  if (options.max_seconds) effort["max_seconds"] = *options.max_seconds;
  Json achieve = {{"outcome", options.outcome}, {"action", options.action}};
  if (!options.object.empty()) achieve["object"] = options.object;
  if (!options.support.empty()) achieve["support"] = options.support;
  achieve["free"] = std::move(free);
  achieve["fixed"] = std::move(fixed);
  achieve["errors"] = std::move(errors);
  if (options.probability) achieve["probability"] = *options.probability;
  achieve["survey"] = !options.first_only;
  if (options.duration) achieve["duration"] = *options.duration;
  achieve["effort"] = std::move(effort);
  return Json{{"achieve", std::move(achieve)}};
}

std::string achieve_text(const Json& answer) {
  const Json& best = answer.at("best");
  const bool found = answer.value("found", false);
  std::string text = answer.value("action", "") + " " + answer.value("object", "") +
                     (answer.value("support", "").empty() ? "" : " above " + answer.value("support", "")) +
                     ", so that " + answer.value("outcome", "") + ": ";
  const std::string wanted = "P >= " + core::rounded_text(answer.value("wanted", 0.0)) + " at " +
                             core::rounded_text(100.0 * answer.value("confidence", 0.0)) + " % confidence";
  if (!best.at("values").empty()) {
    // Not more than the search can know: it may have ended before it tested what it found.
    const std::string stopped = answer.value("stopped", "");
    text += found                    ? "found, " + wanted + "\n"
            : stopped == "not_found" ? "none found with " + wanted + "; best is\n"
                                     : "nothing certified with " + wanted + " before the search ended (" + stopped +
                                           "); best so far, not tested for it, is\n";
    text += "  best: " + values_text(best.at("values")) + "\n        " + probability_text(best) + "\n";
  } else if (answer.value("stopped", "").empty()) {  // what is known so far
    text += "nothing certified yet\n";
  } else {
    text += "none found, and nothing could be tried\n";
  }
  constexpr std::size_t kMostCandidates = 3;
  const auto candidates = answer.find("candidates");  // not given by a service of another version
  for (std::size_t i = 0; !found && candidates != answer.end() && i < std::min(kMostCandidates, candidates->size());
       ++i)
    text += "  looks good: " + values_text((*candidates)[i].at("values")) + ", P about " +
            core::fixed_text((*candidates)[i].value("expected", 0.0), 2) + "\n";
  if (const Json& robust = answer.at("robust"); !robust.is_null()) {
    text += "  most robust: " + values_text(robust.at("values")) + "\n        each anywhere between " +
            values_text(robust.at("low")) + "\n        and " + values_text(robust.at("high")) + "\n        " +
            probability_text(robust) + "\n";
  }
  const Json& anywhere = answer.at("anywhere");
  text += "Anywhere in the ranges: P " + core::fixed_text(anywhere.value("probability", 0.0), 3) + " (" +
          core::fixed_text(anywhere.at("interval").at(0).get<double>(), 3) + " to " +
          core::fixed_text(anywhere.at("interval").at(1).get<double>(), 3) + ")";
  if (const double impossible = answer.value("impossible", 0.0); impossible > 0.0)
    text += "; something is in the way in " + percent_text(impossible);
  text += "\n";
  std::vector<std::vector<std::string>> rows = {{"parameter", "range", "fails if only this is at random"}};
  for (const auto& parameter : answer.at("parameters")) {
    const bool known = !parameter.at("profile").empty();
    rows.push_back({parameter.value("name", ""),
                    core::rounded_text(parameter.at("range").at(0).get<double>()) + " to " +
                        core::rounded_text(parameter.at("range").at(1).get<double>()) + " " +
                        parameter.value("unit", ""),
                    known ? percent_text(parameter.value("fails_alone", 0.0)) : "not known"});
  }
  text += table(rows);
  if (answer.contains("map")) text += map_text(answer.at("map"), answer.at("parameters"));
  if (!answer.at("failures").empty()) {
    text += "What happens instead, of all choices:\n";
    for (const auto& reason : answer.at("failures")) {
      const std::string event = reason.value("event", "");
      text += "  " + percent_text(reason.value("share", 0.0)) + "  " + reason.value("what", "") +
              (event.empty() ? "" : " (" + event + ")") + "\n";
    }
  }
  text += counted(answer.value("instances", std::size_t{0}), "instance") + ", " +
          core::fixed_text(answer.value("simulated_seconds", 0.0), 0) + " simulated seconds, " +
          core::fixed_text(answer.value("wall_seconds", 0.0), 2) + " s";
  const Json& first = answer.at("first_certified");
  if (first.value("instances", 0) > 0)
    text += "; first certified choice after " + counted(first.value("instances", std::size_t{0}), "instance") +
            " and " + core::fixed_text(first.value("wall_seconds", 0.0), 2) + " s";
  text += "\n";
  if (const auto stepper = answer.find("stepper"); stepper != answer.end() && stepper->contains("not_lockstep"))
    text += "Note: Simulated by Bullet's stepper, because " + stepper->value("not_lockstep", "") + ".\n";
  for (const std::string& remark : answer.value("remarks", std::vector<std::string>{}))
    text += "Note: " + remark + "\n";
  return text;
}

}  // namespace prescene::service
