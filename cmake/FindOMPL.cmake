# SPDX-License-Identifier: Apache-2.0
# The Open Motion Planning Library, for the tests and the benchmark of prescene/interfaces/planning/ompl.h. Its own
# configuration makes no target, and names libraries that a program does not need. Target: OMPL::ompl.
find_path(OMPL_INCLUDE_DIR ompl/base/SpaceInformation.h PATH_SUFFIXES ompl-1.5 ompl-1.6 ompl-1.7)
find_library(OMPL_LIBRARY ompl)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OMPL REQUIRED_VARS OMPL_LIBRARY OMPL_INCLUDE_DIR
                                  REASON_FAILURE_MESSAGE "install libompl-dev")
if(OMPL_FOUND AND NOT TARGET OMPL::ompl)
  add_library(OMPL::ompl UNKNOWN IMPORTED)
  set_target_properties(OMPL::ompl PROPERTIES IMPORTED_LOCATION "${OMPL_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${OMPL_INCLUDE_DIR}")
endif()
