# SPDX-License-Identifier: Apache-2.0
# `cmake --install`: libraries, headers below include/prescene, and a package configuration with the targets
# prescene::<module>.
include(CMakePackageConfigHelpers)
set(_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/prescene")
get_property(_has_modules GLOBAL PROPERTY PRESCENE_INSTALLED_MODULES)
if(_has_modules)
  install(EXPORT prescene-targets NAMESPACE prescene:: DESTINATION "${_package_dir}")
endif()
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/prescene-config.cmake.in"
                              "${PROJECT_BINARY_DIR}/prescene-config.cmake" INSTALL_DESTINATION "${_package_dir}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/prescene-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/prescene-config.cmake" "${PROJECT_BINARY_DIR}/prescene-config-version.cmake"
              cmake/FindBullet64.cmake cmake/FindRandom123.cmake cmake/FindLZ4.cmake cmake/FindZstd.cmake
        DESTINATION "${_package_dir}")
