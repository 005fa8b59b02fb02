// SPDX-License-Identifier: Apache-2.0
#include "gl_views.h"

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <type_traits>

#include "prescene/rendering/surface_color.h"

namespace prescene::rendering {
namespace {

enum ColorSource : GLint { kOfMaterial, kOfVertices, kOfTexture };

// The point in C goes through unchanged: depth is its z, interpolated perspective-correct by the device. Image rows run
// down, window rows up: the projection leaves v as it is, so that row 0 of the frame buffer is row 0 of the image.
constexpr const char* kVertexShader = R"(
layout(location = 0) in vec3 p_M;
layout(location = 1) in vec3 normal_M;
#ifdef COLOR
layout(location = 2) in vec3 color_srgb;
layout(location = 3) in vec2 place_in;
out vec3 vertex_color;
out vec2 place;
vec3 linear_of(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}
#endif
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
#ifdef COLOR
  vertex_color = linear_of(color_srgb);
  place = place_in;
#endif
  gl_Position = vec4(projection.x * p_C.x + projection.z * p_C.z, projection.y * p_C.y + projection.w * p_C.z,
                     clip.x * p_C.z + clip.y, p_C.z);
}
)";

constexpr const char* kFragmentShader = R"(
in float depth;
flat in vec3 normal;
uniform uint label;
layout(location = 0) out float out_depth;
layout(location = 1) out uint out_label;
layout(location = 2) out vec4 out_normal;
#ifdef COLOR
in vec3 vertex_color;
in vec2 place;
uniform vec3 towards_light;  // in C, unit
uniform vec2 shares;         // ambient, direct
uniform int color_source;    // material, vertices, texture
uniform vec3 material;       // linear
uniform sampler2D surface;
layout(location = 3) out vec4 out_color;
vec3 linear_of(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}
vec3 srgb_of(vec3 c) {
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}
vec3 texel(ivec2 at, ivec2 size) {
  ivec2 repeated = at - size * ivec2(floor(vec2(at) / vec2(size)));
  return linear_of(texelFetch(surface, repeated, 0).rgb);
}
// Blended by hand, in linear light: samplers round their weights to 8 bits.
vec3 texture_color() {
  ivec2 size = textureSize(surface, 0);
  vec2 at = fract(place) * vec2(size) - 0.5;
  vec2 corner = floor(at);
  vec2 share = at - corner;
  ivec2 first = ivec2(corner);
  return mix(mix(texel(first, size), texel(first + ivec2(1, 0), size), share.x),
             mix(texel(first + ivec2(0, 1), size), texel(first + ivec2(1, 1), size), share.x), share.y);
}
#endif
void main() {
  out_depth = depth;
  out_label = label;
  out_normal = vec4(normal, 0.0);
#ifdef COLOR
  vec3 own = color_source == 2 ? texture_color() : color_source == 1 ? max(vertex_color, 0.0) : material;
  float light = shares.x + shares.y * max(0.0, dot(normal, towards_light));
  out_color = vec4(srgb_of(clamp(own * light, 0.0, 1.0)), 1.0);
#endif
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

core::Result<GLuint> compiled(GLenum kind, bool color, const char* source) {
  const GLuint shader = glCreateShader(kind);
  const std::array<const char*, 3> parts = {"#version 330 core\n", color ? "#define COLOR\n" : "", source};
  glShaderSource(shader, static_cast<GLsizei>(parts.size()), parts.data(), nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  const core::Status status = gl_failure("the driver does not compile our shader (" + shader_log(shader) + ")");
  glDeleteShader(shader);
  return status;
}

/// Where the images of a view lie in a pixel buffer, bytes; each at a multiple of 16.
struct Layout {
  Layout(int width, int height, const RenderOptions& options) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const auto next = [&](std::size_t bytes) {
      const std::size_t at = size;
      size += (pixels * bytes + 15) / 16 * 16;
      return at;
    };
    depth = next(sizeof(float));
    labels = next(sizeof(std::uint16_t));
    if (options.normals) normals = next(sizeof(Vector3f));
    if (options.color) color = next(sizeof(geometry::Rgb));
  }

  std::size_t depth = 0, labels = 0, normals = 0, color = 0, size = 0;
};

template <class Pixel>
void copy_image(const std::uint8_t* from, int width, int height, const Pixel& empty_pixel,
                geometry::Image<Pixel>* image) {
  static_assert(std::is_trivially_destructible_v<Pixel>);
  if (image->width() != width || image->height() != height) *image = geometry::Image<Pixel>(width, height, empty_pixel);
  std::memcpy(static_cast<void*>(image->data()), from, image->size() * sizeof(Pixel));
}

}  // namespace

core::Result<std::unique_ptr<GlViews>> GlViews::make() {
  std::unique_ptr<GlViews> views(new GlViews());
  std::array<GLint, 2> viewport{};
  GLint texture_size = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &texture_size);
  glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
  views->max_image_size_ = std::min({texture_size, viewport[0], viewport[1]});
  for (const bool color : {false, true}) PRESCENE_RETURN_IF_ERROR(views->make_program(color));
  return views;
}

