# SPDX-License-Identifier: Apache-2.0
# `cpack -G DEB` in the build folder makes three packages: prescene (the program, its man pages, a systemd unit, example
# scenes), libprescene-dev (static libraries, headers, CMake package) and prescene-doc; in the build folder of the Python
# package it makes python3-prescene.
if(NOT TARGET prescene AND NOT TARGET prescene_python)
  return()
endif()

set(PRESCENE_MAINTAINER "Prescene <prescene@localhost>" CACHE STRING "Maintainer that the Debian packages name")
set(CPACK_PACKAGE_NAME prescene)
set(CPACK_PACKAGE_CONTACT "${PRESCENE_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PROJECT_CONFIG_FILE "${PROJECT_SOURCE_DIR}/cmake/packing.cmake")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
# Looked for when poses are scored; without them it is done on the processor.
set(_drivers "libegl-mesa0, libgl1-mesa-dri")

if(TARGET prescene_python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-prescene)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "${_drivers}")
  find_package(Python COMPONENTS Interpreter REQUIRED)
  # An extension is for one version of Python, and for numpy's interface before its version 2.
  math(EXPR _next "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${_next}), python3-numpy (>= 1:1.20), python3-numpy (<< 1:2)")
endif()
if(NOT TARGET prescene)
  set(CPACK_COMPONENTS_ALL python)
  include(CPack)
  cpack_add_component_group(python DISPLAY_NAME "Python package")
  cpack_add_component(python GROUP python)
  return()
endif()

# What belongs to the program besides itself; the pages are made of what it prints for --help.
install(CODE "execute_process(COMMAND \"${PROJECT_SOURCE_DIR}/tools/man_pages\" \"$<TARGET_FILE:prescene>\" \"${PROJECT_BINARY_DIR}/man\"
                      COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program_files)
install(DIRECTORY "${PROJECT_BINARY_DIR}/man/" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT program_files)
install(FILES packaging/prescene.service DESTINATION lib/systemd/system COMPONENT program_files)
install(FILES packaging/prescene.bash DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" RENAME prescene
        COMPONENT program_files)
install(FILES packaging/service.conf DESTINATION "${CMAKE_INSTALL_DOCDIR}/examples" COMPONENT program_files)
# The sources of a ROS package: our messages, and the type of the service /prescene/ask. The same as IDL, for who uses DDS without ROS.
install(DIRECTORY packaging/prescene_msgs DESTINATION "${CMAKE_INSTALL_DATADIR}/prescene" COMPONENT program_files)
install(FILES interfaces/dds/idl/prescene_msgs.idl interfaces/dds/idl/ros_messages.idl DESTINATION "${CMAKE_INSTALL_DATADIR}/prescene/prescene_msgs/idl"
        COMPONENT program_files)
# For `ros2 launch` and `ros2 param load`.
install(DIRECTORY packaging/launch DESTINATION "${CMAKE_INSTALL_DATADIR}/prescene" COMPONENT program_files
        FILES_MATCHING PATTERN "*.py" PATTERN "*.yaml")
install(PROGRAMS tools/security_keys DESTINATION "${CMAKE_INSTALL_DATADIR}/prescene" COMPONENT program_files)
install(DIRECTORY scenarios DESTINATION "${CMAKE_INSTALL_DATADIR}/prescene" COMPONENT program_files FILES_MATCHING PATTERN "*.yaml")
install(FILES LICENSE README.md CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT documentation)
install(DIRECTORY docs DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT documentation FILES_MATCHING PATTERN "*.md" PATTERN "*.svg" PATTERN "*.jpg" PATTERN "*.bib")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME prescene)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "${_drivers}")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libprescene-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DOC_PACKAGE_NAME prescene-doc)
set(CPACK_DEBIAN_DOC_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
# The static libraries need what they are built with.
set(_needed)
file(STRINGS "${PROJECT_SOURCE_DIR}/tools/packages.txt" _rows REGEX "^run ")
foreach(_row IN LISTS _rows)
  if(_row MATCHES "^run +([a-z0-9.+-]+-dev) +([a-z_/]+)" AND NOT CMAKE_MATCH_2 MATCHES "^(tests|benchmarks)")
    list(APPEND _needed "${CMAKE_MATCH_1}")
  endif()
endforeach()
list(JOIN _needed ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)

get_property(_installed GLOBAL PROPERTY PRESCENE_INSTALLED_MODULES)
set(CPACK_COMPONENTS_ALL service_cli program_files documentation package ${_installed})
if(TARGET prescene_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
include(CPack)
if(TARGET prescene_python)
  cpack_add_component_group(python DISPLAY_NAME "Python package")
  cpack_add_component(python GROUP python)
endif()
cpack_add_component_group(program DISPLAY_NAME Program)
cpack_add_component_group(dev DISPLAY_NAME "Libraries and headers")
cpack_add_component_group(doc DISPLAY_NAME Documentation)
cpack_add_component(service_cli GROUP program)
cpack_add_component(program_files GROUP program)
cpack_add_component(documentation GROUP doc)
cpack_add_component(package GROUP dev)
foreach(_library IN LISTS _installed)
  cpack_add_component(${_library} GROUP dev)
endforeach()
