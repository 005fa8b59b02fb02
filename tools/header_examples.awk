# SPDX-License-Identifier: Apache-2.0
# Extracts the usage examples of headers. An example is a run of comment lines whose text is indented by two spaces or
# more; what follows a line that begins with "- " is a list, not an example.
#
# Input: lines "<library> <header>", headers below the root of the checkout. Prints a source with one function an
# example, in namespace <that of the header>::given_<library>::<header>, where its names are looked up from the inside
# outwards: what tests/examples/<library>.h declares for this header, what it declares for the library, and what the
# header's own namespace has. With -v list=1: prints the headers that have examples instead.

function complain(text) {
  printf "%s:%d: error: %s\n", header, number, text > "/dev/stderr"
  failed = 1
}

# The text of a comment line, its indentation kept; sets is_comment.
function comment_text(line) {
  is_comment = sub(/^[ \t]*\/\/\/?/, "", line)
  return line
}

# "... a, b" stands for whatever is done with a and b.
function without_dots(code,    place, rest, comment) {
  comment = ""
  if (match(code, / +\/\/ .*$/)) {
    comment = substr(code, RSTART)
    code = substr(code, 1, RSTART - 1)
  }
  place = match(code, /(^| )\.\.\.( |$)/)
  if (place) {
    rest = substr(code, RSTART + RLENGTH)
    sub(/;$/, "", rest)
    code = substr(code, 1, RSTART - 1) " prescene::do_something_with(" rest ");"
  }
  return code comment
}

{
  library = $1
  header = $2
  number = examples = in_example = in_list = 0
  space = ""
  folder = header
  sub(/\/.*/, "", folder)
  while ((getline line < header) > 0) {
    ++number
    if (space == "" && index(line, "namespace prescene::" folder) == 1 && match(line, /prescene[A-Za-z_:]*/))
      space = substr(line, RSTART, RLENGTH)
    text = comment_text(line)
    if (is_comment && text ~ /^ - /) {
      in_example = 0
      in_list = 1
      continue
    }
    if (!is_comment || text !~ /^  / || text ~ /^ *$/) {
      in_example = in_list = 0
      continue
    }
    if (!in_example && !in_list) {
      if (text ~ /^ *- /) in_list = 1
      else {
        in_example = 1
        body[++examples] = "[[maybe_unused]] prescene::core::Status example_" examples "() {\n#line " number " \"" header "\"\n"
      }
    }
    if (in_example) body[examples] = body[examples] without_dots(text) "\n"
  }
  if (!number) complain("there is no such header")
  close(header)
  if (!examples) next
  if (list) { print header; next }
  if (space == "") complain("an example, but no namespace prescene::" folder)
  included = header
  sub(/^.*\/(include|internal)\/prescene\//, "prescene/", included)
  includes = includes "#include \"" included "\"\n"
  if (!(library in seen)) {
    seen[library] = 1
    givens = givens "#include \"" library ".h\"\n"
  }
  stem = header
  sub(/.*\//, "", stem)
  gsub(/[^A-Za-z0-9_]/, "_", stem)
  functions = functions "\nnamespace " space "::given_" library "::" stem " {\n"
  for (i = 1; i <= examples; ++i) functions = functions body[i] "  return prescene::core::ok_status();\n}\n"
  functions = functions "}\n"
  delete body
}

END {
  if (failed) exit 1
  if (list) exit
  print "// The examples in the comments of headers, made by tools/header_examples.awk."
  print includes "#include \"prescene/core/status.h\"\n\n#include \"do_something.h\"\n" givens functions
}
