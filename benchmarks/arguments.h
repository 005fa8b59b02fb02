// SPDX-License-Identifier: Apache-2.0
// The options of a benchmark's command line, --NAME or --NAME=VALUE.
//
//   int seeds = 10;
//   std::string out;
//   Arguments arguments;
//   arguments.flag("quick", [&] { seeds = 2; });
//   arguments.number("seeds", 1, 1e6, &seeds);
//   arguments.text("benchmark_out", "PATH", &out);
//   if (!arguments.parse(count, words)) std::exit(2);
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace prescene::benchmarks {

/// Flags are taken first, wherever they stand, so that --quick sets what other options then change.
class Arguments {
 public:
  void flag(std::string name, std::function<void()> set);
  /// `set` returns what is wrong with the value; "" if nothing is.
  void value(std::string name, std::string placeholder, std::function<std::string(std::string_view)> set);
  void text(std::string name, std::string placeholder, std::string* to);
  /// One of these words.
  void one_of(std::string name, std::vector<std::string> words, std::string* to);
  /// Words between commas.
  void list(std::string name, std::string placeholder, std::vector<std::string>* to);
  /// Whole numbers from `least` to `most`, and numbers.
  void number(std::string name, double least, double most, int* to);
  void number(std::string name, double least, double most, double* to);

  /// Takes the words of the command line, of which the first is the program's name. False, with what is wrong and how
  /// the program is called on stderr, if a word is no option or a value is wrong.
  bool parse(int count, const char* const* words) const;
  /// The same, with the text in place of stderr.
  bool parse(int count, const char* const* words, std::string* error) const;

 private:
  struct Option {
    std::string name;
    std::string placeholder;  // "" = a flag
    std::function<std::string(std::string_view)> set;
  };
  std::string usage(std::string_view program) const;

  std::vector<Option> options_;
};

}  // namespace prescene::benchmarks
