# SPDX-License-Identifier: Apache-2.0
# `cmake --install`: libraries, headers below include/prescene, and a package configuration with the targets
# prescene::<library>. With `--component NAME` what NAME stands for (PresceneParts.cmake) and all that it uses.
include(CMakePackageConfigHelpers)
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/prescene-config.cmake.in"
                              "${PROJECT_BINARY_DIR}/prescene-config.cmake" INSTALL_DESTINATION "${PRESCENE_PACKAGE_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/prescene-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/prescene-config.cmake" "${PROJECT_BINARY_DIR}/prescene-config-version.cmake"
              cmake/FindBullet64.cmake cmake/FindRandom123.cmake cmake/FindLZ4.cmake cmake/FindOpenCVImgproc.cmake cmake/FindZstd.cmake
        DESTINATION "${PRESCENE_PACKAGE_DIR}" COMPONENT package)

# What prescene-config.cmake includes for each library: it and what it uses, and the packages that they link.
get_property(_installed GLOBAL PROPERTY PRESCENE_INSTALLED_MODULES)
foreach(_library IN LISTS _installed)
  prescene_with_uses(_libraries ${_library})
  set(_packages)
  foreach(_used IN LISTS _libraries)
    get_property(_of_one GLOBAL PROPERTY "PRESCENE_PACKAGES_OF_${_used}")
    list(APPEND _packages ${_of_one})
  endforeach()
  list(REMOVE_DUPLICATES _packages)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/libraries/${_library}-needs.cmake" CONTENT
       "list(APPEND _prescene_libraries @_libraries@)\nlist(APPEND _prescene_packages \"@_packages@\")\n" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/libraries/${_library}-needs.cmake"
          DESTINATION "${PRESCENE_PACKAGE_DIR}/libraries" COMPONENT ${_library})
endforeach()

# Each library and program, and each name that several begin with.
get_property(_made GLOBAL PROPERTY PRESCENE_MADE_MODULES)
set(_parts ${_made})
foreach(_library IN LISTS _made)
  string(REGEX REPLACE "_.*" "" _part ${_library})
  list(APPEND _parts ${_part})
endforeach()
list(REMOVE_DUPLICATES _parts)
list(SORT _parts)
# CMake's own --component installs the rules of one component, and of an unknown one nothing, without a word.
set(_script "set(prescene_parts ${_parts})\n")
foreach(_part IN LISTS _parts)
  set(_named)
  foreach(_library IN LISTS _made)
    prescene_in_part(${_library} ${_part} _in_part)
    if(_in_part)
      list(APPEND _named ${_library})
    endif()
  endforeach()
  prescene_with_uses(_libraries ${_named})
  string(APPEND _script "set(prescene_components_of_${_part} ${_libraries})\n")
endforeach()
string(APPEND _script [[
cmake_policy(PUSH)
cmake_policy(VERSION 3.25)
if(CMAKE_INSTALL_COMPONENT AND NOT prescene_installing AND NOT DEFINED ENV{PRESCENE_PACKING})
  if(NOT CMAKE_INSTALL_COMPONENT IN_LIST prescene_parts)
    list(JOIN prescene_parts " " prescene_parts)
    message(FATAL_ERROR "There is no component '${CMAKE_INSTALL_COMPONENT}'. There are: ${prescene_parts}")
  endif()
  set(prescene_installing TRUE)
  set(prescene_asked "${CMAKE_INSTALL_COMPONENT}")
  foreach(CMAKE_INSTALL_COMPONENT IN LISTS prescene_components_of_${prescene_asked} ITEMS package)
    if(NOT CMAKE_INSTALL_COMPONENT STREQUAL prescene_asked)
      include("${CMAKE_CURRENT_LIST_FILE}")
    endif()
  endforeach()
  set(CMAKE_INSTALL_COMPONENT "${prescene_asked}")
endif()
cmake_policy(POP)
]])
install(CODE "${_script}" ALL_COMPONENTS)
