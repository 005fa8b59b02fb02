# SPDX-License-Identifier: Apache-2.0
# Installs the component `collision` of this build into a folder of its own, looks what is there, and builds and runs the
# program of docs/reference/collision.md against it, with every package hidden that the library is said to do without.
cmake_minimum_required(VERSION 3.25)
set(work "${PRESCENE_BUILD_DIR}/part_install_test")
file(REMOVE_RECURSE "${work}")
separate_arguments(HIDDEN)
list(TRANSFORM HIDDEN REPLACE "(.+)" "-DCMAKE_DISABLE_FIND_PACKAGE_\\1=ON")

# try(<command>...): sets `failed` and `output`.
function(try)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  set(failed "${failed}" PARENT_SCOPE)
  set(output "${output}" PARENT_SCOPE)
endfunction()
macro(step)
  try(${ARGN})
  if(failed)
    message(FATAL_ERROR "failed (${failed}): ${ARGN}\n${output}")
  endif()
endmacro()

step("${CMAKE_COMMAND}" --install "${PRESCENE_BUILD_DIR}" --prefix "${work}/prefix" --component collision)
file(GLOB_RECURSE libraries RELATIVE "${work}/prefix" "${work}/prefix/*.a")
list(TRANSFORM libraries REPLACE ".*/" "")
list(SORT libraries)
set(expected libprescene_collision.a libprescene_collision_batches.a libprescene_collision_continuous.a
             libprescene_collision_dops.a libprescene_collision_spheres.a libprescene_core.a libprescene_geometry.a)
if(NOT libraries STREQUAL expected)
  message(FATAL_ERROR "installed are ${libraries}")
endif()
file(GLOB folders RELATIVE "${work}/prefix/include/prescene" "${work}/prefix/include/prescene/*")
if(NOT folders STREQUAL "collision;core;geometry")
  message(FATAL_ERROR "there are headers of ${folders}")
endif()
if(EXISTS "${work}/prefix/bin")
  message(FATAL_ERROR "programs are installed as well")
endif()

set(configure "${CMAKE_COMMAND}" -S "${CONSUMER_DIR}" -G "${GENERATOR}" "-DCMAKE_CXX_COMPILER=${CXX}" ${HIDDEN}
    "-DCMAKE_PREFIX_PATH=${work}/prefix" "-DCMAKE_EXE_LINKER_FLAGS=${LINK_FLAGS}" -DCMAKE_BUILD_TYPE=Release
    "-DPROGRAM=${PRESCENE_BUILD_DIR}/tests/collision/docs_example.cc")
step(${configure} -B "${work}/consumer" "-DCOMPONENTS=collision collision_spheres")
step("${CMAKE_COMMAND}" --build "${work}/consumer")
step("${work}/consumer/consumer" 0.09)
if(NOT output MATCHES "touching: yes.*force on A: \\(-[1-9]")
  message(FATAL_ERROR "the program says: ${output}")
endif()

# What is not there is named: a library that is not installed, a component that does not exist.
try(${configure} -B "${work}/consumer_of_more" "-DCOMPONENTS=collision rendering")
if(NOT failed OR NOT output MATCHES "no[ \n]+library[ \n]+'rendering'[ \n]+is[ \n]+installed")
  message(FATAL_ERROR "a library that is not installed is found (${failed}): ${output}")
endif()
try("${CMAKE_COMMAND}" --install "${PRESCENE_BUILD_DIR}" --prefix "${work}/nothing" --component colision)
if(NOT failed OR NOT output MATCHES "no component 'colision'" OR EXISTS "${work}/nothing")
  message(FATAL_ERROR "a component that does not exist is installed (${failed}): ${output}")
endif()
file(REMOVE_RECURSE "${work}")
