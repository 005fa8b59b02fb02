#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The commands of docs/tutorial/first_steps.md run, one after the other in one folder, and print what the page shows.
#   tutorial_test.sh <root of the checkout> <folder of the built program> [<sanitizers that it is built with>]
# A block ```sh is run. A block ```text is what the blocks before it print: each of its lines is printed, in this order, and each
# of its numbers to within 5 % or two in its last digit, whichever is more; "..." stands for any lines, or for the rest of a line.
# In a block ```text live, which depends on how messages arrive, numbers may be any.
set -eu
if [ -n "${3:-}" ]; then
  echo "skipped: under sanitizers the service is too slow for the pace of the recording; tests/system runs it under them"
  case ${PRESCENE_NO_SKIP:-0} in 0) exit 77 ;; *) exit 1 ;; esac
fi
page=$1/docs/tutorial/first_steps.md
work=$(mktemp -d)
trap 'kill "$(cat "$work/server" 2> /dev/null)" 2> /dev/null || true; rm -rf "$work"' EXIT
mkdir "$work/reader"
awk -v work="$work" '
/^```sh$/ { kind = "sh"; next }
/^```text( live)?$/ {
  kind = "text"
  print "echo @shown" ++shown, $2 >> (work "/commands")
  next
}
/^```/ { kind = ""; next }
kind == "sh" { print >> (work "/commands") }
kind == "text" { print >> (work "/promised" shown) }
' "$page"
cd "$work/reader"
PATH=$2:$PATH
# So that a failing command in between does not leave the service running.
sed -e 's|^prescene serve .*&$|&\necho $! > ../server|' -e 's|^wait \$!$|&\nrm ../server|' "$work/commands" > "$work/script"
code=0
. "$1/tests/support/take_domain.sh"
take_domain
ROS_DOMAIN_ID=$domain sh -eu "$work/script" > "$work/printed" 2> "$work/log" || code=$?
if [ "$code" != 0 ]; then
  echo "a command of the page fails with exit code $code"
  cat "$work/printed" "$work/log" serve.log
  exit 1
fi

awk -v work="$work" '
function plain(line) {
  gsub(/-?[0-9]+(\.[0-9]+)?(e-?[0-9]+)?/, "#", line)
  gsub(/-+/, "-", line)
  gsub(/[ \t]+/, " ", line)
  sub(/ $/, "", line)
  return line
}
# Whether the numbers of a shown line are those at the beginning of a printed one.
function same_numbers(shown, printed,    a, b, digits, most) {
  while (match(shown, /-?[0-9]+(\.[0-9]+)?(e-?[0-9]+)?/)) {
    a = substr(shown, RSTART, RLENGTH)
    shown = substr(shown, RSTART + RLENGTH)
    if (!match(printed, /-?[0-9]+(\.[0-9]+)?(e-?[0-9]+)?/)) return 0
    b = substr(printed, RSTART, RLENGTH)
    printed = substr(printed, RSTART + RLENGTH)
    digits = index(a, ".") ? length(a) - index(a, ".") : 0
    most = 2 * 10 ^ -digits
    if (0.05 * a > most) most = 0.05 * a
    if (-0.05 * a > most) most = -0.05 * a
    if (b - a > most * 1.000001 || a - b > most * 1.000001) return 0
    ++numbers
  }
  return 1
}
function compare(file, live,    line, wanted, start, i, found, any) {
  i = 0
  any = 1
  while ((getline line < file) > 0) {
    ++lines
    if (line == "...") {
      any = 1
      continue
    }
    wanted = plain(line)
    start = sub(/ ?\.\.\.$/, "", wanted)
    for (found = 0; !found && i < count; ) {
      ++i
      found = start ? index(printed[i], wanted) == 1 : printed[i] == wanted
      if (found && !live) found = same_numbers(line, text[i])
      if (!found && !any) break
    }
    if (!found) {
      printf "The page shows, but the program does not print there:\n%s\n", line
      for (i = 1; i <= count; ++i) print "  " text[i]
      exit failed = 1
    }
    any = 0
  }
}
/^@shown/ {
  compare(work "/promised" substr($1, 7), $2 == "live")
  count = 0
  next
}
{
  text[++count] = $0
  printed[count] = plain($0)
}
END {
  if (failed) exit 1
  if (lines < 30) {
    print "only " lines " lines of output are compared"
    exit 1
  }
  if (numbers < 60) {
    print "only " numbers " numbers are compared"
    exit 1
  }
  print lines " lines of output with " numbers " compared numbers are as the page shows them"
}' "$work/printed"

for file in box.yaml predict.html box.mcap box.html seen.png why.png still.mcap calibrated.yaml; do
  [ -s "$file" ] || { echo "there is no $file"; exit 1; }
done
grep -q 'frames come: tracking' serve.log || { cat serve.log; exit 1; }
