#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# What bash completes after `prescene`: every verb, the options of a verb, and the choices of an option.
#   completion_test.sh <root of the checkout> <program>
set -eu
root=$1
program=$2
# shellcheck source=/dev/null
source "$root/packaging/prescene.bash"

# after WORD...: what is offered for the last word.
after() {
  COMP_WORDS=("$program" "$@")
  COMP_CWORD=$#
  COMPREPLY=()
  _prescene
  printf '%s\n' "${COMPREPLY[@]}"
}
fail() { echo "$*"; exit 1; }
offers() {  # WORD in what is offered after the other words
  local wanted=$1
  shift
  after "$@" | grep -qx -- "$wanted" || fail "after 'prescene $*', '$wanted' is not offered but: $(after "$@" | tr '\n' ' ')"
}

verbs=$("$program" --help | awk '/^Subcommands:/ {listed = 1; next} listed && /^  [a-z]/ {print $1}')
[ "$(after '')" = "$verbs" ] || fail "after 'prescene', these are offered: $(after '' | tr '\n' ' ')"
offers predict pre
[ "$(after pre)" = predict ] || fail "'pre' could be $(after pre | tr '\n' ' ')"
for verb in $verbs; do
  # Each of its options, and nothing that it would refuse.
  offers --json "$verb" --
  offers --seed "$verb" --se
  for option in $(after "$verb" --); do
    "$program" "$verb" --help | grep -qE -- "(^|[ ,])$option( |,|\{|\$)" || fail "$verb has no option $option"
  done
done
offers lockstep predict --stepper ''
[ "$(after predict --stepper bu)" = bullet ] || fail "'--stepper bu' could be $(after predict --stepper bu | tr '\n' ' ')"
offers stability ask ''
[ -z "$(after predict scen)" ] || fail "in place of files, these are offered: $(after predict scen | tr '\n' ' ')"
[ -z "$(after nonsense --)" ] || fail "an unknown verb has options: $(after nonsense -- | tr '\n' ' ')"
