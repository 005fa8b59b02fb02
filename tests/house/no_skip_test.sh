#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# With PRESCENE_NO_SKIP=1 a test that skips fails, and its reason is shown. Without it, CTest counts the test as skipped.
#   no_skip_test.sh <root of the checkout> <ctest> <the program planted_skip>
set -eu
unset PRESCENE_NO_SKIP
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/CTestTestfile.cmake" << END
set(prescene_test_executable "$3")
set(prescene_test_list "$work/list.cmake")
set(prescene_test_target "planted")
set(prescene_test_folder "tests/house")
set(prescene_test_timeout "60")
include("$1/cmake/discover_tests.cmake")
END

ctest=$2
fail() {
  echo "$1"
  cat "$work/printed"
  exit 1
}
# Runs both tests with a value of PRESCENE_NO_SKIP; `code` is how ctest ends.
run_with() {
  code=0
  PRESCENE_NO_SKIP=$1 "$ctest" --test-dir "$work" --output-on-failure > "$work/printed" 2>&1 || code=$?
  grep -q 'planted:Planted.Passes .*Passed' "$work/printed" || fail "with PRESCENE_NO_SKIP=$1 the other test does not pass"
}

for off in '' 0; do
  run_with "$off"
  [ "$code" = 0 ] || fail "with PRESCENE_NO_SKIP=$off a skipped test fails"
  grep -q 'planted:Planted.Skips .*Skipped' "$work/printed" || fail "with PRESCENE_NO_SKIP=$off no test is skipped"
done
run_with 1
[ "$code" != 0 ] || fail "with PRESCENE_NO_SKIP=1 a skipped test passes"
grep -q 'planted:Planted.Skips .*Failed' "$work/printed" || fail "with PRESCENE_NO_SKIP=1 the skipped test is not said to fail"
grep -q 'the moon is missing' "$work/printed" || fail "with PRESCENE_NO_SKIP=1 the reason is not shown"

# The one script that skips.
ends_with() { [ "$1" = "$code" ] || fail "tutorial_test.sh ends with $code, not with $1"; }
code=0
"$1/tests/house/tutorial_test.sh" "$1" "$work" thread > "$work/printed" 2>&1 || code=$?
ends_with 77
code=0
PRESCENE_NO_SKIP=1 "$1/tests/house/tutorial_test.sh" "$1" "$work" thread > "$work/printed" 2>&1 || code=$?
ends_with 1
