#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Each line of tests/long_tests.txt names a test: one that was renamed would otherwise run with the quick ones unnoticed.
#   long_tests_test.sh <root of the checkout> <build folder>
set -eu
ctest --test-dir "$2" -N -L '^long$' | sed -n 's/^ *Test *#[0-9]*: //p' | LC_ALL=C sort > long_found.txt
grep -v '^#' "$1/tests/long_tests.txt" | LC_ALL=C sort > long_listed.txt
diff long_listed.txt long_found.txt || { echo "< is listed, but is no test"; exit 1; }
