// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/scene_files/binder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "prescene/core/spelling.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

struct Unit {
  std::string_view name;
  std::string_view base;
  double factor;
};
constexpr std::array kUnits{Unit{"mm", "m", 1e-3},
                            Unit{"cm", "m", 1e-2},
                            Unit{"m", "m", 1.0},
                            Unit{"in", "m", 0.0254},
                            Unit{"g", "kg", 1e-3},
                            Unit{"kg", "kg", 1.0},
                            Unit{"ms", "s", 1e-3},
                            Unit{"s", "s", 1.0},
                            Unit{"min", "s", 60.0},
                            Unit{"deg", "rad", geometry::kDegree},
                            Unit{"rad", "rad", 1.0},
                            Unit{"deg", "deg", 1.0},
                            Unit{"rad", "deg", 1.0 / geometry::kDegree},
                            Unit{"°", "deg", 1.0},
                            Unit{"°", "rad", geometry::kDegree}};

// "5 cm" where metres are needed: "write 0.05".
std::optional<std::string> converted(std::string_view text, std::string_view base) {
  const std::size_t end = text.find_first_not_of("+-.0123456789eE");
  if (end == std::string_view::npos || end == 0) return std::nullopt;
  double number = 0.0;
  if (!parse_number(trimmed(text.substr(0, end)), &number)) return std::nullopt;
  const std::string_view name = trimmed(text.substr(end));
  for (const Unit& unit : kUnits)
    if (unit.name == name && unit.base == base)
      return "write " + core::rounded_text(number * unit.factor) + " without a unit";
  return std::nullopt;
}

// A number that would fit had it been given in a smaller unit: "millimetres? then write 0.105".
std::string unit_guess(double number, const NumberRange& range) {
  struct Guess {
    std::string_view base;
    std::string_view name;
    double factor;
  };
  static constexpr std::array kGuesses{Guess{"m", "millimetres", 1e-3}, Guess{"kg", "grams", 1e-3},
                                       Guess{"s", "milliseconds", 1e-3}, Guess{"rad", "degrees", geometry::kDegree}};
  for (const Guess& guess : kGuesses) {
    const double meant = number * guess.factor;
    if (guess.base == range.unit && std::abs(number) > std::abs(meant) && meant >= range.low && meant <= range.high)
      return std::string(guess.name) + "? then write " + core::rounded_text(meant) + "; ";
  }
  return {};
}

std::string_view without_plus(std::string_view text) {
  return text.size() > 1 && text.front() == '+' && text[1] != '-' ? text.substr(1) : text;
}

}  // namespace

std::string description(const LocatedValue& value) {
  switch (value.kind) {
    case LocatedValue::Kind::kNothing:
      return "there is nothing here";
    case LocatedValue::Kind::kScalar:
      return interfaces::quote(value.text, 40) + (value.quoted ? " is quoted text" : "");
    case LocatedValue::Kind::kList:
      return "this is a list of " + std::to_string(value.items.size());
    case LocatedValue::Kind::kMap:
      return "this is a map of keys";
  }
  return {};
}

void report_type(const LocatedValue& value, Problems& problems, std::string_view remedy) {
  std::string reason = description(value);
  if (value.kind == LocatedValue::Kind::kScalar && !value.quoted) reason += " does not fit";
  problems.add(value.place, value.path, std::move(reason), std::string(remedy));
}

std::optional<double> read_number(const LocatedValue& value, Problems& problems, const NumberRange& range) {
  double number = 0.0;
  if (value.kind != LocatedValue::Kind::kScalar || value.quoted || !parse_number(without_plus(value.text), &number)) {
    if (value.kind == LocatedValue::Kind::kScalar) {
      const std::optional<std::string> better = converted(value.text, range.unit);
      problems.add(
          value.place, value.path,
          interfaces::quote(value.text, 40) + (value.quoted ? " is quoted text, not a number" : " is not a number"),
          better ? *better : std::string(range.remedy));
    } else {
      report_type(value, problems, range.remedy);
    }
    return std::nullopt;
  }
  if (!std::isfinite(number)) {
    problems.add(value.place, value.path, interfaces::quote(value.text, 40) + " is not a finite number",
                 std::string(range.remedy));
    return std::nullopt;
  }
  if (number < range.low || number > range.high) {
    problems.add(value.place, value.path, number_text(number) + " is out of range",
                 unit_guess(number, range) + std::string(range.remedy) +
                     // Where the remedy says "more than 0", this is.
                     (number > 0.0 && number < range.low ? "; the least is " + number_text(range.low) : ""));
    return std::nullopt;
  }
  return number;
}

std::optional<long long> read_integer(const LocatedValue& value, Problems& problems, long long low, long long high,
                                      std::string_view remedy) {
  long long number = 0;
  if (value.kind != LocatedValue::Kind::kScalar || value.quoted || !parse_integer(without_plus(value.text), &number)) {
    report_type(value, problems, remedy);
    return std::nullopt;
  }
  if (number < low || number > high) {
    problems.add(value.place, value.path, std::to_string(number) + " is out of range",
                 std::string(remedy) + " between " + std::to_string(low) + " and " + std::to_string(high));
    return std::nullopt;
  }
  return number;
}

