#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every header of the checkout that has an example is compiled with its examples: none is in a private header, or in one
# that no CMakeLists.txt lists.
#   complete_test.sh <root of the checkout> <folder of the lists of headers>
set -eu
cd "$1"
compiled=$(cat "$2"/*.list | LC_ALL=C sort -u -k 2 | awk -v list=1 -f tools/header_examples.awk | LC_ALL=C sort)
there=$(find ./* \( -path ./build -o -path './.*' \) -prune -o -type f -name '*.h' -print | sed 's|^\./|x |' |
  awk -v list=1 -f tools/header_examples.awk | LC_ALL=C sort)
if [ "$compiled" != "$there" ]; then
  echo "These headers have indented text that is not compiled as an example. An example belongs into a header that its"
  echo "CMakeLists.txt lists under HEADERS or SHARED_HEADERS; other text is not indented, or a list of lines with '- '."
  printf '%s\n%s\n%s\n' "$compiled" "$compiled" "$there" | LC_ALL=C sort | uniq -u
  exit 1
fi
count=$(printf '%s\n' "$there" | wc -l)
[ "$count" -gt 80 ] || { echo "only $count headers have examples"; exit 1; }
echo "the examples of $count headers are compiled"
