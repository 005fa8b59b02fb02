# SPDX-License-Identifier: Apache-2.0
# OpenCV's core, imgproc and ml. Debian's own CMake configuration sits in libopencv-dev, which installs every module with
# GDAL and Qt behind them; we install three development packages and look for them ourselves.
# Targets: OpenCV::core, OpenCV::imgproc, OpenCV::ml.
find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
set(_required OpenCV_INCLUDE_DIR)
foreach(_module core imgproc ml)
  find_library(OpenCV_${_module}_LIBRARY opencv_${_module})
  list(APPEND _required OpenCV_${_module}_LIBRARY)
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCV REQUIRED_VARS ${_required}
  REASON_FAILURE_MESSAGE "install libopencv-core-dev, libopencv-imgproc-dev and libopencv-ml-dev")
if(OpenCV_FOUND AND NOT TARGET OpenCV::core)
  foreach(_module core imgproc ml)
    add_library(OpenCV::${_module} UNKNOWN IMPORTED)
    set_target_properties(OpenCV::${_module} PROPERTIES IMPORTED_LOCATION "${OpenCV_${_module}_LIBRARY}"
                          INTERFACE_INCLUDE_DIRECTORIES "${OpenCV_INCLUDE_DIR}")
  endforeach()
  target_link_libraries(OpenCV::imgproc INTERFACE OpenCV::core)
  target_link_libraries(OpenCV::ml INTERFACE OpenCV::core)
endif()
