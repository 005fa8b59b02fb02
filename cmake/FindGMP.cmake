# SPDX-License-Identifier: Apache-2.0
# GMP with its C++ classes, a reference of tests: rational arithmetic. Debian ships no CMake configuration for it.
# Target: GMP::gmpxx.
find_path(GMP_INCLUDE_DIR gmpxx.h)
find_library(GMP_LIBRARY gmp)
find_library(GMP_CXX_LIBRARY gmpxx)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(GMP REQUIRED_VARS GMP_CXX_LIBRARY GMP_LIBRARY GMP_INCLUDE_DIR
                                  REASON_FAILURE_MESSAGE "install libgmp-dev")
if(GMP_FOUND AND NOT TARGET GMP::gmpxx)
  add_library(GMP::gmpxx UNKNOWN IMPORTED)
  set_target_properties(GMP::gmpxx PROPERTIES IMPORTED_LOCATION "${GMP_CXX_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${GMP_INCLUDE_DIR}" INTERFACE_LINK_LIBRARIES "${GMP_LIBRARY}")
endif()
