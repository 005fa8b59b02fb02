#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The page of the filter's settings is what its headers say.
#   filter_settings_test.sh <root of the checkout>
set -eu
root=$1
made=$(mktemp)
trap 'rm -f "$made"' EXIT
"$root/tools/filter_settings" > "$made"
diff -u "$root/docs/reference/filter_settings.md" "$made" ||
  { echo "the page is stale: tools/filter_settings > docs/reference/filter_settings.md"; exit 1; }
[ "$(grep -c '^| `' "$made")" -gt 100 ] || { echo "the script finds too few settings"; exit 1; }
