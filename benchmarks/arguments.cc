// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/arguments.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <utility>

#include "prescene/core/spelling.h"
#include "prescene/core/text.h"

namespace prescene::benchmarks {
namespace {

std::optional<double> number_in(std::string_view text, double least, double most, bool whole) {
  const std::string copy(text);
  char* end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  if (copy.empty() || *end != '\0' || !(value >= least && value <= most)) return std::nullopt;
  if (whole && value != std::floor(value)) return std::nullopt;
  return value;
}

std::string range_text(const char* what, double least, double most) {
  return std::string("give ") + what + " from " + core::rounded_text(least) + " to " + core::rounded_text(most);
}

}  // namespace

void Arguments::flag(std::string name, std::function<void()> set) {
  options_.push_back({std::move(name), "", [set = std::move(set)](std::string_view) {
                        set();
                        return std::string();
                      }});
}

void Arguments::value(std::string name, std::string placeholder, std::function<std::string(std::string_view)> set) {
  options_.push_back({std::move(name), std::move(placeholder), std::move(set)});
}

void Arguments::text(std::string name, std::string placeholder, std::string* to) {
  value(std::move(name), std::move(placeholder), [to](std::string_view given) {
    *to = given;
    return std::string();
  });
}

void Arguments::one_of(std::string name, std::vector<std::string> words, std::string* to) {
  std::string placeholder;
  for (const std::string& word : words) placeholder += (placeholder.empty() ? "" : "|") + word;
  value(std::move(name), std::move(placeholder), [words = std::move(words), to](std::string_view given) {
    *to = given;
    const bool known = std::find(words.begin(), words.end(), given) != words.end();
    return known ? std::string() : "give one of " + core::comma_list(words);
  });
}

void Arguments::list(std::string name, std::string placeholder, std::vector<std::string>* to) {
  placeholder += "[," + placeholder + "]...";
  value(std::move(name), std::move(placeholder), [to](std::string_view given) {
    to->clear();
    while (!given.empty()) {
      const std::size_t comma = std::min(given.find(','), given.size());
      to->emplace_back(given.substr(0, comma));
      given.remove_prefix(std::min(comma + 1, given.size()));
    }
    return std::string();
  });
}

void Arguments::number(std::string name, double least, double most, int* to) {
  value(std::move(name), "N", [=](std::string_view given) {
    const std::optional<double> read = number_in(given, least, most, true);
    if (read) *to = static_cast<int>(*read);
    return read ? std::string() : range_text("a whole number", least, most);
  });
}

void Arguments::number(std::string name, double least, double most, double* to) {
  value(std::move(name), "X", [=](std::string_view given) {
    const std::optional<double> read = number_in(given, least, most, false);
    if (read) *to = *read;
    return read ? std::string() : range_text("a number", least, most);
  });
}

std::string Arguments::usage(std::string_view program) const {
  std::string text = "usage: " + std::string(program);
  for (const Option& option : options_)
    text += " [--" + option.name + (option.placeholder.empty() ? "" : "=" + option.placeholder) + "]";
  return text + "\n";
}

bool Arguments::parse(int count, const char* const* words, std::string* error) const {
  const auto fail = [&](std::string_view word, const std::string& why) {
    *error = std::string(word) + ": " + why + "\n" + usage(words[0]);
    return false;
  };
  for (const bool flags : {true, false})
    for (int i = 1; i < count; ++i) {
      const std::string_view word = words[i];
      const std::size_t sign = std::min(word.find('='), word.size());
      const auto option = std::find_if(options_.begin(), options_.end(), [&](const Option& known) {
        return word.substr(0, sign) == "--" + known.name && (sign == word.size()) == known.placeholder.empty();
      });
      if (option == options_.end()) return fail(word, "there is no such option");
      if (option->placeholder.empty() != flags) continue;
      if (const std::string why = option->set(word.substr(std::min(sign + 1, word.size()))); !why.empty())
        return fail(word, why);
    }
  return true;
}

bool Arguments::parse(int count, const char* const* words) const {
  std::string error;
  if (parse(count, words, &error)) return true;
  std::fputs(error.c_str(), stderr);
  return false;
}

}  // namespace prescene::benchmarks
