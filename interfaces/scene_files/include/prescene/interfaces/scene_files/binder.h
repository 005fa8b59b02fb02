// SPDX-License-Identifier: Apache-2.0
// Binds a map of a YAML document to the fields of a struct, and complains about everything that does not fit:
//
//   Problems problems;
//   Binder binder(document, problems);
//   binder.read("frames_unseen_max", settings.frames_unseen_max, 1, 1000, "give a number of frames");
//   binder.read("camera_topic", settings.camera_topic);
//   if (const LocatedValue* filter = binder.find("filter")) bind(*filter, problems, settings.filter);
//   binder.finish();                           // keys that nobody asked for are errors, with the nearest that was
//   if (!problems.empty()) return problems.status();
//
// Fields whose key is absent keep their value, so a struct's defaults are the document's defaults.
#pragma once

#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "prescene/interfaces/scene_files/located_value.h"
#include "prescene/interfaces/scene_files/problems.h"

namespace prescene::interfaces {

/// What a number has to be; `remedy` ends the message: "give metres between 0 and 100".
struct NumberRange {
  double low = -std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::max();
  std::string_view remedy = "give a finite number";
  /// The unit that the number is in ("m", "kg", "s", "deg", "rad"); lets messages convert "5 cm" or guess millimetres.
  std::string_view unit = "";
};

/// Each returns nothing after having reported why.
std::optional<double> read_number(const LocatedValue& value, Problems& problems, const NumberRange& range = {});
std::optional<long long> read_integer(const LocatedValue& value, Problems& problems, long long low, long long high,
                                      std::string_view remedy = "give a whole number");
std::optional<bool> read_bool(const LocatedValue& value, Problems& problems);
std::optional<std::string> read_text(const LocatedValue& value, Problems& problems);
/// A list of just `count` numbers.
std::optional<std::vector<double>> read_numbers(const LocatedValue& value, Problems& problems, std::size_t count,
                                                const NumberRange& range = {});
/// The index of the word among `words`.
std::optional<std::size_t> read_word(const LocatedValue& value, Problems& problems,
                                     const std::vector<std::string>& words);

/// Reports that `value` is not what is needed: "is a list: give ...".
void report_type(const LocatedValue& value, Problems& problems, std::string_view remedy);
/// "nothing", "a list", "a map", "the word 'abc'".
std::string description(const LocatedValue& value);

class Binder {
 public:
  /// Reports it when `value` is not a map; then all reads find nothing. `value` and `problems` must outlive the binder.
  Binder(const LocatedValue& value, Problems& problems);
  ~Binder() { finish(); }
  Binder(const Binder&) = delete;
  Binder& operator=(const Binder&) = delete;

  const LocatedValue& value() const { return value_; }
  Problems& problems() const { return problems_; }

  /// The value of a key, or null; from now on the key is known.
  const LocatedValue* find(std::string_view key);
  /// The same; its absence is an error.
  const LocatedValue* require(std::string_view key, std::string_view remedy);
  /// Which of the keys is there: exactly one has to be (or at most one, if `optional`). All become known.
  const LocatedValue* one_of(const std::vector<std::string>& keys, std::string_view remedy, bool optional = false,
                             std::string* which = nullptr);

  /// Makes a key known without reading it.
  void note_known(std::string_view key) { find(key); }

  /// Each returns whether the key was there and fit.
  bool read(std::string_view key, double& to, const NumberRange& range = {});
  bool read(std::string_view key, std::optional<double>& to, const NumberRange& range = {});
  bool read(std::string_view key, int& to, int low, int high, std::string_view remedy = "give a whole number");
  bool read(std::string_view key, bool& to);
  bool read(std::string_view key, std::string& to);
  /// An enumeration by its words.
  template <class Enum>
  bool read_enum(std::string_view key, Enum& to, const std::vector<std::pair<std::string, Enum>>& words) {
    std::vector<std::string> names;
    for (const auto& word : words) names.push_back(word.first);
    const LocatedValue* at = find(key);
    const std::optional<std::size_t> index = at ? read_word(*at, problems_, names) : std::nullopt;
    if (index) to = words[*index].second;
    return index.has_value();
  }

  /// Reports keys that nobody asked for and required ones that are absent. Called by the destructor if not before.
  void finish();

 private:
  struct Missing {
    std::vector<std::string> keys;  // any of them would do
    std::string remedy;
  };
  const LocatedValue& value_;
  Problems& problems_;
  bool is_map_;
  bool finished_ = false;
  std::vector<std::string> known_;
  std::vector<Missing> missing_;
};

}  // namespace prescene::interfaces
