// SPDX-License-Identifier: Apache-2.0
// A YAML document as a tree of values that each know where they stand in the file, so that every later complaint can
// name the line. What the values mean is up to the reader: see binder.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/problems.h"

namespace prescene::interfaces {

/// A scalar, list or map of a document. Aliases are expanded: a value is a plain copy of what it refers to.
struct LocatedValue {
  enum class Kind { kNothing, kScalar, kList, kMap };
  struct Key {
    std::string name;
    FilePlace place;
  };

  Kind kind = Kind::kNothing;
  std::string text;                 ///< Of a scalar.
  bool quoted = false;              ///< The scalar was written in quotes or as a block: it is text, never a number.
  std::vector<Key> keys;            ///< Of a map, in the order of the file; keys.size() == items.size().
  std::vector<LocatedValue> items;  ///< Of a list or map.
  FilePlace place;
  std::string path;  ///< "models.carton.mass", "actions[1].time"; empty at the root.

  /// The value of a key of a map, or null.
  const LocatedValue* find(std::string_view key) const;
};

/// Bounds on what a document may ask for; beyond them reading fails with kResourceExhausted.
struct YamlLimits {
  std::size_t max_bytes = std::size_t{16} << 20;  ///< Of the text, and of all scalars once aliases are expanded.
  std::size_t max_values = 200'000;               ///< Of the tree once aliases are expanded.
  int max_depth = 48;
};

/// Parses one YAML document (UTF-8). `file` is the name that messages use. Fails with the line of the first mistake in
/// YAML itself: syntax, a key given twice, a key that is no scalar, several documents, a limit. Never throws.
/// With `problems`, keys that are given twice are collected there and do not end the reading: the first value counts.
/// What ends it is then added, too, and the status of a failure holds all of `problems`.
core::Result<LocatedValue> parse_yaml(std::string_view text, const std::string& file, const YamlLimits& limits = {},
                                      Problems* problems = nullptr);
/// The same of a file. Where it can't be read, nothing is added to `problems`.
core::Result<LocatedValue> read_yaml(const std::filesystem::path& path, const YamlLimits& limits = {},
                                     Problems* problems = nullptr);

}  // namespace prescene::interfaces
