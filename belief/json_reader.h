// SPDX-License-Identifier: Apache-2.0
// Strict reading of JSON objects: every key has to be known and of the right type; the first thing that is wrong is
// kept with its path. Readers go on with harmless values after it, and the caller looks at the status once at the end.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "prescene/core/spelling.h"
#include "prescene/core/status.h"

namespace prescene::belief {

using Json = nlohmann::ordered_json;

/// The first failure of a reading.
class JsonErrors {
 public:
  void add(const std::string& path, const std::string& reason) {
    if (status_.ok())
      status_ = core::invalid_input((path.empty() ? std::string("the document") : path) + ": " + reason);
  }
  bool ok() const { return status_.ok(); }
  const core::Status& status() const { return status_; }

 private:
  core::Status status_;
};

/// Keys come from outside: only what is printable and short goes into a message.
inline std::string printable_key(const std::string& key) {
  std::string shown;
  for (const char c : key.substr(0, 40)) shown += c >= ' ' && c <= '~' ? c : '?';
  return shown;
}

/// A JSON value with its path.
struct JsonAt {
  const Json& value;
  std::string path;
  JsonErrors& errors;

  void fail(const std::string& reason) const { errors.add(path, reason); }
  std::string type() const { return value.type_name(); }

  double number() const {
    if (!value.is_number()) return fail("a number is needed, not " + type()), 0.0;
    const auto result = value.get<double>();
    if (!std::isfinite(result)) return fail("the number is too large"), 0.0;
    return result;
  }
  /// null stands for `absent`.
  double number_or_null(double absent) const { return value.is_null() ? absent : number(); }
  std::int64_t integer(std::int64_t low, std::int64_t high) const {
    if (!value.is_number_integer() || (value.is_number_unsigned() && value.get<std::uint64_t>() > INT64_MAX))
      return fail("a whole number is needed"), low;
    const auto result = value.get<std::int64_t>();
    if (result < low || result > high)
      return fail("the number has to be between " + std::to_string(low) + " and " + std::to_string(high)), low;
    return result;
  }
  std::uint64_t unsigned_integer() const {
    if (!value.is_number_integer() || (!value.is_number_unsigned() && value.get<std::int64_t>() < 0))
      return fail("a whole number of at least 0 is needed"), 0;
    return value.get<std::uint64_t>();
  }
  bool boolean() const {
    if (!value.is_boolean()) return fail("true or false is needed, not " + type()), false;
    return value.get<bool>();
  }
  std::string text() const {
    if (!value.is_string()) return fail("a text is needed, not " + type()), std::string();
    return value.get<std::string>();
  }
  /// The items of an array; of just `count` ones, if given (else it is an error and the array counts as empty).
  std::vector<JsonAt> items(std::optional<std::size_t> count = std::nullopt) const {
    std::vector<JsonAt> result;
    if (!value.is_array() || (count && value.size() != *count)) {
      fail(count ? "a list of " + std::to_string(*count) + " is needed" : "a list is needed, not " + type());
      return result;
    }
    for (std::size_t i = 0; i < value.size(); ++i)
      result.push_back({value[i], path + "[" + std::to_string(i) + "]", errors});
    return result;
  }
  std::vector<double> numbers(std::size_t count) const {
    std::vector<double> result;
    for (const JsonAt& item : items(count)) result.push_back(item.number());
    result.resize(count, 0.0);
    return result;
  }
  template <class Enum>
  Enum word(const std::vector<std::pair<std::string, Enum>>& words) const {
    std::string known;
    for (const auto& [name, meaning] : words) {
      if (value.is_string() && value.get_ref<const std::string&>() == name) return meaning;
      known += (known.empty() ? "" : ", ") + name;
    }
    fail("one of " + known + " is needed");
    return words.front().second;
  }
};

/// An object whose keys are asked for one by one; those that nobody asked for are errors.
class JsonObject {
 public:
  explicit JsonObject(const JsonAt& at) : at_(at) {
    if (!at.value.is_object()) at.fail("an object {...} is needed, not " + at.type());
  }
  ~JsonObject() {
    if (!at_.value.is_object()) return;
    for (const auto& [key, value] : at_.value.items()) {
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      const std::string near = core::did_you_mean(key, known_);
      at_.errors.add(path_of(key), "unknown key; " + (near.empty() ? "the" : near + " The") + " keys here are " +
                                       core::comma_list(known_));
    }
  }
  JsonObject(const JsonObject&) = delete;
  JsonObject& operator=(const JsonObject&) = delete;

  std::optional<JsonAt> find(const std::string& key) {
    known_.push_back(key);
    if (!at_.value.is_object()) return std::nullopt;
    const auto found = at_.value.find(key);
    if (found == at_.value.end()) return std::nullopt;
    return JsonAt{*found, path_of(key), at_.errors};
  }
  std::optional<JsonAt> require(const std::string& key) {
    std::optional<JsonAt> found = find(key);
    if (!found && at_.value.is_object()) at_.fail("the key '" + key + "' is missing");
    return found;
  }
  /// Which of the keys is there; exactly one has to be.
  std::optional<std::pair<std::string, JsonAt>> one_of(const std::vector<std::string>& keys) {
    std::optional<std::pair<std::string, JsonAt>> result;
    std::string names;
    for (const std::string& key : keys) {
      names += (names.empty() ? "" : ", ") + key;
      std::optional<JsonAt> found = find(key);
      if (!found) continue;
      if (result) found->fail("'" + result->first + "' is there already: give one of them");
      if (!result) result.emplace(key, *found);
    }
    if (!result && at_.value.is_object()) at_.fail("one of the keys " + names + " is needed");
    return result;
  }
  const JsonAt& at() const { return at_; }

 private:
  std::string path_of(const std::string& key) const {
    return at_.path.empty() ? printable_key(key) : at_.path + "." + printable_key(key);
  }

  const JsonAt at_;
  std::vector<std::string> known_;
};

}  // namespace prescene::belief
