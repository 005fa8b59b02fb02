// SPDX-License-Identifier: Apache-2.0
#include "gl_views.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <array>
#include <type_traits>

namespace prescene::rendering {
namespace {

// The point in C goes through unchanged: depth is its z, interpolated perspective-correct by the device. Image rows run
// down, window rows up: the projection leaves v as it is, so that row 0 of the frame buffer is row 0 of the image.
constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 p_M;
layout(location = 1) in vec3 normal_M;
uniform mat3 R_CM;
uniform vec3 p_CM;
uniform vec4 projection;  // fx, fy, cx, cy in device coordinates
uniform vec2 clip;        // z_clip = clip.x * z + clip.y
out float depth;
flat out vec3 normal;
void main() {
  vec3 p_C = R_CM * p_M + p_CM;
  normal = R_CM * normal_M;
  if (dot(normal, p_C) > 0.0) normal = -normal;
  depth = p_C.z;
  gl_Position = vec4(projection.x * p_C.x + projection.z * p_C.z, projection.y * p_C.y + projection.w * p_C.z,
                     clip.x * p_C.z + clip.y, p_C.z);
}
)";

constexpr const char* kFragmentShader = R"(#version 330 core
in float depth;
flat in vec3 normal;
uniform uint label;
layout(location = 0) out float out_depth;
layout(location = 1) out uint out_label;
layout(location = 2) out vec4 out_normal;
void main() {
  out_depth = depth;
  out_label = label;
  out_normal = vec4(normal, 0.0);
}
)";

core::Status gl_failure(const std::string& what) {
  return core::unavailable("OpenGL renderer: " + what + ": update the driver, or use the reference renderer");
}

std::string shader_log(GLuint shader) {
  std::array<char, 1024> text{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(text.size()) - 1, nullptr, text.data());
  return text.data();
}

core::Result<GLuint> compiled(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  const core::Status status = gl_failure("the driver does not compile our shader (" + shader_log(shader) + ")");
  glDeleteShader(shader);
  return status;
}

}  // namespace

core::Result<std::unique_ptr<GlViews>> GlViews::make() {
  std::unique_ptr<GlViews> views(new GlViews());
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  views->device_ = name != nullptr ? name : "unknown";
  std::array<GLint, 2> viewport{};
  GLint texture_size = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &texture_size);
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  views->max_image_size_ = std::min({texture_size, viewport[0], viewport[1]});
  PRESCENE_RETURN_IF_ERROR(views->make_program());
  return views;
}

core::Status GlViews::make_program() {
  PRESCENE_TRY(const GLuint vertex, compiled(GL_VERTEX_SHADER, kVertexShader));
  auto fragment = compiled(GL_FRAGMENT_SHADER, kFragmentShader);
  if (!fragment) {
    glDeleteShader(vertex);
    return fragment.status();
  }
  program_ = glCreateProgram();
  glAttachShader(program_, vertex);
  glAttachShader(program_, *fragment);
  glLinkProgram(program_);
  glDeleteShader(vertex);
  glDeleteShader(*fragment);
  GLint ok = GL_FALSE;
  glGetProgramiv(program_, GL_LINK_STATUS, &ok);
  if (ok != GL_TRUE) return gl_failure("the driver does not link our shaders");
  rotation_ = glGetUniformLocation(program_, "R_CM");
  translation_ = glGetUniformLocation(program_, "p_CM");
  projection_ = glGetUniformLocation(program_, "projection");
  clip_ = glGetUniformLocation(program_, "clip");
  label_ = glGetUniformLocation(program_, "label");
  return core::ok_status();
}

void GlViews::free_images() {
  for (GLuint* image : {&depth_image_, &label_image_, &normal_image_, &depth_buffer_}) {
    glDeleteRenderbuffers(1, image);
    *image = 0;
  }
  glDeleteFramebuffers(1, &frame_);
  frame_ = 0;
  width_ = 0;
  height_ = 0;
}

GlViews::~GlViews() {
  for (const auto& [mesh, uploaded] : meshes_) {
    glDeleteBuffers(1, &uploaded.buffer);
    glDeleteVertexArrays(1, &uploaded.vertex_array);
  }
  free_images();
  glDeleteProgram(program_);
}

core::Status GlViews::set_size(int width, int height) {
  if (width == width_ && height == height_) return core::ok_status();
  free_images();
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  const auto attach = [&](GLuint* image, GLenum format, GLenum point) {
    glGenRenderbuffers(1, image);
    glBindRenderbuffer(GL_RENDERBUFFER, *image);
    glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, point, GL_RENDERBUFFER, *image);
  };
  attach(&depth_image_, GL_R32F, GL_COLOR_ATTACHMENT0);
  attach(&label_image_, GL_R16UI, GL_COLOR_ATTACHMENT1);
  attach(&normal_image_, GL_RGBA32F, GL_COLOR_ATTACHMENT2);
  attach(&depth_buffer_, GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    free_images();
    return gl_failure("no frame buffer of " + std::to_string(width) + " x " + std::to_string(height) +
                      " with 32-bit depth and 16-bit labels");
  }
  width_ = width;
  height_ = height;
  return core::ok_status();
}

