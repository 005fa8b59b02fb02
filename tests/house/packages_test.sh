#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tools/packages names what the collision library and its tests need and no more, and refuses what does not exist.
#   packages_test.sh <root of the checkout>
set -eu
packages=$1/tools/packages
expected="ccache cmake g++ libeigen3-dev libexpected-dev libgmock-dev libgtest-dev libhwy-dev librandom123-dev librapidcheck-dev libtbb-dev ninja-build"
for name in collision collision_spheres collision/dops; do
  found=$("$packages" "$name" | LC_ALL=C sort | paste -sd' ' -)
  [ "$found" = "$expected" ] || { echo "$name needs $expected, but is given $found"; exit 1; }
done
everything=$("$packages" run develop package | wc -l)
listed=$(grep -c '^\(run\|develop\|package\) ' "$1/tools/packages.txt")
[ "$everything" = "$listed" ] || { echo "$listed packages are listed, $everything named"; exit 1; }
for set in $(sed -n 's/^\([a-z]\{1,\}\) .*/\1/p' "$1/tools/packages.txt" | sort -u); do
  [ "$("$packages" "$set" | wc -l)" = "$(grep -c "^$set " "$1/tools/packages.txt")" ] || { echo "set $set is not all named"; exit 1; }
done
found=$("$packages" browser | LC_ALL=C sort | paste -sd' ' -)
[ "$found" = "chromium nodejs" ] || { echo "browser is given $found"; exit 1; }
if "$packages" collission 2> /dev/null; then echo "a module that does not exist is taken"; exit 1; fi
