# SPDX-License-Identifier: Apache-2.0
# The Open Dynamics Engine, a reference peer of tests and benchmarks. Debian builds it in double precision; its headers ask
# for the macro that says so. Target: ODE::ode.
find_path(ODE_INCLUDE_DIR ode/ode.h)
find_library(ODE_LIBRARY ode)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(ODE REQUIRED_VARS ODE_LIBRARY ODE_INCLUDE_DIR
                                  REASON_FAILURE_MESSAGE "install libode-dev")
if(ODE_FOUND AND NOT TARGET ODE::ode)
  add_library(ODE::ode UNKNOWN IMPORTED)
  set_target_properties(ODE::ode PROPERTIES IMPORTED_LOCATION "${ODE_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${ODE_INCLUDE_DIR}" INTERFACE_COMPILE_DEFINITIONS dIDEDOUBLE)
endif()
