#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The verbs of ./dev. Runs in the root of the checkout.
set -euo pipefail

usage() {
  cat << 'END'
usage: ./dev VERB

  setup [run|develop|docs|python|package|interop|planning|browser|MODULE]...
                               install the missing Debian packages (default: run), or those that a module needs
  build [PRESET] [TARGET]...   build (default preset: release)
  test [--preset P] [--all] [FILTER]...
                               build, then run the tests of tests/, with --all also those that take long, or those whose
                               name matches a FILTER (regular expressions); --long K/N: the K-th of N parts of the long ones
  python [TEST]...             make the Python package in build/python/site and run its tests, or those whose names match
  package [python]             make the Debian packages in build/release, or that of the Python package in build/python
  demo                         record, replay and ask about a carton carried over a bin; report in build/demo/
  bench [NAME [OPTION]...]     run the benchmark NAME (default: all); results in build/bench/NAME.json
  lint [FILE | --recent K/N]   format, layer and clang-tidy checks; --recent: clang-tidy on what is new since origin/main (or
                               six hours) and on the K-th of N parts of the rest
  format [FILE]...             format the sources in place
  faults [FAULT] [SECONDS]     do to a running service what may happen to it, and print what came of it: all, or one of kill, power,
                               disk, rights, descriptors, memory, clock, publishers, second, reader, supervisor, flood, soak;
                               packets, which is not among all: malformed packets of RTPS (tools/packet_storm).
                               SECONDS: how long soak, flood and packets last (default 180, 30 and 120)
  fuzz [TARGET] [SECONDS]      run libFuzzer on one target or all, 60 s each
  fuzz --coverage [TARGET]...  what the corpora reach of their decoders: branches and lines, as a table
  docs                         check the links and file names in README.md and docs/; make the API reference in build/docs
  bless REASON                 accept the current scenario results as the new pinned ones
  trace-diff A B               name the first difference of two step traces

Presets: dev, release, checked, asan, tsan, coverage. Each verb does what it needs first and says how long it took.
PRESCENE_JOBS sets the number of parallel jobs (default: the number of processors). With PRESCENE_NO_SKIP=1 a test that would
be skipped, for want of data for example, fails with its reason.
END
}

jobs=${PRESCENE_JOBS:-$(nproc)}

say() { printf '%s\n' "== $*" >&2; }
fail() { printf '%s\n' "./dev: $*" >&2; exit 1; }

# timed <what> <command>...: says what is done, does it, says how long it took.
timed() {
  local what=$1 start=$SECONDS code=0
  shift
  say "$what"
  "$@" || code=$?
  if [ "$code" = 0 ]; then say "$what: done in $((SECONDS - start)) s"; else say "$what: FAILED ($code) after $((SECONDS - start)) s"; fi
  return "$code"
}

# ---------------------------------------------------------------------------------------------------- setup

installed() { [ "$(dpkg-query -W -f='${db:Status-Abbrev}' "$1" 2> /dev/null)" = "ii " ]; }

as_root() {
  if [ "$(id -u)" = 0 ]; then
    "$@"
  elif command -v sudo > /dev/null; then
    sudo "$@"
  else
    fail "installing packages needs root: run as root or install sudo"
  fi
}

# The downloaded archives are not kept: they would take another quarter of the space.
apt_install() {
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
    -o APT::Keep-Downloaded-Packages=false "$@"
}
apt_update() { as_root apt-get update -q; }

# Prints apt's own estimate, e.g. "186 MB to download, 798 MB on disk"; fails when apt does not know a package.
apt_estimate() {
  local plan
  plan=$(LC_ALL=C apt-get install --assume-no --no-install-recommends -o Debug::NoLocking=1 "$@" 2>&1) || true
  if grep -q '^E: \(Unable to locate\|Package .* has no\)' <<< "$plan"; then return 1; fi
  sed -n -e 's/^Need to get \(.*\) of archives\.$/\1 to download/p' \
    -e 's/^After this operation, \(.*\) of additional disk space will be used\.$/\1 on disk/p' <<< "$plan" |
    sed 's|^\(.*\)/\(.*\) to|\1 of \2 to|' | paste -sd, - | sed 's/,/, /'
}

