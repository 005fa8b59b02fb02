#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tools/trace-diff names the first difference of two traces, a missing end, another order, and what cannot be read.
#   trace_diff_test.sh <root of the checkout>
set -eu
diff=$1/tools/trace-diff
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
printf '# remark\n0 predict 0 aa\n0 predict 1 bb\n0 weight 0 cc\n' > "$work/a"
printf '0 predict 0 aa\n0 predict 1 bd\n0 weight 0 cc\n' > "$work/other_hash"
printf '0 predict 0 aa\n0 predict 1 bb\n' > "$work/shorter"
printf '0 predict 0 aa\n0 weight 0 cc\n0 predict 1 bb\n' > "$work/other_order"
printf '0 predict 0\n' > "$work/broken"

# expect <code> <text> <file>
expect() {
  code=0
  "$diff" "$work/a" "$work/$3" > "$work/said" 2>&1 || code=$?
  if [ "$code" != "$1" ] || ! grep -q "$2" "$work/said"; then
    echo "$3: expected $1 '$2', got $code:"
    cat "$work/said"
    exit 1
  fi
}
expect 0 'equal: 3 entries' a
expect 1 'after 1 equal entries: step 0, stage predict, particle 1: bb, bd' other_hash
expect 1 'shorter ends after 2 entries; the other goes on with step 0, stage weight, particle 0' shorter
expect 1 'the order of work differs after 1 equal' other_order
expect 2 'broken: not "step stage particle hash"' broken
expect 2 'cannot read' absent