core::Status GlViews::make_program(bool color) {
  Program& program = color ? colored_ : plain_;
  PRESCENE_TRY(const GLuint vertex, compiled(GL_VERTEX_SHADER, color, kVertexShader));
  auto fragment = compiled(GL_FRAGMENT_SHADER, color, kFragmentShader);
  if (!fragment) {
    glDeleteShader(vertex);
    return fragment.status();
  }
  program.name = glCreateProgram();
  glAttachShader(program.name, vertex);
  glAttachShader(program.name, *fragment);
  glLinkProgram(program.name);
  glDeleteShader(vertex);
  glDeleteShader(*fragment);
  GLint ok = GL_FALSE;
  glGetProgramiv(program.name, GL_LINK_STATUS, &ok);
  if (ok != GL_TRUE) return gl_failure("the driver does not link our shaders");
  const auto uniform = [&](const char* name) { return glGetUniformLocation(program.name, name); };
  program.rotation = uniform("R_CM");
  program.translation = uniform("p_CM");
  program.projection = uniform("projection");
  program.clip = uniform("clip");
  program.label = uniform("label");
  program.light = uniform("towards_light");
  program.shares = uniform("shares");
  program.color_source = uniform("color_source");
  program.material = uniform("material");
  return core::ok_status();
}

void GlViews::free_images() {
  for (GLuint* image : {&depth_image_, &label_image_, &normal_image_, &color_image_, &depth_buffer_}) {
    glDeleteRenderbuffers(1, image);
    *image = 0;
  }
  glDeleteFramebuffers(1, &frame_);
  frame_ = 0;
  width_ = 0;
  height_ = 0;
}

GlViews::~GlViews() {
  free_images();
  for (const PixelBuffer& pixels : pixels_) glDeleteBuffers(1, &pixels.name);
  glDeleteProgram(plain_.name);
  glDeleteProgram(colored_.name);
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
  attach(&color_image_, GL_RGBA8, GL_COLOR_ATTACHMENT3);
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

core::Status GlViews::render(std::span<const RenderJob> jobs, const RenderOptions& options,
                             std::span<RenderedView> views) {
  meshes_.forget_unused();
  // The images of one view come back while the next one is drawn.
  for (std::size_t i = 0; i <= jobs.size(); ++i) {
    if (i < jobs.size()) {
      PRESCENE_RETURN_IF_ERROR(draw(jobs[i], options));
      send_back(options, &pixels_[i % 2]);
    }
    if (i > 0) {
      PRESCENE_RETURN_IF_ERROR(take(options, pixels_[(i - 1) % 2], &views[i - 1]));
    }
  }
  const GLenum error = glGetError();
  if (error != GL_NO_ERROR) return gl_failure("OpenGL error " + std::to_string(error));
  return core::ok_status();
}

core::Status GlViews::draw(const RenderJob& job, const RenderOptions& options) {
  const geometry::PinholeCamera& camera = job.camera;
  if (std::max(camera.width, camera.height) > max_image_size_)
    return core::unsupported("OpenGL renderer: an image of " + std::to_string(camera.width) + " x " +
                             std::to_string(camera.height) + " is more than the device draws (" +
                             std::to_string(max_image_size_) + "): use a smaller camera or the reference renderer");
  PRESCENE_RETURN_IF_ERROR(set_size(camera.width, camera.height));
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, camera.width, camera.height);
  // Images that nobody asked for are not drawn.
  const std::array<GLenum, 4> drawn = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1,
                                       options.normals ? GLenum{GL_COLOR_ATTACHMENT2} : GLenum{GL_NONE},
                                       options.color ? GLenum{GL_COLOR_ATTACHMENT3} : GLenum{GL_NONE}};
  glDrawBuffers(static_cast<GLsizei>(drawn.size()), drawn.data());
  constexpr std::array<GLfloat, 4> kNothing = {0, 0, 0, 0};
  constexpr std::array<GLuint, 4> kNoLabel = {0, 0, 0, 0};
  constexpr GLfloat kFarthest = 1.0f;
  const geometry::Rgb& back = options.lighting.background;
  const std::array<GLfloat, 4> background = {static_cast<float>(back[0]) / 255.0f, static_cast<float>(back[1]) / 255.0f,
                                             static_cast<float>(back[2]) / 255.0f, 1.0f};
  glClearBufferfv(GL_COLOR, 0, kNothing.data());
  glClearBufferuiv(GL_COLOR, 1, kNoLabel.data());
  if (options.normals) glClearBufferfv(GL_COLOR, 2, kNothing.data());
  if (options.color) glClearBufferfv(GL_COLOR, 3, background.data());
  glClearBufferfv(GL_DEPTH, 0, &kFarthest);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DITHER);
  glDisable(GL_FRAMEBUFFER_SRGB);  // the shader does it

  const Program& program = options.color ? colored_ : plain_;
  glUseProgram(program.name);
  // Pixel centres are at integers in our images, at halves in the device's.
  const double width = camera.width;
  const double height = camera.height;
  glUniform4f(program.projection, static_cast<float>(2.0 * camera.fx / width),
              static_cast<float>(2.0 * camera.fy / height), static_cast<float>(2.0 * (camera.cx + 0.5) / width - 1.0),
              static_cast<float>(2.0 * (camera.cy + 0.5) / height - 1.0));
  const double span = options.far_depth - options.near_depth;
  glUniform2f(program.clip, static_cast<float>((options.far_depth + options.near_depth) / span),
              static_cast<float>(-2.0 * options.far_depth * options.near_depth / span));
  const Vector3f light = (job.X_WC.rotation.conjugate() * options.lighting.towards_light_W.normalized()).cast<float>();
  glUniform3fv(program.light, 1, light.data());
  glUniform2f(program.shares, static_cast<float>(options.lighting.ambient),
              static_cast<float>(options.lighting.direct));
  const geometry::Pose X_CW = job.X_WC.inverse();
  for (std::size_t i = 0; i < job.scene->instances.size(); ++i)
    PRESCENE_RETURN_IF_ERROR(draw_instance(job.scene->instances[i], program, X_CW, static_cast<unsigned>(i + 1)));
  return core::ok_status();
}