verb_setup() {
  [ $# -gt 0 ] || set -- run
  local wanted package missing=() estimate
  wanted=$(tools/packages "$@") || exit 1
  for package in $wanted; do installed "$package" || missing+=("$package"); done
  [ ${#missing[@]} -gt 0 ] || return 0
  command -v apt-get > /dev/null || fail "this is not Debian; install by your system's means: ${missing[*]}"
  if ! estimate=$(apt_estimate "${missing[@]}"); then
    timed "read Debian's package lists" apt_update
    estimate=$(apt_estimate "${missing[@]}") || fail "Debian 12 has all of these, this system's apt does not: ${missing[*]}"
  fi
  say "packages missing for $*: ${missing[*]}"
  say "with what they depend on: $estimate"
  if ! timed "install ${#missing[@]} packages" apt_install "${missing[@]}"; then
    # Lists older than the mirror's files name versions that are gone.
    timed "read Debian's package lists again" apt_update
    timed "install ${#missing[@]} packages" apt_install "${missing[@]}"
  fi
}

# ---------------------------------------------------------------------------------------------------- build

verb_build() {
  local preset=${1:-release}
  [ $# = 0 ] || shift
  grep -q "\"name\": \"$preset\"" CMakePresets.json || fail "no preset '$preset'; there are dev, release, checked, asan, tsan, coverage, python"
  verb_setup run
  # Configure each time, so that new files are seen. It takes about two seconds.
  timed "configure $preset" cmake --preset "$preset" --log-level=WARNING
  if [ $# -gt 0 ]; then set -- --target "$@"; fi
  timed "build $preset" cmake --build "build/$preset" -j "$jobs" "$@"
}

# ---------------------------------------------------------------------------------------------------- test

verb_test() {
  local preset=release filter=() which=(-LE '^long$')
  while [ $# -gt 0 ]; do
    case $1 in
      --preset) preset=${2:?--preset needs a name}; shift 2 ;;
      --all) which=(); shift ;;
      --long)
        [[ ${2:-} =~ ^[1-9][0-9]*/[1-9][0-9]*$ ]] || fail "--long needs a part such as 1/4"
        which=(-R "$(long_tests "${2%/*}" "${2#*/}")")
        shift 2
        ;;
      *) filter+=("$1"); shift ;;
    esac
  done
  verb_build "$preset"
  if [ ${#filter[@]} -gt 0 ]; then
    # Of several -R ctest heeds the last.
    timed "tests that match ${filter[*]}" run_tests "$preset" -R "$(IFS='|'; echo "${filter[*]}")"
  else
    timed "tests" run_tests "$preset" "${which[@]}"
  fi
}

# A regular expression of every N-th long test, from the K-th on.
long_tests() {
  grep -v '^#' tests/long_tests.txt | awk -v k="$1" -v n="$2" 'NR % n == k % n' | sed 's/[][\.*^$()+?{|]/\\&/g' | sed 's/.*/^&$/' | paste -sd'|' -
}

run_tests() {
  local preset=$1 code=0
  shift
  ctest --test-dir "build/$preset" -j "$jobs" --output-on-failure --no-tests=error --progress "$@" || code=$?
  # What tests have to say although they pass.
  grep -h '^compared: ' "build/$preset/Testing/Temporary/LastTest.log" || true
  return "$code"
}

# ---------------------------------------------------------------------------------------------------- Python

# The extension has a build folder of its own, since it takes other objects than programs do (cmake/PresceneCompiler.cmake).
# Its answers are compared with those of the program, which is built beside it.
verb_python() {
  local filter=(-L '^python$')
  [ $# = 0 ] || filter+=(-R "$(IFS='|'; echo "$*")")
  verb_setup run python
  verb_build release prescene
  verb_build python prescene_python
  timed "tests of the Python package" run_tests python "${filter[@]}"
  say "PYTHONPATH=$PWD/build/python/site /usr/bin/python3"
}

# ---------------------------------------------------------------------------------------------------- Debian packages

# CPack asks dpkg-shlibdeps and file, which no build needs, what the programs depend on.
verb_package() {
  local folder=build/release
  [ $# = 0 ] || [ "$*" = python ] || fail "package takes nothing or 'python'"
  verb_setup run package
  if [ "${1:-}" = python ]; then
    folder=build/python
    verb_setup python
    verb_build python prescene_python
  else
    verb_build release
  fi
  timed "make the packages" env -C "$folder" cpack -G DEB
  say "packages in $folder: $(cd "$folder" && ls -- *.deb | paste -sd' ' -)"
}

# ---------------------------------------------------------------------------------------------------- demo, bench

verb_demo() {
  verb_build release prescene
  timed "demo" build/release/prescene demo -o build/demo
}

# Each program obeys --benchmark_out, be it of Google Benchmark or one of ours that compares with targets.
verb_bench() {
  local names=() name
  verb_build release
  if [ $# -gt 0 ]; then
    names=("$1")
    [ -x "build/release/bench_$1" ] || fail "no benchmark '$1'; there are: $(list_benchmarks)"
    shift
  else
    read -r -a names <<< "$(list_benchmarks)"
    [ ${#names[@]} -gt 0 ] || fail "there are no benchmarks"
  fi
  mkdir -p build/bench
  for name in "${names[@]}"; do
    timed "benchmark $name" "build/release/bench_$name" "--benchmark_out=build/bench/$name.json" "$@"
    say "results in build/bench/$name.json"
  done
}

list_benchmarks() { find build/release -maxdepth 1 -name 'bench_*' -type f -executable -printf '%f\n' | sed 's/^bench_//' | LC_ALL=C sort | paste -sd' ' -; }

# ---------------------------------------------------------------------------------------------------- lint, format

sources() {
  if [ $# -gt 0 ]; then printf '%s\n' "$@"; return; fi
  find ./* \( -path ./build -o -path './.*' \) -prune -o -type f \( -name '*.h' -o -name '*.cc' \) -print | sed 's|^\./||' | LC_ALL=C sort
}

format_check() { sources "$@" | xargs -r -P "$jobs" -n 20 clang-format-14 --dry-run --Werror; }
format_write() { sources "$@" | xargs -r -P "$jobs" -n 20 clang-format-14 -i; }

verb_format() {
  verb_setup develop
  timed "format" format_write "$@"
}

verb_lint() {
  verb_setup run develop
  timed "layer check" tools/check_layers
  timed "draw check" tools/check_draws
  if [ "${1:-}" = --recent ]; then timed "format check" format_check; else timed "format check" format_check "$@"; fi
  timed "configure tidy" cmake --preset tidy --log-level=WARNING
  timed "generate headers" cmake --build build/tidy -j "$jobs" --target prescene_generated
  timed "clang-tidy" tools/run_tidy build/tidy "$jobs" "$@"
}

# ---------------------------------------------------------------------------------------------------- faults

# Figures of docs/reference/reliability.md.
verb_faults() {
  local fault=${1:-all} seconds=${2:-} filter
  case $fault in
    all) filter='*' ;;
    kill) filter='*.Killed*' ;;
    power) filter='*.WhereThePowerFails*' ;;
    disk) filter='*.AFullDisk*' ;;
    rights) filter='*.AFolderWithoutRights*' ;;
    descriptors) filter='*Descriptors*' ;;
    memory) filter='*.WithoutMemory*:*.MemoryThatEnds*' ;;
    clock) filter='*.AClock*' ;;
    publishers) filter='*.Publishers*' ;;
    second) filter='*.ASecondService*' ;;
    reader) filter='*.AStoppedReader*' ;;
    supervisor) filter='*.StartedAgain*' ;;
    flood) filter='Flood.*' ;;
    soak) filter='Soak.*' ;;
    packets) filter= ;;
    *) fail "no fault '$fault'; there are: all kill power disk rights descriptors memory clock publishers second reader supervisor flood soak packets" ;;
  esac
  [[ $seconds =~ ^[0-9]*$ ]] || fail "how many seconds? not '$seconds'"
  if [ "$fault" = packets ]; then
    verb_build release prescene
    timed "faults: packets" tools/packet_storm build/release "${seconds:-120}"  # of its own: how often Cyclone ends is measured, not judged
    return
  fi
  verb_build release prescene system_flood_tests
  timed "faults: $fault" env PRESCENE_FAULTS=full "PRESCENE_SOAK_SECONDS=${seconds:-180}" "PRESCENE_FLOOD_SECONDS=${seconds:-30}" \
    build/release/tests/system_flood_tests "--gtest_filter=$filter" --gtest_brief=1
}

# ---------------------------------------------------------------------------------------------------- fuzz

verb_fuzz() {
  if [ "${1:-}" = --coverage ]; then
    verb_setup run develop
    timed "configure fuzz_coverage" cmake --preset fuzz_coverage --log-level=WARNING
    timed "build the replays" cmake --build build/fuzz_coverage -j "$jobs" --target prescene_fuzzers
    tools/fuzz_coverage build/fuzz_coverage "${@:2}"
    return
  fi
  local target=${1:-all} seconds=${2:-60} targets=() name
  verb_setup run develop
  timed "configure fuzz" cmake --preset fuzz --log-level=WARNING
  timed "build fuzz targets" cmake --build build/fuzz -j "$jobs" --target prescene_fuzzers
  if [ "$target" = all ]; then
    mapfile -t targets < <(find build/fuzz/fuzz -maxdepth 1 -name 'fuzz_*' -type f -executable -printf '%f\n' | sed 's/^fuzz_//' | LC_ALL=C sort)
  else
    [ -x "build/fuzz/fuzz/fuzz_$target" ] || fail "no fuzz target '$target' in tests/fuzz"
    targets=("$target")
  fi
  for name in "${targets[@]}"; do timed "fuzz $name for $seconds s" fuzz_one "$name" "$seconds"; done
}

# New inputs stay in build/fuzz/corpus; a crash is kept in build/fuzz/crashes and belongs into tests/fuzz/corpus/<name> with
# the fix, where every test run replays it.
fuzz_one() {
  local name=$1 seconds=$2
  mkdir -p "build/fuzz/corpus/$name" build/fuzz/crashes
  export UBSAN_OPTIONS=print_stacktrace=1
  "build/fuzz/fuzz/fuzz_$name" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 -verbosity=0 \
    "-artifact_prefix=build/fuzz/crashes/$name-" "build/fuzz/corpus/$name" "tests/fuzz/corpus/$name"
}

# ---------------------------------------------------------------------------------------------------- docs, bless

# The configuration and the folders of public headers, which Doxygen makes its pages of.
api_pages() {
  mkdir -p build/docs
  { cat docs/Doxyfile; find ./* -path ./build -prune -o -type d -path '*/include/prescene' -print | sed 's/^/INPUT += /'; } | doxygen -
}

verb_docs() {
  verb_setup docs
  timed "check the documents" tools/check_docs
  timed "make the API reference" api_pages
  say "API reference in build/docs/html/index.html"
}

verb_bless() {
  local reason="$*"
  if [ -z "$reason" ] && [ -t 0 ]; then read -r -p "Why may the pinned results change? " reason; fi
  [ -n "$reason" ] || fail "blessing needs a reason: ./dev bless 'contacts are solved with 20 iterations instead of 10'"
  verb_build release
  timed "bless" tools/bless build/release "$reason"
}

verb=${1:-help}
[ $# = 0 ] || shift
case $verb in
  setup | build | test | python | package | demo | bench | lint | format | faults | fuzz | docs | bless) "verb_$verb" "$@" ;;
  trace-diff) exec tools/trace-diff "$@" ;;
  help | -h | --help) usage ;;
  *) usage >&2; exit 2 ;;
esac
