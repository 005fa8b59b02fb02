// SPDX-License-Identifier: Apache-2.0
// Words of a text, separated by white space, with the line that each stands in.
#pragma once

#include <cstddef>
#include <string_view>

namespace prescene::interfaces {

class TextScanner {
 public:
  explicit TextScanner(std::string_view text, std::size_t first_line = 1) : rest_(text), line_(first_line) {}

  /// The next word; empty at the end of the text.
  std::string_view word() {
    while (!rest_.empty() && is_space(rest_.front())) skip_one();
    std::size_t length = 0;
    while (length < rest_.size() && !is_space(rest_[length])) ++length;
    const std::string_view found = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return found;
  }

  /// The rest of the current line, without its end; false at the end of the text.
  bool next_line(std::string_view* out) {
    if (rest_.empty()) return false;
    const std::size_t length = rest_.find('\n');
    *out = rest_.substr(0, length);
    rest_.remove_prefix(length == std::string_view::npos ? rest_.size() : length + 1);
    if (!out->empty() && out->back() == '\r') out->remove_suffix(1);
    ++line_;
    return true;
  }

  /// That of the word last returned; after next_line(), that of the line to come.
  std::size_t line() const { return line_; }
  std::string_view rest() const { return rest_; }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t' || c == '\f' || c == '\v'; }
  void skip_one() {
    if (rest_.front() == '\n') ++line_;
    rest_.remove_prefix(1);
  }

  std::string_view rest_;
  std::size_t line_;
};

}  // namespace prescene::interfaces
