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

option(PRESCENE_PARALLEL_STD_THREAD "Run parallel loops on std::thread instead of oneTBB, for the thread sanitizer" OFF)
if(PRESCENE_PARALLEL_STD_THREAD)
  add_compile_definitions(PRESCENE_PARALLEL_STD_THREAD)
endif()

option(PRESCENE_DCHECKS "Arm the checks on hot paths, ours and those of the standard library" OFF)
if(PRESCENE_DCHECKS)
  add_compile_definitions(PRESCENE_DCHECKS=1 _GLIBCXX_ASSERTIONS)
endif()
