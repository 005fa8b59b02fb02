#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What tools/header_examples.awk makes of a header.
#   extract_test.sh <tools/header_examples.awk>
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir shelf
cat > shelf/cup.h << 'END'
// Cups. They may be
//   - empty, or
//     full to the brim;
//   - broken.
//
//   Cup cup = make();            // of tea
//   if (cup) ... cup.size, cup.colour
//
//   cup.drink();
//   ... cup.size;
#pragma once
namespace prescene::shelf {
/// Text.
struct Cup {
  /// Sets:
  ///
  ///   cup.size = 3;
  int size;  //   not an example
};
}
END
printf '#pragma once\n// No example.\nnamespace prescene::shelf {}\n' > shelf/empty.h
expected='// The examples in the comments of headers, made by tools/header_examples.awk.
#include "shelf/cup.h"
#include "prescene/core/status.h"

#include "do_something.h"
#include "shelf_cups.h"

namespace prescene::shelf::given_shelf_cups::cup_h {
[[maybe_unused]] prescene::core::Status example_1() {
#line 6 "shelf/cup.h"
   Cup cup = make();            // of tea
   if (cup) prescene::do_something_with(cup.size, cup.colour);
  return prescene::core::ok_status();
}
[[maybe_unused]] prescene::core::Status example_2() {
#line 9 "shelf/cup.h"
   cup.drink();
   prescene::do_something_with(cup.size);
  return prescene::core::ok_status();
}
[[maybe_unused]] prescene::core::Status example_3() {
#line 17 "shelf/cup.h"
   cup.size = 3;
  return prescene::core::ok_status();
}
}'
found=$(printf 'shelf_cups shelf/cup.h\nshelf_cups shelf/empty.h\n' | awk -f "$1")
[ "$found" = "$expected" ] || { printf '%s\n' "$found"; exit 1; }
found=$(printf 'shelf_cups shelf/cup.h\nshelf_cups shelf/empty.h\n' | awk -v list=1 -f "$1")
[ "$found" = shelf/cup.h ] || { printf '%s\n' "$found"; exit 1; }
printf '//   cup.drink();\n#pragma once\n' > shelf/nowhere.h
if echo 'shelf_cups shelf/nowhere.h' | awk -f "$1" > /dev/null 2>&1; then echo "an example in a header without namespace is taken"; exit 1; fi
if echo 'shelf_cups shelf/no_such.h' | awk -f "$1" > /dev/null 2>&1; then echo "a header that does not exist is taken"; exit 1; fi