core::Status GlViews::draw_instance(const RenderInstance& instance, const Program& program, const geometry::Pose& X_CW,
                                    unsigned label) {
  if (instance.mesh->triangles.empty()) return core::ok_status();
  PRESCENE_TRY(const GlMesh* mesh, meshes_.get(instance.mesh));
  const geometry::Pose X_CM = X_CW * instance.X_WM;
  const Eigen::Matrix3f rotation = X_CM.rotation.toRotationMatrix().cast<float>();
  const Vector3f translation = X_CM.translation.cast<float>();
  const Vector3f material = linear(instance.material.color).cast<float>();
  glUniformMatrix3fv(program.rotation, 1, GL_FALSE, rotation.data());
  glUniform3fv(program.translation, 1, translation.data());
  glUniform1ui(program.label, label);
  glUniform1i(program.color_source, mesh->texture != 0 ? kOfTexture : mesh->colored ? kOfVertices : kOfMaterial);
  glUniform3fv(program.material, 1, material.data());
  glBindTexture(GL_TEXTURE_2D, mesh->texture);
  glBindVertexArray(mesh->vertex_array);
  glDrawArrays(GL_TRIANGLES, 0, mesh->vertices);
  return core::ok_status();
}

void GlViews::send_back(const RenderOptions& options, PixelBuffer* pixels) const {
  const Layout layout(width_, height_, options);
  if (pixels->name == 0) glGenBuffers(1, &pixels->name);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels->name);
  if (layout.size > pixels->size) {
    pixels->size = layout.size;
    glBufferData(GL_PIXEL_PACK_BUFFER, static_cast<GLsizeiptr>(pixels->size), nullptr, GL_STREAM_READ);
  }
  pixels->width = width_;
  pixels->height = height_;
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  const auto read = [&](GLenum from, GLenum format, GLenum type, std::size_t at) {
    glReadBuffer(from);
    glReadPixels(0, 0, width_, height_, format, type, reinterpret_cast<void*>(at));
  };
  read(GL_COLOR_ATTACHMENT0, GL_RED, GL_FLOAT, layout.depth);
  read(GL_COLOR_ATTACHMENT1, GL_RED_INTEGER, GL_UNSIGNED_SHORT, layout.labels);
  if (options.normals) read(GL_COLOR_ATTACHMENT2, GL_RGB, GL_FLOAT, layout.normals);
  if (options.color) read(GL_COLOR_ATTACHMENT3, GL_RGB, GL_UNSIGNED_BYTE, layout.color);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

core::Status GlViews::take(const RenderOptions& options, const PixelBuffer& pixels, RenderedView* view) {
  const Layout layout(pixels.width, pixels.height, options);
  glBindBuffer(GL_PIXEL_PACK_BUFFER, pixels.name);
  const auto* bytes = static_cast<const std::uint8_t*>(
      glMapBufferRange(GL_PIXEL_PACK_BUFFER, 0, static_cast<GLsizeiptr>(layout.size), GL_MAP_READ_BIT));
  if (bytes == nullptr) {
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    return gl_failure("the images can't be read");
  }
  static_assert(sizeof(Vector3f) == 3 * sizeof(float) && sizeof(geometry::Rgb) == 3);
  copy_image(bytes + layout.depth, pixels.width, pixels.height, 0.0f, &view->depth);
  copy_image(bytes + layout.labels, pixels.width, pixels.height, std::uint16_t{0}, &view->labels);
  if (options.normals) {
    copy_image(bytes + layout.normals, pixels.width, pixels.height, Vector3f(Vector3f::Zero()), &view->normals);
  } else {
    view->normals = geometry::Image<Vector3f>();
  }
  if (options.color) {
    copy_image(bytes + layout.color, pixels.width, pixels.height, geometry::Rgb{}, &view->color);
  } else {
    view->color = geometry::ColorImage();
  }
  const bool kept = glUnmapBuffer(GL_PIXEL_PACK_BUFFER) == GL_TRUE;
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  if (!kept) return gl_failure("the images were lost on their way");
  return core::ok_status();
}

}  // namespace prescene::rendering
