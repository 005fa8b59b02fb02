// SPDX-License-Identifier: Apache-2.0
// What is wrong with a file that a person wrote: all of it at once, each with its place, reason and remedy.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

/// A place in a file; lines and columns count from 1, 0 = the file as a whole.
struct FilePlace {
  std::shared_ptr<const std::string> file;
  int line = 0;
  int column = 0;
};

struct Problem {
  std::string file;
  int line = 0;
  int column = 0;
  std::string key;  ///< Path of the key, as "models.carton.mass" or "actions[1].time"; empty = the whole document.
  std::string reason;
  std::string remedy;

  /// "file:line: key: reason: remedy".
  std::string text() const;
};

/// Collects problems; the first hundred are kept, the others counted.
class Problems {
 public:
  void add(const FilePlace& place, std::string_view key, std::string reason, std::string remedy);
  /// Warnings don't keep the file from being used.
  void warn(const FilePlace& place, std::string_view key, std::string reason, std::string remedy);
  /// Nothing is wrong, but something may be better.
  void remark(const FilePlace& place, std::string_view key, std::string reason, std::string remedy);

  bool empty() const { return errors_.empty(); }
  const std::vector<Problem>& errors() const { return errors_; }
  const std::vector<Problem>& warnings() const { return warnings_; }
  const std::vector<Problem>& remarks() const { return remarks_; }
  /// Ok when empty, else kInvalidInput with every error on a line of its own, in the order of the file.
  core::Status status() const;

 private:
  std::vector<Problem> errors_;
  std::vector<Problem> warnings_;
  std::vector<Problem> remarks_;
  std::size_t left_off_ = 0;
};

/// "did you mean 'mass'?" (core::nearest_words), or "one of a, b, c" when nothing known is near to `word`; empty
/// without candidates.
std::string suggestion(std::string_view word, const std::vector<std::string>& known);

}  // namespace prescene::interfaces
