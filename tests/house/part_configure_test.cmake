# SPDX-License-Identifier: Apache-2.0
# Configures the collision library alone, settings as in this build, with every package hidden that it is said to do
# without. Nothing is compiled: what would be compiled must be sources of collision and what it uses, with the very
# commands of this build, so that the libraries are those that this build makes and tests.
cmake_minimum_required(VERSION 3.25)
set(work "${PRESCENE_BUILD_DIR}/part_configure_test")
file(REMOVE_RECURSE "${work}")

# Lines of the cache have the form of arguments.
file(STRINGS "${PRESCENE_BUILD_DIR}/CMakeCache.txt" settings REGEX
     "^(CMAKE_(C|CXX)_(COMPILER|FLAGS)(_[A-Z]+)?|CMAKE_BUILD_TYPE|PRESCENE_[A-Z_]+):[A-Z]+=")
list(FILTER settings EXCLUDE REGEX "^PRESCENE_MODULES")
list(TRANSFORM settings PREPEND -D)
separate_arguments(HIDDEN)
list(TRANSFORM HIDDEN REPLACE "(.+)" "-DCMAKE_DISABLE_FIND_PACKAGE_\\1=ON")

# configure(<modules> <result> <output>)
function(configure modules result output)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -S "${PRESCENE_SOURCE_DIR}" -B "${work}" -G "${GENERATOR}" ${settings} ${HIDDEN}
            "-DPRESCENE_MODULES=${modules}" -DBUILD_TESTING=ON
    RESULT_VARIABLE failed OUTPUT_VARIABLE text ERROR_VARIABLE text)
  set(${result} "${failed}" PARENT_SCOPE)
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

configure(collision failed output)
if(failed)
  message(FATAL_ERROR "the collision library does not configure without other packages:\n${output}")
endif()
foreach(left_out distance_fcl_reference_test.cc ray_queries_reference_test.cc rational_reference.cc)
  if(NOT output MATCHES "Left out for lack of [^\n]*${left_out}")
    message(FATAL_ERROR "nothing is said of ${left_out}:\n${output}")
  endif()
endforeach()

# compiled(<folder of a build> <result>): its compile commands, without the names of the folders.
function(compiled folder result)
  file(STRINGS "${folder}/compile_commands.json" commands REGEX "\"command\": ")
  string(REPLACE "${folder}" "" commands "${commands}")
  string(REPLACE "${PRESCENE_SOURCE_DIR}" "" commands "${commands}")
  set(${result} "${commands}" PARENT_SCOPE)
endfunction()
compiled("${work}" of_part)
compiled("${PRESCENE_BUILD_DIR}" of_this)
set(libraries 0)
foreach(command IN LISTS of_part)
  if(NOT command MATCHES " -c ([^ \"]+)")
    message(FATAL_ERROR "not a compile command: ${command}")
  endif()
  set(source "${CMAKE_MATCH_1}")
  if(source MATCHES "^/(core|geometry|collision)/")
    set(sources 1)
    if(source MATCHES "/Unity/")  # several compiled as one
      file(STRINGS "${work}${source}" sources REGEX "^#include")
      list(LENGTH sources sources)
    endif()
    math(EXPR libraries "${libraries} + ${sources}")
    if(NOT command IN_LIST of_this)
      message(FATAL_ERROR "in the build of the part alone ${source} is compiled in another way:\n${command}")
    endif()
  elseif(NOT source MATCHES "^/(precompiled|tests/(core|geometry|collision|support|fuzz|examples|house))/" AND NOT source MATCHES "^/core/parallel_std")
    message(FATAL_ERROR "${source} does not belong to the collision library")
  endif()
endforeach()
if(libraries LESS 80)
  message(FATAL_ERROR "only ${libraries} sources of libraries would be compiled")
endif()

configure("collision;colision" failed output)
if(NOT failed OR NOT output MATCHES "no library 'colision'\\.[ \n]+There[ \n]+are:[ \n]+all .*collision_dops")
  message(FATAL_ERROR "a library that does not exist is taken for a part (${failed}):\n${output}")
endif()
configure(rendering_reference failed output)
if(NOT failed OR NOT output MATCHES "library[ \n]+rendering[ \n]+needs[ \n]+meshoptimizer::meshoptimizer")
  message(FATAL_ERROR "what rendering needs is hidden, and it says (${failed}):\n${output}")
endif()
file(REMOVE_RECURSE "${work}")