std::optional<bool> read_bool(const LocatedValue& value, Problems& problems) {
  if (value.kind == LocatedValue::Kind::kScalar && !value.quoted) {
    if (value.text == "true") return true;
    if (value.text == "false") return false;
  }
  report_type(value, problems, "write true or false");
  return std::nullopt;
}

std::optional<std::string> read_text(const LocatedValue& value, Problems& problems) {
  if (value.kind == LocatedValue::Kind::kScalar) return value.text;
  report_type(value, problems, "give a text");
  return std::nullopt;
}

std::optional<std::vector<double>> read_numbers(const LocatedValue& value, Problems& problems, std::size_t count,
                                                const NumberRange& range) {
  if (value.kind != LocatedValue::Kind::kList || value.items.size() != count) {
    report_type(value, problems, "give a list of " + std::to_string(count) + " numbers");
    return std::nullopt;
  }
  std::vector<double> numbers;
  for (const LocatedValue& item : value.items)
    if (const std::optional<double> number = read_number(item, problems, range)) numbers.push_back(*number);
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

std::optional<std::size_t> read_word(const LocatedValue& value, Problems& problems,
                                     const std::vector<std::string>& words) {
  if (value.kind == LocatedValue::Kind::kScalar) {
    const auto found = std::find(words.begin(), words.end(), value.text);
    if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
    problems.add(value.place, value.path, interfaces::quote(value.text, 40) + " is not known here",
                 suggestion(value.text, words));
    return std::nullopt;
  }
  report_type(value, problems, suggestion("", words));
  return std::nullopt;
}

Binder::Binder(const LocatedValue& value, Problems& problems)
    : value_(value), problems_(problems), is_map_(value.kind == LocatedValue::Kind::kMap) {
  if (!is_map_) report_type(value, problems, "give a map of keys, one 'key: value' a line");
}

const LocatedValue* Binder::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  return value_.find(key);
}

const LocatedValue* Binder::require(std::string_view key, std::string_view remedy) {
  const LocatedValue* found = find(key);
  if (!found && is_map_) missing_.push_back({{std::string(key)}, std::string(remedy)});
  return found;
}

const LocatedValue* Binder::one_of(const std::vector<std::string>& keys, std::string_view remedy, bool optional,
                                   std::string* which) {
  const LocatedValue* found = nullptr;
  std::string first;
  for (const std::string& key : keys) {
    const LocatedValue* value = find(key);
    if (!value) continue;
    if (found) {
      problems_.add(value->place, value->path,
                    interfaces::quote(key) + " and " + interfaces::quote(first) + " exclude each other",
                    "remove one of them");
      continue;
    }
    found = value;
    first = key;
  }
  if (which) *which = first;
  if (!found && !optional && is_map_) missing_.push_back({keys, std::string(remedy)});
  return found;
}

bool Binder::read(std::string_view key, double& to, const NumberRange& range) {
  const LocatedValue* at = find(key);
  const std::optional<double> number = at ? read_number(*at, problems_, range) : std::nullopt;
  if (number) to = *number;
  return number.has_value();
}

bool Binder::read(std::string_view key, std::optional<double>& to, const NumberRange& range) {
  double number = 0.0;
  const bool found = read(key, number, range);
  if (found) to = number;
  return found;
}

bool Binder::read(std::string_view key, int& to, int low, int high, std::string_view remedy) {
  const LocatedValue* at = find(key);
  const std::optional<long long> number = at ? read_integer(*at, problems_, low, high, remedy) : std::nullopt;
  if (number) to = static_cast<int>(*number);
  return number.has_value();
}

bool Binder::read(std::string_view key, bool& to) {
  const LocatedValue* at = find(key);
  const std::optional<bool> flag = at ? read_bool(*at, problems_) : std::nullopt;
  if (flag) to = *flag;
  return flag.has_value();
}

bool Binder::read(std::string_view key, std::string& to) {
  const LocatedValue* at = find(key);
  std::optional<std::string> text = at ? read_text(*at, problems_) : std::nullopt;
  if (text) to = std::move(*text);
  return text.has_value();
}

void Binder::finish() {
  if (finished_) return;
  finished_ = true;
  // What the map does not have yet is the likelier meaning of a mistyped key.
  std::vector<std::string> absent, present;
  for (const std::string& key : known_) (value_.find(key) ? present : absent).push_back(key);
  std::vector<std::string> explained;
  for (std::size_t i = 0; i < value_.keys.size(); ++i) {
    const std::string& key = value_.keys[i].name;
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const std::vector<std::string> meant = core::nearest_words(key, absent);
    explained.insert(explained.end(), meant.begin(), meant.end());
    const bool near_present = meant.empty() && !core::nearest_words(key, present).empty();
    std::string remedy = suggestion(key, meant.empty() ? (near_present ? present : known_) : absent);
    problems_.add(value_.keys[i].place, value_.items[i].path, "unknown key",
                  remedy.empty() ? "remove it" : std::move(remedy));
  }
  for (const Missing& missing : missing_) {
    const bool is_explained = std::any_of(missing.keys.begin(), missing.keys.end(), [&](const std::string& key) {
      return std::find(explained.begin(), explained.end(), key) != explained.end();
    });
    if (is_explained) continue;
    problems_.add(
        value_.place, value_.path,
        missing.keys.size() == 1 ? "the key " + interfaces::quote(missing.keys[0]) + " is missing" : "a key is missing",
        missing.remedy);
  }
}

}  // namespace prescene::interfaces
