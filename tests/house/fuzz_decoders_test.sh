#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/fuzz/decoders.txt lists each fuzz target that is built, with sources that exist, and each has a corpus.
#   fuzz_decoders_test.sh <root of the checkout> <build folder>
set -eu
cd "$1"
failed=0
say() { echo "$1"; failed=1; }
listed=$(sed -n 's/^\([a-z0-9_*]*\):.*/\1/p' tests/fuzz/decoders.txt)
for target in $(ctest --test-dir "$2" -N -L '^fuzz$' | sed -n 's/^ *Test *#[0-9]*: fuzz\.//p'); do
  found=no
  for pattern in $listed; do
    # shellcheck disable=SC2254 # a pattern is meant
    case $target in $pattern) found=yes ;; esac
  done
  [ "$found" = yes ] || say "tests/fuzz/decoders.txt: $target is missing: add a line with the sources that it is to reach"
  [ -n "$(ls "tests/fuzz/corpus/$target" 2> /dev/null)" ] || say "tests/fuzz/corpus/$target: holds no seed"
done
for source in $(sed -n 's/^[a-z0-9_*]*: *//p' tests/fuzz/decoders.txt); do
  [ -f "$source" ] || say "tests/fuzz/decoders.txt: there is no $source"
done
exit "$failed"
