# SPDX-License-Identifier: Apache-2.0
# The work of tools/check_layers. Input: a list of source files. Variables: `rules`, the file of allowed arrows; `lists`, a
# file that names the CMakeLists.txt of the modules.

function complain(place, text) {
  printf "%s: error: %s\n", place, text
  ++errors
}

# The longest folder with a `uses` line that `path` lies in; empty if there is none.
function module_of(path,    folder) {
  folder = path
  while (sub(/\/[^\/]*$/, "", folder)) {
    if (folder in is_module) return folder
  }
  return ""
}

# True when `module` may use `other`: reach[module, other] holds the closure of the arrows.
function may_use(module, other) {
  return module == other || (module, other) in reach
}

function matches(pattern, header,    stem) {
  if (pattern ~ /\*$/) {
    stem = substr(pattern, 1, length(pattern) - 1)
    return substr(header, 1, length(stem)) == stem
  }
  return pattern == header
}

function is_standard(header) {
  return header ~ /^[a-z_0-9]+$/
}

# True when `folder` (an entry of an `outside` line) covers `module`.
function covers(folder, module) {
  if (folder == "everywhere") return 1
  if (folder == "tests") return module ~ /^tests\//
  if (folder ~ /\+$/) return may_use(module, substr(folder, 1, length(folder) - 1))
  return module == folder
}

function check_outside(place, module, header,    i, j, n, folders, known) {
  if (is_standard(header)) return
  known = 0
  for (i = 1; i <= outsides; ++i) {
    if (!matches(outside_pattern[i], header)) continue
    known = 1
    n = split(outside_folders[i], folders, " ")
    for (j = 1; j <= n; ++j) if (covers(folders[j], module)) return
  }
  if (known) complain(place, "<" header "> is not for " module " (its 'outside' line in tools/layers.txt says where it may be used)")
  else complain(place, "<" header "> belongs to no library named in tools/layers.txt; add an 'outside' line")
}

