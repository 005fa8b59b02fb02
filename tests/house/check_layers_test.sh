#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Plants wrong arrows in a copy of the sources and sees tools/check_layers name each of them.
#   check_layers_test.sh <root of the checkout>
set -eu
root=$1
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
(cd "$root" && find . \( -path ./build -o -path './.*' \) -prune -o -type f \
  \( -name '*.h' -o -name '*.cc' -o -name CMakeLists.txt -o -path './tools/*' -o -path './compile_flags.txt' \) -print | tar -cf - -T -) | tar -xf - -C "$copy"

"$copy/tools/check_layers" "$copy" > "$copy/output" || { cat "$copy/output"; echo "the sources themselves fail"; exit 1; }

# plant <file> <line> <what the complaint must say>
plants=0
plant() {
  plants=$((plants + 1))
  cp "$copy/$1" "$copy/kept" 2>/dev/null || : > "$copy/kept"
  mkdir -p "$(dirname "$copy/$1")"
  printf '%s\n' "$2" >> "$copy/$1"
  if "$copy/tools/check_layers" "$copy" > "$copy/output"; then
    echo "not seen: $2 in $1"
    exit 1
  fi
  grep -q "$1:.*error: .*$3\|$1: error: .*$3" "$copy/output" || { cat "$copy/output"; echo "seen, but not as '$3': $2 in $1"; exit 1; }
  [ "$(grep -c error: "$copy/output")" = 1 ] || { cat "$copy/output"; echo "more than the planted arrow is named"; exit 1; }
  if [ -s "$copy/kept" ]; then mv "$copy/kept" "$copy/$1"; else rm -f "$copy/$1" "$copy/kept"; fi
}

plant core/include/prescene/core/check.h '#include "prescene/geometry/pose.h"' 'core may not use geometry'
plant geometry/planted.cc '#include "prescene/belief/scene.h"' 'geometry may not use belief'
plant filter/planted.cc '#include "prescene/rendering/gpu/egl_renderer.h"' 'filter may not use rendering/gpu'
plant tests/geometry/planted_test.cc '#include "prescene/queries/query_engine.h"' 'tests/geometry may not use queries'
plant belief/planted.cc '#include <btBulletDynamicsCommon.h>' 'is not for belief'
plant filter/planted.cc '#include <dds/dds.h>' 'is not for filter'
plant rendering/reference/planted.cc '#include <EGL/egl.h>' 'is not for rendering/reference'
plant core/planted.cc '#include <Eigen/Core>' 'is not for core'
plant geometry/planted.cc '#include <boost/any.hpp>' 'belongs to no library'
plant geometry/planted.cc '#include "../core/check.h"' 'climbs out'
plant geometry/planted.cc '#include "prescene/core/no_such_file.h"' 'there is no core/include/prescene/core/no_such_file.h'
plant tests/geometry/planted_test.cc '#include "tests/support/no_such_file.h"' 'there is no tests/support/no_such_file.h'
plant geometry/planted.cc '#include "no_such_file.h"' 'is not a file beside this one'
plant geometry/planted.cc '#include <prescene/core/no_such_file.h>' 'there is no core/include/prescene/core/no_such_file.h'
plant benchmarks/planted.cc '#include "benchmarks/no_such_file.h"' 'there is no benchmarks/no_such_file.h'
plant geometry/planted.cc '#include "ros_messages.h"' 'is not a file beside this one'
plant collision/planted.cc '#define HWY_TARGET_INCLUDE "collide.cc"' 'HWY_TARGET_INCLUDE must be "planted.cc"'
plant service/planted.cc 'const std::string text = json.dump();' 'is for belief/json_values.cc only'
plant novelty/planted.cc '#include <vector>' 'lies in no folder'
plant geometry/include/prescene/geometry/pose.h '#include "prescene/geometry/cancellable.h"' 'is in geometry/internal and not installed'
plant geometry/include/prescene/geometry/planted.h '#pragma once' 'not among the HEADERS'
plant geometry/internal/prescene/geometry/planted.h '#pragma once' 'not among the SHARED_HEADERS'
plant geometry/CMakeLists.txt 'prescene_module(planted HEADERS planted.h)' 'there is no geometry/include/prescene/geometry/planted.h'
plant geometry/CMakeLists.txt 'prescene_module(planted SHARED_HEADERS pose.h)' 'there is no geometry/internal/prescene/geometry/pose.h'

grep -v '^-Igeometry/include$' "$root/compile_flags.txt" > "$copy/compile_flags.txt"
if "$copy/tools/check_layers" "$copy" > "$copy/output" 2>&1; then echo "not seen: a missing folder in compile_flags.txt"; exit 1; fi
grep -q 'add the line -Igeometry/include' "$copy/output" || { cat "$copy/output"; exit 1; }
echo "$plants planted arrows and a missing folder of headers are seen"
