// SPDX-License-Identifier: Apache-2.0
// How OpenCV is called: on one thread, with memory of ours for what comes out, and without its exceptions. It is used
// in this module only.
#pragma once

#include <mutex>
#include <opencv2/core.hpp>

#include "prescene/core/check.h"
#include "prescene/core/status.h"

namespace prescene::interfaces {

/// Runs `work`, which calls OpenCV. kResourceExhausted where there is no memory.
template <class Work>
core::Status with_opencv(const Work& work) {
  // The program has threads of its own; OpenCV's would take the processors from them.
  static std::once_flag once;
  try {
    std::call_once(once, [] { cv::setNumThreads(1); });
    work();
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) return core::resource_exhausted("out of memory for an image");
    return core::invalid_input("the image cannot be converted: " + error.err);
  }
  return core::ok_status();
}

/// A matrix over memory of ours; it must be of the size and type that the call gives back, else OpenCV takes memory of
/// its own.
inline cv::Mat matrix_over(void* data, int width, int height, int type) { return {height, width, type, data}; }

/// A matrix over memory that is only read; OpenCV's headers have no type for that.
inline cv::Mat input_matrix(const void* data, int width, int height, int type, std::size_t step = cv::Mat::AUTO_STEP) {
  return {height, width, type, const_cast<void*>(data), step};  // NOLINT(cppcoreguidelines-pro-type-const-cast)
}

/// Checks that `result` is still over the memory at `data`.
inline void check_in_place(const cv::Mat& result, const void* data) { PRESCENE_CHECK(result.data == data); }

}  // namespace prescene::interfaces
