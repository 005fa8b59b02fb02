# SPDX-License-Identifier: Apache-2.0
# The parts core and imgproc of OpenCV 4. Debian's CMake configuration comes with every other part of OpenCV and what those
# need. Target: OpenCV::imgproc.
find_path(OpenCVImgproc_INCLUDE_DIR opencv2/imgproc.hpp PATH_SUFFIXES opencv4)
find_library(OpenCVImgproc_LIBRARY opencv_imgproc)
find_library(OpenCVImgproc_core_LIBRARY opencv_core)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVImgproc
  REQUIRED_VARS OpenCVImgproc_LIBRARY OpenCVImgproc_core_LIBRARY OpenCVImgproc_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "install libopencv-imgproc-dev")
if(OpenCVImgproc_FOUND AND NOT TARGET OpenCV::imgproc)
  add_library(OpenCV::imgproc UNKNOWN IMPORTED)
  set_target_properties(OpenCV::imgproc PROPERTIES IMPORTED_LOCATION "${OpenCVImgproc_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${OpenCVImgproc_INCLUDE_DIR}"
                        INTERFACE_LINK_LIBRARIES "${OpenCVImgproc_core_LIBRARY}")
endif()
