# SPDX-License-Identifier: Apache-2.0
# Bullet's collision and rigid-body libraries in double precision, and HACD from its extras. Every file that sees a Bullet
# header must see BT_USE_DOUBLE_PRECISION, so link these privately in simulation/bullet only.
# Targets: Bullet::float64, Bullet::hacd.
find_path(Bullet64_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet)
find_path(Bullet64_HACD_INCLUDE_DIR HACD/hacdHACD.h PATH_SUFFIXES bullet)
set(_required Bullet64_INCLUDE_DIR Bullet64_HACD_INCLUDE_DIR)
foreach(_library BulletDynamics BulletCollision LinearMath HACD)
  find_library(Bullet64_${_library}_LIBRARY ${_library}-float64)
  list(APPEND _required Bullet64_${_library}_LIBRARY)
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Bullet64 REQUIRED_VARS ${_required}
                                  REASON_FAILURE_MESSAGE "install libbullet-dev and libbullet-extras-dev")
if(Bullet64_FOUND AND NOT TARGET Bullet::float64)
  add_library(Bullet::float64 INTERFACE IMPORTED)
  set_target_properties(Bullet::float64 PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Bullet64_INCLUDE_DIR}"
    INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION
    INTERFACE_LINK_LIBRARIES
    "${Bullet64_BulletDynamics_LIBRARY};${Bullet64_BulletCollision_LIBRARY};${Bullet64_LinearMath_LIBRARY}")
  add_library(Bullet::hacd INTERFACE IMPORTED)
  set_target_properties(Bullet::hacd PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${Bullet64_HACD_INCLUDE_DIR};${Bullet64_HACD_INCLUDE_DIR}/HACD"
    INTERFACE_LINK_LIBRARIES "${Bullet64_HACD_LIBRARY};Bullet::float64")
endif()
