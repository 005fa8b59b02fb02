// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "verb.h"

namespace prescene::service {
namespace {

std::string interval(const nlohmann::ordered_json& p) {
  const auto limits = p.value("interval", std::vector<double>{0.0, 1.0});
  return fixed_digits(p.value("probability", 0.0), 3) + " (" + fixed_digits(limits.at(0), 3) + " to " +
         fixed_digits(limits.at(1), 3) + ")";
}

}  // namespace

std::string answer_text(const nlohmann::ordered_json& answer) {
  if (const auto stability = answer.find("stability"); stability != answer.end()) {
    return stability->value("object", "") + " stays as it is: " + interval((*stability)["stable"]) + "\n";
  }
  if (const auto predict = answer.find("predict"); predict != answer.end()) {
    std::vector<std::vector<std::string>> rows = {{"outcome", "group", "probability"}};
    for (const auto& outcome : (*predict)["outcomes"]) {
      rows.push_back({outcome.value("name", ""), outcome.value("group", ""), interval(outcome)});
    }
    return table(rows);
  }
  if (const auto where = answer.find("where"); where != answer.end()) {
    std::vector<std::vector<std::string>> rows = {{"object", "state", "confidence", "position, m"}};
    for (const auto& item : (*where)["items"]) {
      const auto& p = item["estimate"]["mean"]["position"];
      rows.push_back({item.value("object", ""), item.value("state", ""),
                      fixed_digits(item["estimate"].value("confidence", 0.0), 2),
                      fixed_digits(p[0].get<double>(), 3) + " " + fixed_digits(p[1].get<double>(), 3) + " " +
                          fixed_digits(p[2].get<double>(), 3)});
    }
    return table(rows);
  }
  return answer.dump(2) + "\n";
}

}  // namespace prescene::service
