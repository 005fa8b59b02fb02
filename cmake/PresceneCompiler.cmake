# SPDX-License-Identifier: Apache-2.0
# What holds for every build of ours, with or without a preset: the language, reproducible floating point, and ccache.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

# Same binary, input and seed give the same bits: the compiler may not fuse a multiply and an add on its own accord, and
# may not reorder floating-point arithmetic.
add_compile_options(-ffp-contract=off)
# The superword vectorizer of g++ 12 takes a pair of doubles that is rounded to float and widened again for the pair itself:
# exact arithmetic on float coordinates would then see coordinates that are not floats (tests/core/rounding_test.cc).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  add_compile_options(-fno-tree-slp-vectorize)
  # g++ collects its garbage again and again below half a GiB, which takes an eighth of the time of a build and changes no
  # byte of an object.
  add_compile_options(--param=ggc-min-heapsize=524288)
endif()
foreach(_flags "${CMAKE_CXX_FLAGS}" "${CMAKE_CXX_FLAGS_${CMAKE_BUILD_TYPE}}" "$ENV{CXXFLAGS}")
  if(_flags MATCHES "-ffast-math|-Ofast|-funsafe-math-optimizations|-ffp-contract=fast|-fassociative-math")
    message(FATAL_ERROR "Prescene promises reproducible results: remove '${CMAKE_MATCH_0}' from the compiler flags.")
  endif()
endforeach()

option(PRESCENE_CCACHE "Compile through ccache when it is installed" ON)
if(PRESCENE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(CCACHE_PROGRAM ccache)
  if(CCACHE_PROGRAM)
    # Paths below the checkout are made relative, so that two checkouts of the same sources share their hits.
    set(_launcher "${CMAKE_COMMAND}" -E env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" CCACHE_NOHASHDIR=1
        "CCACHE_SLOPPINESS=pch_defines,time_macros" "${CCACHE_PROGRAM}")
    set(CMAKE_C_COMPILER_LAUNCHER "${_launcher}")
    set(CMAKE_CXX_COMPILER_LAUNCHER "${_launcher}")
  endif()
endif()

# Set by the presets, so that a user's build with another compiler does not fail on a warning we have never seen.
set(PRESCENE_WARNINGS "" CACHE STRING "Warning flags")
separate_arguments(_warnings UNIX_COMMAND "${PRESCENE_WARNINGS}")
add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:${_warnings}>")

set(PRESCENE_SANITIZERS "" CACHE STRING "Sanitizer or instrumentation flags, for compiling and linking")
separate_arguments(_sanitizers UNIX_COMMAND "${PRESCENE_SANITIZERS}")
add_compile_options(${_sanitizers})
add_link_options(${_sanitizers})

# A module that Python loads takes in only position-independent code, which Debian's g++ does not make by itself: what it
# makes may go into programs alone. So the extension has a build folder of its own (the preset python), in which the
# libraries that it links are compiled again. The second option lets g++ inline as in a program: nobody puts functions of
# his own in the place of ours.
option(PRESCENE_PYTHON "Make the Python package, and all code position-independent for it" OFF)
if(PRESCENE_PYTHON)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-fno-semantic-interposition)
  endif()
endif()

option(PRESCENE_PARALLEL_STD_THREAD "Run parallel loops on std::thread instead of oneTBB, for the thread sanitizer" OFF)
if(PRESCENE_PARALLEL_STD_THREAD)
  add_compile_definitions(PRESCENE_PARALLEL_STD_THREAD)
endif()

option(PRESCENE_DCHECKS "Arm the checks on hot paths, ours and those of the standard library" OFF)
if(PRESCENE_DCHECKS)
  add_compile_definitions(PRESCENE_DCHECKS=1 _GLIBCXX_ASSERTIONS)
endif()

# Several sources of a library or a test program are compiled as one, which halves what a build costs: half of each
# compilation goes into headers. A file-local name is therefore used once in a library, or stands in a namespace of its
# file. The preset dev compiles each source alone, which shows that each includes what it uses.
option(PRESCENE_UNITY "Compile several sources as one" ON)
set(PRESCENE_UNITY_SOURCES 24 CACHE STRING "Sources compiled as one, 0 for all of a target")

# prescene_unity(<target>) for a target whose sources are known.
function(prescene_unity target)
  if(NOT PRESCENE_UNITY)
    return()
  endif()
  # A type of a source's own in a class that the source alone sees looks as if it stood in a header.
  target_compile_options(${target} PRIVATE "$<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>")
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${PRESCENE_UNITY_SOURCES})
  get_target_property(sources ${target} SOURCES)
  prescene_unity_except_simd(${sources})
endfunction()

# Sources that include themselves once for each instruction set (Highway) are compiled alone; CMake leaves out those with
# options of their own.
function(prescene_unity_except_simd)
  foreach(source IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH source)
    if(source MATCHES "\\.cc$" AND EXISTS "${source}")
      file(STRINGS "${source}" itself REGEX "hwy/foreach_target\\.h" LIMIT_COUNT 1)
      if(itself)
        set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
      endif()
    endif()
  endforeach()
endfunction()

# Sources that only check something are optimised less than libraries in a release build: they cost half of what a build
# costs, while most of a test's time is spent in libraries. The linker takes a function of a header that was not inlined
# from the test's object, even where a library calls it. Its bits are the same, since no option of ours reorders arithmetic,
# but not its speed: tests with long loops of their own, or that include headers of kernels, are OPTIMISED (prescene_tests).
set(PRESCENE_TEST_OPTIONS "$<$<CONFIG:Release>:-Og>")

# The headers that most sources include are parsed once for each set of targets: `libraries`; with GoogleTest's, `tests` and
# `optimised_tests`; and `checks`, other programs of the tests. The preset dev, which compiles each source alone, has none of
# it and shows that each source includes what it uses.
# g++ gives a source the optimisation of the precompiled headers, whatever the source's own options say: sources with such
# options (prescene_kernel_sources) do without.
option(PRESCENE_PRECOMPILED "Parse common headers once, where several sources are compiled as one by g++" ON)

# prescene_precompile(<target> <set> <library>...): `target` is optimised as its set is, and reads the set's precompiled
# headers, which see the outside libraries that are named.
function(prescene_precompile target set)
  if(set MATCHES "^(tests|checks)$")
    target_compile_options(${target} PRIVATE ${PRESCENE_TEST_OPTIONS})
  endif()
  if(NOT PRESCENE_PRECOMPILED OR NOT PRESCENE_UNITY OR NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  set(owner prescene_precompiled_${set})
  if(NOT TARGET ${owner})
    prescene_find("The precompiled headers" ${ARGN})
    # A folder of its own: they lie in one place whichever part is built.
    add_subdirectory("${PROJECT_SOURCE_DIR}/cmake/precompiled" "${PROJECT_BINARY_DIR}/precompiled/${set}")
  endif()
  target_precompile_headers(${target} REUSE_FROM ${owner})
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>")  # for ccache
endfunction()
