# SPDX-License-Identifier: Apache-2.0
# Installs the build into a folder of its own, then configures, builds and runs a small program that knows nothing but
# find_package(prescene).
set(work "${PRESCENE_BUILD_DIR}/install_test")
file(REMOVE_RECURSE "${work}")
function(step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    message(FATAL_ERROR "failed (${failed}): ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()
step("${CMAKE_COMMAND}" --install "${PRESCENE_BUILD_DIR}" --prefix "${work}/prefix")
step("${CMAKE_COMMAND}" -S "${CONSUMER_DIR}" -B "${work}/consumer" -G "${GENERATOR}" "-DCMAKE_CXX_COMPILER=${CXX}"
     "-DCMAKE_PREFIX_PATH=${work}/prefix" "-DCMAKE_EXE_LINKER_FLAGS=${LINK_FLAGS}" -DCMAKE_BUILD_TYPE=Release)
step("${CMAKE_COMMAND}" --build "${work}/consumer")
step("${work}/consumer/consumer")
if(NOT output MATCHES "a direction of length 1\\.000000")
  message(FATAL_ERROR "the program says: ${output}")
endif()
file(REMOVE_RECURSE "${work}")
