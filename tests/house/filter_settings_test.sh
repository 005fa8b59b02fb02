#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The page of the filter's settings is what its headers say, and each setting has a unit, a range and a source.
#   filter_settings_test.sh <root of the checkout>
set -eu
root=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$root/tools/filter_settings" "$root" > "$work/made"
diff -u "$root/docs/reference/filter_settings.md" "$work/made" ||
  { echo "the page is stale: tools/filter_settings > docs/reference/filter_settings.md"; exit 1; }
[ "$(grep -c '^| `' "$work/made")" -gt 60 ] || { echo "the script finds too few settings"; exit 1; }

# What is missing is noticed.
header=$work/filter/include/made_up.h
mkdir -p "$work/filter/include" "$work/docs/studies"
touch "$work/docs/studies/made_up.md"
prints() {
  printf 'struct MadeUpOptions {\n%s\n};\n' "$1" > "$header"
  "$root/tools/filter_settings" "$work" > "$work/printed" 2> "$work/errors"
}
refuses() {
  if prints "$2"; then echo "it accepts a setting $1"; exit 1; fi
  grep -q "MadeUpOptions::$3: " "$work/errors" || { cat "$work/errors"; echo "it does not name a setting $1"; exit 1; }
}
prints '  /// 1/m^2. How fast it
  /// grows. Range 0 to 2.5. Measured: docs/studies/made_up.md.
  double growth = 1.2;
  /// switch. Whether. Range true or false. Chosen.
  bool whether = true;
  /// Less. Chosen.
  OtherOptions other = {.less = 1};
  YetOtherOptions yet;' || { cat "$work/errors"; echo "it refuses what is complete"; exit 1; }
row='| `growth` | `1.2` | 1/m^2 | 0 to 2.5 | measured: [made_up.md](../studies/made_up.md) | How fast it grows. |'
grep -qF "$row" "$work/printed" || { cat "$work/printed"; echo "it prints another row"; exit 1; }
refuses 'without a comment' '  double bare = 1.0;' bare
refuses 'without a unit' '  /// How far. Range 0 to 2. Chosen.
  double plain = 1.0;' plain
refuses 'without a range' '  /// m. How far. Chosen.
  double far = 1.0;' far
refuses 'without a source' '  /// m. How far. Range 0 to 2.
  double far = 1.0;' far
refuses 'whose source is no page' '  /// m. How far. Range 0 to 2. Measured: docs/studies/none.md.
  double far = 1.0;' far
refuses 'whose default is out of range' '  /// m. How far. Range 2 to 3. Chosen.
  double far = 1.0;' far
refuses 'with several numbers of which one is out of range' '  /// m. How far. Range 0 to 2. Chosen.
  std::array<double, 2> far = {1.0, 3.0};' far
refuses 'of changed defaults without a source' '  OtherOptions other = {.less = 1};' other
