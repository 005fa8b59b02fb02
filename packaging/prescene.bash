# SPDX-License-Identifier: Apache-2.0
# Completes verbs, options and their choices in bash. What there is, the program itself says (--help), so that this file
# never lags behind it.

_prescene() {
  local program=${COMP_WORDS[0]} current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]}
  local verb= word help words=
  COMPREPLY=()
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] || { verb=$word; break; }
  done
  help=$("$program" ${verb:+"$verb"} --help 2> /dev/null) || return 0
  if [[ $current == -* ]]; then
    words=$(grep -E '^ +-' <<< "$help" | grep -oE '^ *(-[a-zA-Z], ?)?--[a-z0-9-]+' | grep -oE -- '--[a-z0-9-]+')
  elif [[ $before == --* ]]; then
    words=$(sed -nE "s/^ *(-[a-zA-Z], ?)?$before [A-Z]*:?\{([^}]*)\}.*/\2/p" <<< "$help" | tr ',' '\n')
  elif [[ -z $verb ]]; then
    words=$(awk '/^Subcommands:/ {listed = 1; next} listed && /^  [a-z]/ {print $1}' <<< "$help")
  elif [[ $before == "$verb" ]]; then
    words=$(sed -nE 's/^ +[A-Za-z][A-Za-z_-]* [A-Z]*:?\(?\{([^}]*)\}.*/\1/p' <<< "$help" | tr ',' '\n')
  fi
  # Where there is nothing to choose from, bash completes the names of files.
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}

complete -o bashdefault -o default -F _prescene prescene
