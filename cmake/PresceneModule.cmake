# SPDX-License-Identifier: Apache-2.0
# One folder a module, one library a module. A module's public headers lie in <folder>/include/prescene/<folder> and are
# included as "prescene/<folder>/<header>"; whoever does not name the module in USES, directly or through a module that
# does, cannot include them. What other modules of ours may include, but is not installed, lies in
# <folder>/internal/prescene/<folder> and is included in the same way. Headers of tests and benchmarks are included by their
# path from the project's root.

# Sources that the build makes (message types): clang-tidy needs them, though nothing else of the build.
add_custom_target(prescene_generated)

# Adds the folders that have a CMakeLists.txt.
function(prescene_add_folders)
  foreach(folder IN LISTS ARGN)
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/CMakeLists.txt")
      add_subdirectory(${folder})
    endif()
  endforeach()
endfunction()

# prescene_module(<name>
#   HEADERS <h>...            public: <folder>/include/prescene/<folder>/<h>; of tests and benchmarks <folder>/<h>
#   SHARED_HEADERS <h>...     for our modules and tests only: <folder>/internal/prescene/<folder>/<h>, not installed
#   PRIVATE_HEADERS <h>...    for this module's own sources only, included as "<h>"
#   SOURCES <cc>...           none: a module of headers only
#   USES <module>...          our modules that public headers may include
#   PRIVATE_USES <module>...  our modules that only the sources include
#   LINKS <target>...         outside libraries that public headers include
#   PRIVATE_LINKS <target>... outside libraries that only the sources include
#   NO_INSTALL)               for libraries of tests
# makes the library prescene_<name>, alias and installed name prescene::<name>, if this build is to have it
# (PresceneParts.cmake).
function(prescene_module name)
  cmake_parse_arguments(PARSE_ARGV 1 M "NO_INSTALL" ""
                        "HEADERS;SHARED_HEADERS;PRIVATE_HEADERS;SOURCES;USES;PRIVATE_USES;LINKS;PRIVATE_LINKS")
  if(M_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "prescene_module(${name}): unknown arguments ${M_UNPARSED_ARGUMENTS}")
  endif()
  file(RELATIVE_PATH folder "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  set(target prescene_${name})

  if(folder MATCHES "^(tests|benchmarks)(/|$)")
    prescene_test_wanted(wanted ${name} LIBRARY USES ${M_USES} ${M_PRIVATE_USES} LINKS ${M_LINKS} ${M_PRIVATE_LINKS})
  else()
    prescene_wanted(${name} wanted)
    if(wanted)
      prescene_use(${name} USES ${M_USES} ${M_PRIVATE_USES} LINKS ${M_LINKS} ${M_PRIVATE_LINKS})
    endif()
  endif()
  if(NOT wanted)
    return()
  endif()
  list(TRANSFORM M_USES PREPEND prescene::)
  list(TRANSFORM M_PRIVATE_USES PREPEND prescene::)

  if(M_SOURCES)
    add_library(${target} STATIC ${M_SOURCES} ${M_PRIVATE_HEADERS})
    target_link_libraries(${target} PUBLIC ${M_USES} ${M_LINKS} PRIVATE ${M_PRIVATE_USES} ${M_PRIVATE_LINKS})
    prescene_unity(${target})
    prescene_precompile(${target} libraries Eigen3::Eigen tl::expected)
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    target_link_libraries(${target} INTERFACE ${M_USES} ${M_LINKS})
    set(scope INTERFACE)
  endif()
  add_library(prescene::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} ${scope} cxx_std_20)

  if(folder MATCHES "^(tests|benchmarks)(/|$)")
    set(below "${folder}")
    set(shared_below "${folder}")
    target_include_directories(${target} ${scope} "${PROJECT_SOURCE_DIR}")
  else()
    set(below "${folder}/include/prescene/${folder}")
    set(shared_below "${folder}/internal/prescene/${folder}")
    target_include_directories(${target} ${scope} "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>")
    if(M_SHARED_HEADERS)
      target_include_directories(${target} ${scope} "$<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/internal>")
    endif()
  endif()
  set(shared ${M_SHARED_HEADERS})
  list(TRANSFORM M_HEADERS PREPEND "${below}/")
  list(TRANSFORM shared PREPEND "${shared_below}/")
  foreach(header IN LISTS M_HEADERS shared)
    if(NOT EXISTS "${PROJECT_SOURCE_DIR}/${header}")
      message(FATAL_ERROR "${CMAKE_CURRENT_LIST_FILE}: the header ${header} is listed but does not exist.")
    endif()
  endforeach()

  # For tests/examples.
  if(folder MATCHES "^(tests|benchmarks)(/|$)" OR NOT M_NO_INSTALL)
    string(REGEX REPLACE "/.*" "" group "${folder}")
    set(listed ${M_HEADERS} ${shared})
    list(TRANSFORM listed PREPEND "${name} ")
    set_property(GLOBAL APPEND PROPERTY PRESCENE_HEADER_GROUPS ${group})
    set_property(GLOBAL APPEND PROPERTY "PRESCENE_HEADERS_OF_${group}" ${listed})
    set_property(GLOBAL APPEND PROPERTY "PRESCENE_LIBRARIES_OF_${group}" ${name})
  endif()

  if(NOT M_NO_INSTALL)
    set_property(GLOBAL APPEND PROPERTY PRESCENE_INSTALLED_MODULES ${name})
    list(TRANSFORM M_HEADERS PREPEND "${PROJECT_SOURCE_DIR}/")
    target_sources(${target} ${scope} FILE_SET HEADERS BASE_DIRS "${CMAKE_CURRENT_SOURCE_DIR}/include" FILES ${M_HEADERS})
    # The file of targets that prescene-config.cmake includes for this library.
    install(TARGETS ${target} EXPORT prescene-${name} ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT ${name}
            FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" COMPONENT ${name})
    install(EXPORT prescene-${name} FILE ${name}.cmake NAMESPACE prescene::
            DESTINATION "${PRESCENE_PACKAGE_DIR}/libraries" COMPONENT ${name})
  endif()
endfunction()

# prescene_kernel_sources(<cc>... OPTIONS <option>...): sources whose loops are worth more than -O2, and options that they need
# beside it. Not in debug builds: with sanitizers they would take minutes each.
set(PRESCENE_KERNEL_OPTIONS "$<$<NOT:$<CONFIG:Debug>>:-O3>")
# clang's sanitizers take up to a quarter of an hour for one of them. Fuzz targets are after what reads input; the asan
# preset sees the kernels in every test.
if(PRESCENE_FUZZERS)
  list(APPEND PRESCENE_KERNEL_OPTIONS -fno-sanitize=all)
endif()
function(prescene_kernel_sources)
  cmake_parse_arguments(PARSE_ARGV 0 K "" "" "OPTIONS")
  set_source_files_properties(${K_UNPARSED_ARGUMENTS} PROPERTIES SKIP_PRECOMPILE_HEADERS ON
                              COMPILE_OPTIONS "${PRESCENE_KERNEL_OPTIONS};${K_OPTIONS}")
endfunction()

# prescene_simd_sources(<target>): its sources may be compiled once for each instruction set, through Highway. They then
# include themselves by their name, so their folder is searched for headers. Left out are SSSE3 and SSE4, because the few
# processors in use that have no AVX2 can take SSE2 and each set is a quarter of a kernel's compile time, and the vectors of
# unknown length of SVE, which cannot be members of the structs of our kernels. Sanitizers see two of the sets: one with
# vectors and the one without.
set(_disabled HWY_SSSE3 HWY_SSE4 HWY_SVE HWY_SVE2 HWY_SVE_256 HWY_SVE2_128)
if(PRESCENE_SANITIZERS)
  list(APPEND _disabled HWY_AVX3 HWY_AVX3_DL)
endif()
list(JOIN _disabled "|" _disabled)
set(PRESCENE_DISABLED_SIMD_TARGETS "HWY_DISABLED_TARGETS=(${_disabled})")
function(prescene_simd_sources target)
  if(NOT TARGET ${target})  # not part of this build
    return()
  endif()
  target_compile_definitions(${target} PRIVATE "${PRESCENE_DISABLED_SIMD_TARGETS}")
  target_include_directories(${target} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}")
endfunction()

# prescene_benchmark(<name> SOURCES <cc>... USES <module>... PRIVATE_LINKS <target>...) makes the program bench_<name> at
# the top of the build folder, which `./dev bench <name>` runs: a Google Benchmark program, or one that writes a Report
# (benchmarks/report.h) to the path given as --benchmark_out=PATH.
function(prescene_benchmark name)
  cmake_parse_arguments(PARSE_ARGV 1 B "" "" "SOURCES;USES;PRIVATE_LINKS")
  prescene_test_wanted(wanted bench_${name} USES ${B_USES} LINKS ${B_PRIVATE_LINKS} benchmark::benchmark)
  if(NOT wanted)
    return()
  endif()
  list(TRANSFORM B_USES PREPEND prescene::)
  add_executable(bench_${name} ${B_SOURCES})
  target_link_libraries(bench_${name} PRIVATE ${B_USES} ${B_PRIVATE_LINKS} benchmark::benchmark)
  prescene_unity(bench_${name})
  prescene_precompile(bench_${name} libraries Eigen3::Eigen tl::expected)
  set_target_properties(bench_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}")
endfunction()