const GlViews::UploadedMesh& GlViews::uploaded(const MeshHandle& mesh) {
  const auto known = meshes_.find(mesh.get());
  if (known != meshes_.end()) {
    if (known->second.mesh.lock() == mesh) return known->second;
    // Another mesh at the address of one that is gone.
    glDeleteBuffers(1, &known->second.buffer);
    glDeleteVertexArrays(1, &known->second.vertex_array);
    meshes_.erase(known);
  }
  // Corners are not shared, since normals belong to faces.
  std::vector<float> data;
  data.reserve(18 * mesh->triangles.size());
  for (std::size_t i = 0; i < mesh->triangles.size(); ++i) {
    for (const std::uint32_t index : mesh->triangles[i]) {
      const Vector3f& p = mesh->vertices[index];
      const Vector3f& n = mesh->normals[i];
      data.insert(data.end(), {p.x(), p.y(), p.z(), n.x(), n.y(), n.z()});
    }
  }
  UploadedMesh entry;
  entry.mesh = mesh;
  entry.vertices = static_cast<int>(3 * mesh->triangles.size());
  glGenVertexArrays(1, &entry.vertex_array);
  glBindVertexArray(entry.vertex_array);
  glGenBuffers(1, &entry.buffer);
  glBindBuffer(GL_ARRAY_BUFFER, entry.buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(float)), data.data(), GL_STATIC_DRAW);
  constexpr GLsizei kStride = 6 * sizeof(float);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, nullptr);
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, kStride, reinterpret_cast<const void*>(3 * sizeof(float)));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  return meshes_.emplace(mesh.get(), entry).first->second;
}

void GlViews::forget_unused_meshes() {
  for (auto i = meshes_.begin(); i != meshes_.end();) {
    if (!i->second.mesh.expired()) {
      ++i;
      continue;
    }
    glDeleteBuffers(1, &i->second.buffer);
    glDeleteVertexArrays(1, &i->second.vertex_array);
    i = meshes_.erase(i);
  }
}

core::Status GlViews::draw(const RenderJob& job, const RenderOptions& options, RenderedView* view) {
  const geometry::PinholeCamera& camera = job.camera;
  if (std::max(camera.width, camera.height) > max_image_size_)
    return core::unsupported("OpenGL renderer: an image of " + std::to_string(camera.width) + " x " +
                             std::to_string(camera.height) + " is more than the device draws (" +
                             std::to_string(max_image_size_) + "): use a smaller camera or the reference renderer");
  PRESCENE_RETURN_IF_ERROR(set_size(camera.width, camera.height));
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, camera.width, camera.height);
  constexpr std::array<GLenum, 3> kAll = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
  glDrawBuffers(static_cast<GLsizei>(kAll.size()), kAll.data());
  constexpr std::array<GLfloat, 4> kNothing = {0, 0, 0, 0};
  constexpr std::array<GLuint, 4> kNoLabel = {0, 0, 0, 0};
  constexpr GLfloat kFarthest = 1.0f;
  glClearBufferfv(GL_COLOR, 0, kNothing.data());
  glClearBufferuiv(GL_COLOR, 1, kNoLabel.data());
  glClearBufferfv(GL_COLOR, 2, kNothing.data());
  glClearBufferfv(GL_DEPTH, 0, &kFarthest);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DITHER);

  glUseProgram(program_);
  // Pixel centres are at integers in our images, at halves in the device's.
  const double width = camera.width;
  const double height = camera.height;
  glUniform4f(projection_, static_cast<float>(2.0 * camera.fx / width), static_cast<float>(2.0 * camera.fy / height),
              static_cast<float>(2.0 * (camera.cx + 0.5) / width - 1.0),
              static_cast<float>(2.0 * (camera.cy + 0.5) / height - 1.0));
  const double span = options.far_depth - options.near_depth;
  glUniform2f(clip_, static_cast<float>((options.far_depth + options.near_depth) / span),
              static_cast<float>(-2.0 * options.far_depth * options.near_depth / span));
  const geometry::Pose X_CW = job.X_WC.inverse();
  for (std::size_t i = 0; i < job.scene->instances.size(); ++i) {
    const RenderInstance& instance = job.scene->instances[i];
    if (instance.mesh->triangles.empty()) continue;
    const geometry::Pose X_CM = X_CW * instance.X_WM;
    const Eigen::Matrix3f rotation = X_CM.rotation.toRotationMatrix().cast<float>();
    const Vector3f translation = X_CM.translation.cast<float>();
    glUniformMatrix3fv(rotation_, 1, GL_FALSE, rotation.data());
    glUniform3fv(translation_, 1, translation.data());
    glUniform1ui(label_, static_cast<GLuint>(i + 1));
    const UploadedMesh& mesh = uploaded(instance.mesh);
    glBindVertexArray(mesh.vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, mesh.vertices);
  }
  read_back(options, view);
  const GLenum error = glGetError();
  if (error != GL_NO_ERROR) return gl_failure("OpenGL error " + std::to_string(error));
  return core::ok_status();
}

void GlViews::read_back(const RenderOptions& options, RenderedView* view) {
  const auto fit = [&](auto* image, const auto& empty_pixel) {
    using Image = std::remove_reference_t<decltype(*image)>;
    if (image->width() != width_ || image->height() != height_) *image = Image(width_, height_, empty_pixel);
  };
  fit(&view->depth, 0.0f);
  fit(&view->labels, std::uint16_t{0});
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, width_, height_, GL_RED, GL_FLOAT, view->depth.data());
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_SHORT, view->labels.data());
  if (!options.normals) {
    view->normals = geometry::Image<Vector3f>();
    return;
  }
  fit(&view->normals, Vector3f(Vector3f::Zero()));
  static_assert(sizeof(Vector3f) == 3 * sizeof(float));
  glReadBuffer(GL_COLOR_ATTACHMENT2);
  glReadPixels(0, 0, width_, height_, GL_RGB, GL_FLOAT, view->normals.data());
}

}  // namespace prescene::rendering
