# SPDX-License-Identifier: Apache-2.0
# The work of tools/check_draws. Input: C++ sources.

# Notes a draw of `stream` in the current argument of each open parenthesis, out to the innermost body of a function or lambda:
# statements there are evaluated in order. Complains if another argument of the same parenthesis draws from that stream.
function draw(stream,    k) {
  for (k = depth; k > 0 && opening[k] != "body"; --k) {
    if (opening[k] != "(") continue
    if ((k, stream) in argument_of && argument_of[k, stream] != argument[k]) {
      if (!((FILENAME, FNR) in named)) {
        printf "%s:%d: error: two draws of %s in the arguments of one call; give each a declaration of its own\n", FILENAME, FNR, stream
        ++errors
      }
      named[FILENAME, FNR] = 1
    }
    argument_of[k, stream] = argument[k]
    streams[k] = streams[k] " " stream
  }
}

function forget(k,    n, i, name) {
  n = split(streams[k], name, " ")
  for (i = 1; i <= n; ++i) delete argument_of[k, name[i]]
  streams[k] = ""
  argument[k] = 0
}

function open(what) {
  opening[++depth] = what
  forget(depth)
}

FNR == 1 { depth = 0; last = "" }

{
  line = $0
  gsub(/"([^"\\]|\\.)*"/, "\"\"", line)
  gsub(/'([^'\\]|\\.)'/, "' '", line)
  sub(/\/\/.*/, "", line)
  while (match(line, /[][(){},;]|[A-Za-z_0-9]+(\.|->)(uniform|normal|next_u32|next_u64|uniform_below|between|about)\(/)) {
    before = substr(line, 1, RSTART - 1)
    gsub(/[ \t]/, "", before)
    if (before != "") last = substr(before, length(before))
    token = substr(line, RSTART, RLENGTH)
    line = substr(line, RSTART + RLENGTH)
    if (RLENGTH > 1) {
      sub(/(\.|->)[a-z_0-9]+\($/, "", token)
      draw(token)
      open("(")
      last = "("
      continue
    }
    if (token == "{") open(last == ")" || last == "]" ? "body" : "{")
    else if (token == "(" || token == "[") open(token)
    else if (token == ",") ++argument[depth]
    else if (token == ";") forget(depth)
    else if (depth > 0) --depth
    last = token
  }
  gsub(/[ \t]/, "", line)
  if (line != "") last = substr(line, length(line))
}

END {
  if (errors) exit 1
}
