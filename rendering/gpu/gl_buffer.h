// SPDX-License-Identifier: Apache-2.0
// Storage buffers and compute programs. All calls, destructors too, need the context to be current.
#pragma once

#include <cstddef>
#include <string>

#include "prescene/core/status.h"

namespace prescene::rendering {

/// What fails on the device, with the remedy.
core::Status device_failure(const std::string& what);

/// Device memory that programs find at a binding.
class GlBuffer {
 public:
  GlBuffer();
  ~GlBuffer();
  GlBuffer(const GlBuffer&) = delete;
  GlBuffer& operator=(const GlBuffer&) = delete;

  std::size_t size() const { return size_; }
  /// At least so many bytes, with no content; grows only.
  void reserve(std::size_t bytes);
  /// Forgets the content, so that writing need not wait for who reads it.
  void discard();
  void write(std::size_t at, const void* data, std::size_t bytes);
  void bind(unsigned binding) const;
  /// The content for reading, until unmap(); null when the device failed.
  const void* map(std::size_t bytes);
  /// Whether what was mapped was the content all the time.
  bool unmap();

 private:
  unsigned name_ = 0;
  std::size_t size_ = 0;
};

/// One compute shader.
class GlProgram {
 public:
  GlProgram() = default;
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  core::Status compile(const std::string& source);
  /// Starts so many work groups; what they write is there for later commands.
  void dispatch(std::size_t groups) const;

 private:
  unsigned name_ = 0;
};

/// kUnavailable for errors since the last call: the device has to be made anew.
core::Status gl_errors();

}  // namespace prescene::rendering
