#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Checks that tools/check_draws reports draws without an order and passes those with one.
#   check_draws_test.sh <root of the checkout>
set -eu
root=$1
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
mkdir "$copy/tools" "$copy/core"
cp "$root/tools/check_draws" "$root/tools/check_draws.awk" "$copy/tools"

reported() {
  printf '%s\n' "$1" > "$copy/core/planted.cc"
  if "$copy/tools/check_draws" "$copy" > "$copy/output"; then echo "not reported: $1"; exit 1; fi
  grep -q '^core/planted.cc:[0-9]*: error: two draws of stream ' "$copy/output" || { cat "$copy/output"; exit 1; }
}
passes() {
  printf '%s\n' "$1" > "$copy/core/planted.cc"
  "$copy/tools/check_draws" "$copy" > "$copy/output" || { cat "$copy/output"; echo "reported, but has an order: $1"; exit 1; }
}

reported 'const Vector3d p(stream.uniform(0, 1), stream.uniform(0, 1), 0.0);'
reported 'f(stream.normal(),
  2.0 * stream.normal());'
reported 'put(stream->next_u64(), {0.0, stream->uniform(-1.0, 1.0)});'
reported 'const auto any = [&] { return max(size * stream.uniform(), g(stream.uniform())); };'
reported 'text.insert(1, text.substr(stream.uniform_below(4), 1 + stream.uniform_below(20)));'

passes 'const Vector3d p{stream.uniform(0, 1), stream.uniform(0, 1), 0.0};'
passes 'put({stream.uniform(0, 1), stream.uniform(0, 1), 0.0});  // not f(stream.normal(), stream.normal())'
passes 'const double y = stream.uniform(), x = stream.uniform(); put(x, y);'
passes 'EXPECT_EQ(stream.normal(), other.normal());'
passes 'for (double x = stream.normal(); x < 1.0; x = stream.normal()) put(x, 1.0);'
passes 'apply(stream.normal(), [&] { return 1.0; }); put(stream.normal());'
passes 'repeat(3, [&] { put(stream.normal(), 1.0); put(1.0, stream.normal()); });'
echo "draws without an order are reported"
