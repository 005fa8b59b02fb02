#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The man pages: one for the program and one for each verb, with every line of its help.
#   man_pages_test.sh <root of the checkout> <program>
set -eu
root=$1
program=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$root/tools/man_pages" "$program" "$work"
# Without layout: what man would show, and what the program prints.
words() { tr -s ' \n' '\n\n' | grep -v '^$'; }
shown() { sed -n '/^\.nf/,/^\.fi/p' "$1" | sed '1d;$d; s/\\-/-/g; s/^\\&//; s/\\\\/\\/g' | words; }
count=0
for page in "$work"/*.1; do
  name=$(basename "$page" .1)
  verb=${name#prescene}
  "$program" ${verb:+"${verb#-}"} --help | sed 1d | words > "$work/printed"
  shown "$page" > "$work/shown"
  cmp -s "$work/printed" "$work/shown" || { diff "$work/printed" "$work/shown" | head -20; echo "$name.1 is not what --help prints"; exit 1; }
  # Only a word that is as long itself makes a line too wide.
  sed -n '/^\.nf/,/^\.fi/p' "$page" | sed 's/\\-/-/g' |
    awk 'length($0) > 71 && match($0, /^ *[^ ]+ /) && RLENGTH <= 71 {wide = 1; print} END {exit wide}' ||
    { echo "$name.1 has lines that are too wide"; exit 1; }
  count=$((count + 1))
done
[ "$count" -gt 8 ] || { echo "only $count pages"; exit 1; }
if "$root/tools/man_pages" true "$work/none" > /dev/null 2>&1; then echo "it makes pages of a program without verbs"; exit 1; fi
