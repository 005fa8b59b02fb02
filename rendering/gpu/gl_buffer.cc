// SPDX-License-Identifier: Apache-2.0
#include "gl_buffer.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <array>

namespace prescene::rendering {

core::Status device_failure(const std::string& what) {
  return core::unavailable("likelihood in compute shaders: " + what + ": update the driver, or use the processor");
}

GlBuffer::GlBuffer() { glGenBuffers(1, &name_); }
GlBuffer::~GlBuffer() { glDeleteBuffers(1, &name_); }

void GlBuffer::reserve(std::size_t bytes) {
  if (bytes <= size_) return;
  size_ = bytes;
  discard();
}

void GlBuffer::discard() {
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name_);
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(size_), nullptr, GL_DYNAMIC_DRAW);
}

void GlBuffer::write(std::size_t at, const void* data, std::size_t bytes) {
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name_);
  glBufferSubData(GL_SHADER_STORAGE_BUFFER, static_cast<GLintptr>(at), static_cast<GLsizeiptr>(bytes), data);
}

void GlBuffer::bind(unsigned binding) const { glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, name_); }

const void* GlBuffer::map(std::size_t bytes) {
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name_);
  return glMapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_READ_BIT);
}

bool GlBuffer::unmap() {
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, name_);
  return glUnmapBuffer(GL_SHADER_STORAGE_BUFFER) == GL_TRUE;
}

GlProgram::~GlProgram() { glDeleteProgram(name_); }

core::Status GlProgram::compile(const std::string& source) {
  const char* text = source.c_str();
  const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  std::array<char, 1024> log{};
  if (ok == GL_TRUE) {
    name_ = glCreateProgram();
    glAttachShader(name_, shader);
    glLinkProgram(name_);
    glGetProgramiv(name_, GL_LINK_STATUS, &ok);
    if (ok != GL_TRUE) glGetProgramInfoLog(name_, static_cast<GLsizei>(log.size()) - 1, nullptr, log.data());
  } else {
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()) - 1, nullptr, log.data());
  }
  glDeleteShader(shader);
  if (ok == GL_TRUE) return core::ok_status();
  return device_failure("the driver does not take our shader (" + std::string(log.data()) + ")");
}

void GlProgram::dispatch(std::size_t groups) const {
  glUseProgram(name_);
  glDispatchCompute(static_cast<GLuint>(groups), 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

core::Status gl_errors() {
  GLenum first = GL_NO_ERROR;
  // A lost context may report errors without end.
  for (int i = 0; i < 16; ++i) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) break;
    if (first == GL_NO_ERROR) first = error;
  }
  if (first == GL_NO_ERROR) return core::ok_status();
  // Which buffer has no memory now, nobody knows.
  if (first == GL_OUT_OF_MEMORY)
    return core::unavailable(
        "likelihood in compute shaders: the device has too little memory: give it less scratch memory, or use the "
        "processor");
  return device_failure("OpenGL error " + std::to_string(first));
}

}  // namespace prescene::rendering