# "prescene/<module>/<header>" is <module>/include/prescene/<module>/<header>, or in <module>/internal if it is not installed,
# also where nothing was configured yet; a header of tests or benchmarks is included by its path.
function check_ours(place, path, module, header,    other, target) {
  other = module_of(name_of(header))
  target = header ~ /^prescene\// ? other "/include/" header : header
  if (header ~ /^prescene\// && (other "/internal/" header) in is_source) {
    target = other "/internal/" header
    if (path ~ /\/include\/prescene\//) complain(place, "\"" header "\" is in " other "/internal and not installed, as this header is")
  }
  if (other == "") complain(place, "\"" header "\" belongs to no module of tools/layers.txt")
  else if (!may_use(module, other)) complain(place, module " may not use " other " (\"" header "\")")
  else if (!(target in is_source)) complain(place, "there is no " target " (\"" header "\")")
}

function is_ours(header) {
  return header ~ /^(prescene|tests|benchmarks)\//
}

function name_of(header) {
  sub(/^prescene\//, "", header)
  return header
}

function check_relative(place, path, module, header,    folder, target, line, i) {
  folder = path
  sub(/\/[^\/]*$/, "", folder)
  if (header ~ /(^|\/)\.\.\//) {
    complain(place, "\"" header "\" climbs out of its folder; include \"prescene/<module>/<header>\"")
    return
  }
  target = folder "/" header
  if (target in is_source) {
    if (module_of(target) != module) complain(place, "\"" header "\" reaches into " module_of(target) " past its public headers")
    return
  }
  for (i = 1; i <= generateds; ++i) {
    if (generated_folder[i] == module && matches(generated_pattern[i], header)) return
  }
  complain(place, "\"" header "\" is not a file beside this one, nor \"prescene/<module>/<header>\"")
}

# Highway includes a source once more for each instruction set, by the name that the source gives.
function check_itself(place, path, line,    name) {
  name = path
  sub(/.*\//, "", name)
  if (index(line, "\"" name "\"") == 0) complain(place, "HWY_TARGET_INCLUDE must be \"" name "\", this source")
}

function read_rules(    line, n, part, i, j, k, changed, pair, order, count) {
  while ((getline line < rules) > 0) {
    ++rule_lines
    sub(/#.*/, "", line)
    n = split(line, part, " ")
    if (n == 0) continue
    if (part[1] == "uses" && n >= 2) {
      is_module[part[2]] = 1
      order[++count] = part[2]
      for (i = 3; i <= n; ++i) reach[part[2], part[i]] = 1
    } else if (part[1] == "outside" && n >= 3) {
      outside_pattern[++outsides] = part[2]
      outside_folders[outsides] = part[3]
      for (i = 4; i <= n; ++i) outside_folders[outsides] = outside_folders[outsides] " " part[i]
    } else if (part[1] == "text" && n == 3) {
      once_text[++onces] = part[2]
      once_file[onces] = part[3]
    } else if (part[1] == "generated" && n == 3) {
      generated_folder[++generateds] = part[2]
      generated_pattern[generateds] = part[3]
    } else {
      complain(rules ":" rule_lines, "cannot read '" line "'")
    }
  }
  if (rule_lines == 0) {
    complain(rules, "cannot be read")
    return
  }
  # An arrow points to a line above its own, so that no cycle can be written down.
  for (pair in reach) {
    split(pair, part, SUBSEP)
    if (!(part[2] in is_module)) complain(rules, part[1] " uses " part[2] ", which has no 'uses' line")
  }
  for (i = 1; i <= count; ++i) {
    for (j = i; j <= count; ++j) {
      if ((order[i], order[j]) in reach && order[j] !~ /^tests\//) complain(rules, order[i] " uses " order[j] ", which stands below it")
    }
  }
  # tests/X mirrors X and its backends.
  for (i = count; i >= 1; --i) {
    if (order[i] ~ /^tests\//) continue
    k = "tests/" order[i]
    if (!(k in is_module)) {
      is_module[k] = 1
      order[++count] = k
    }
    reach[k, order[i]] = 1
    reach[k, "tests/support"] = 1
    for (j in is_module) if (index(j, order[i] "/") == 1) reach[k, j] = 1
  }
  do {
    changed = 0
    for (i = 1; i <= count; ++i) for (j = 1; j <= count; ++j) {
      if (!((order[i], order[j]) in reach)) continue
      for (k = 1; k <= count; ++k) {
        if ((order[j], order[k]) in reach && !((order[i], order[k]) in reach)) {
          reach[order[i], order[k]] = 1
          changed = 1
        }
      }
    }
  } while (changed)
}

# Takes the headers that the CMakeLists.txt of a module lists: HEADERS belong into its include/, SHARED_HEADERS into its
# internal/. A variable that the file itself sets stands for what it was set to.
function read_list(list,    folder, line, n, token, i, j, command, keyword, of_variable, count, header) {
  folder = list
  sub(/\/?[^\/]*$/, "", folder)
  command = keyword = ""
  while ((getline line < list) > 0) {
    sub(/#.*/, "", line)
    gsub(/[()]/, " & ", line)
    n = split(line, token, " ")
    for (i = 1; i <= n; ++i) {
      if (token[i] == "(") {
        command = i > 1 ? token[i - 1] : command
        keyword = ""
      } else if (command == "set" && keyword == "") keyword = "$" token[i]
      else if (token[i] ~ /^[A-Z_]+$/) keyword = token[i]
      else if (token[i] ~ /\.h$/) of_variable[keyword] = of_variable[keyword] " " token[i]
      else if (token[i] ~ /^\$\{.*\}$/) of_variable[keyword] = of_variable[keyword] of_variable["$" substr(token[i], 3, length(token[i]) - 3)]
    }
  }
  close(list)
  count = split(of_variable["HEADERS"], header, " ")
  for (j = 1; j <= count; ++j) listed[folder "/include/prescene/" folder "/" header[j]] = list
  count = split(of_variable["SHARED_HEADERS"], header, " ")
  for (j = 1; j <= count; ++j) listed[folder "/internal/prescene/" folder "/" header[j]] = list
}

# Each header of an include/ or internal/ is listed as such, and each that is listed is there.
function check_headers(    list, path) {
  while ((getline list < lists) > 0) read_list(list)
  for (path in is_source) {
    if (path ~ /\/include\/prescene\// && !(path in listed))
      complain(path, "not among the HEADERS of a CMakeLists.txt, so not installed; move it to internal/ (SHARED_HEADERS) or beside its sources")
    if (path ~ /\/internal\/prescene\// && !(path in listed)) complain(path, "not among the SHARED_HEADERS of a CMakeLists.txt")
  }
  for (path in listed) if (!(path in is_source)) complain(listed[path], "there is no " path)
}

BEGIN { read_rules() }

{
  is_source[$0] = 1
  sources[++source_count] = $0
}

END {
  check_headers()
  for (s = 1; s <= source_count; ++s) {
    path = sources[s]
    module = module_of(path)
    if (module == "") {
      complain(path, "lies in no folder of tools/layers.txt; add a 'uses' line")
      continue
    }
    number = 0
    while ((getline line < path) > 0) {
      ++number
      for (i = 1; i <= onces; ++i)
        if (index(line, once_text[i]) && path != once_file[i] && path !~ /^tests\//)
          complain(path ":" number, "'" once_text[i] "' is for " once_file[i] " only (its 'text' line in tools/layers.txt)")
      if (line ~ /^[ \t]*#[ \t]*define[ \t]+HWY_TARGET_INCLUDE[ \t]/) check_itself(path ":" number, path, line)
      if (line !~ /^[ \t]*#[ \t]*include/) continue
      ++includes
      header = line
      sub(/^[ \t]*#[ \t]*include[ \t]*/, "", header)
      opening = substr(header, 1, 1)
      place = path ":" number
      if (opening != "\"" && opening != "<") {
        complain(place, "an include whose name is a macro cannot be checked")
        continue
      }
      header = substr(header, 2)
      sub(/[">].*/, "", header)
      if (is_ours(header)) check_ours(place, path, module, header)
      else if (opening == "<") check_outside(place, module, header)
      else check_relative(place, path, module, header)
      if (path ~ /^tests\// && is_ours(header)) tested[name_of(header)] = 1
    }
    close(path)
  }
  for (s = 1; s <= source_count; ++s) {
    path = sources[s]
    if (path ~ /^(tests|benchmarks)\// || path !~ /\.cc$/) continue
    header = path
    sub(/\.cc$/, ".h", header)
    test = "tests/" path
    sub(/\.cc$/, "_test.cc", test)
    if (!(header in tested) && !(test in is_source)) untested = untested "\n  " path
  }
  if (untested != "") print "warning: no test includes the header of" untested
  if (errors) {
    printf "%d arrows point the wrong way\n", errors
    exit 1
  }
  printf "%d includes in %d sources follow tools/layers.txt\n", includes, source_count
}
