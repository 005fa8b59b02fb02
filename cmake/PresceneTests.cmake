# SPDX-License-Identifier: Apache-2.0
# Test executables and fuzz targets. Each GoogleTest case becomes a CTest test; its label is the kind of the file that it
# is written in: *_laws_test.cc law, *_contract_test.cc and *_contract.h contract, *_reference_test.cc reference,
# *_equivalence_test.cc equivalence, *_statistics_test.cc statistical, tests/system system, tests/real_data real_data,
# tests/scenarios scenario, everything else unit.

# RapidCheck would otherwise draw another seed in every run.
set(PRESCENE_TEST_ENVIRONMENT "RC_PARAMS=seed=20220" "PRESCENE_SOURCE_DIR=${PROJECT_SOURCE_DIR}" "PRESCENE_BUILD_DIR=${PROJECT_BINARY_DIR}")
if(PRESCENE_SANITIZERS MATCHES "address")
  list(APPEND PRESCENE_TEST_ENVIRONMENT "ASAN_OPTIONS=detect_stack_use_after_return=1:strict_init_order=1"
       "UBSAN_OPTIONS=print_stacktrace=1")
elseif(PRESCENE_SANITIZERS MATCHES "thread")
  list(APPEND PRESCENE_TEST_ENVIRONMENT
       "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tools/tsan.supp:halt_on_error=1:second_deadlock_stack=1")
endif()
set(PRESCENE_FUZZERS OFF CACHE BOOL "Build fuzz targets as libFuzzer programs (clang) instead of replays of their corpus")

add_custom_target(prescene_fuzzers)

# prescene_tests(<name> SOURCES <cc>... USES <module>... PRIVATE_LINKS <target>...
#   OPTIMISED                 compiled like a library (PresceneCompiler.cmake)
#   TIMEOUT <seconds>         of each case, default 300
#   RESOURCE_LOCK <names>)    cases that share one of these names never run at the same time
# makes the executable <name>_tests, if this build has what it uses (PresceneParts.cmake).
function(prescene_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 T "OPTIMISED" "TIMEOUT" "SOURCES;USES;PRIVATE_LINKS;RESOURCE_LOCK")
  if(T_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "prescene_tests(${name}): unknown arguments ${T_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT T_TIMEOUT)
    set(T_TIMEOUT 300)
  endif()
  set(target ${name}_tests)
  set(libraries GTest::gmock GTest::gtest_main ${T_PRIVATE_LINKS})
  prescene_test_wanted(wanted ${target} USES ${T_USES} LINKS ${libraries})
  if(NOT wanted)
    return()
  endif()
  list(TRANSFORM T_USES PREPEND prescene::)
  add_executable(${target} ${T_SOURCES})
  target_link_libraries(${target} PRIVATE ${T_USES} ${T_PRIVATE_LINKS} GTest::gmock GTest::gtest_main)
  prescene_unity(${target})
  set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 12)  # tests have many names of their own
  if(T_OPTIMISED)
    prescene_precompile(${target} optimised_tests Eigen3::Eigen tl::expected GTest::gmock)
  else()
    prescene_precompile(${target} tests Eigen3::Eigen tl::expected GTest::gmock)
  endif()
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/tests")

  # Discovery runs when CTest starts, so that building needs to run nothing.
  set(list_file "${CMAKE_CURRENT_BINARY_DIR}/${target}_list.cmake")
  set(include_file "${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake")
  file(RELATIVE_PATH folder "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  file(GENERATE OUTPUT "${include_file}" CONTENT "
set(prescene_test_executable \"$<TARGET_FILE:${target}>\")
set(prescene_test_list \"${list_file}\")
set(prescene_test_target \"${target}\")
set(prescene_test_folder \"${folder}\")
set(prescene_test_timeout \"${T_TIMEOUT}\")
set(prescene_test_environment \"${PRESCENE_TEST_ENVIRONMENT}\")
set(prescene_test_resource_lock \"${T_RESOURCE_LOCK}\")
include(\"${PROJECT_SOURCE_DIR}/cmake/discover_tests.cmake\")
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${include_file}")
endfunction()

# prescene_more_tests(<name> SOURCES <cc>... USES <module>... PRIVATE_LINKS <target>...) adds sources to <name>_tests, or
# leaves them out of the build of a part that lacks what they use: references, above all.
function(prescene_more_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 T "" "" "SOURCES;USES;PRIVATE_LINKS")
  if(NOT TARGET ${name}_tests)
    return()
  endif()
  list(JOIN T_SOURCES " " sources)
  prescene_test_wanted(wanted "${sources}" USES ${T_USES} LINKS ${T_PRIVATE_LINKS})
  if(wanted)
    list(TRANSFORM T_USES PREPEND prescene::)
    target_sources(${name}_tests PRIVATE ${T_SOURCES})
    prescene_unity_except_simd(${T_SOURCES})
    target_link_libraries(${name}_tests PRIVATE ${T_USES} ${T_PRIVATE_LINKS})
  endif()
endfunction()

# prescene_fuzz_target(<name> SOURCES <name>_fuzz.cc USES <module>... PRIVATE_LINKS <target>...)
# With PRESCENE_FUZZERS the libFuzzer program fuzz_<name>; otherwise fuzz_<name> feeds each file of
# tests/fuzz/corpus/<name> through the same entry point once, as a CTest test with the label fuzz.
function(prescene_fuzz_target name)
  cmake_parse_arguments(PARSE_ARGV 1 F "" "" "SOURCES;USES;PRIVATE_LINKS")
  prescene_test_wanted(wanted fuzz_${name} USES ${F_USES} LINKS ${F_PRIVATE_LINKS})
  if(NOT wanted)
    return()
  endif()
  list(TRANSFORM F_USES PREPEND prescene::)
  add_executable(fuzz_${name} ${F_SOURCES})
  target_link_libraries(fuzz_${name} PRIVATE ${F_USES} ${F_PRIVATE_LINKS})
  set_target_properties(fuzz_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/fuzz")
  prescene_precompile(fuzz_${name} checks Eigen3::Eigen tl::expected)
  add_dependencies(prescene_fuzzers fuzz_${name})
  if(PRESCENE_FUZZERS)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  else()
    if(NOT TARGET prescene_fuzz_replay)
      add_library(prescene_fuzz_replay OBJECT "${PROJECT_SOURCE_DIR}/tests/fuzz/replay_main.cc")
    endif()
    target_link_libraries(fuzz_${name} PRIVATE prescene_fuzz_replay)
    add_test(NAME fuzz.${name} COMMAND fuzz_${name} "${PROJECT_SOURCE_DIR}/tests/fuzz/corpus/${name}")
    set_tests_properties(fuzz.${name} PROPERTIES LABELS fuzz TIMEOUT 300 ENVIRONMENT "${PRESCENE_TEST_ENVIRONMENT}")
  endif()
endfunction()
