#include "viewer/gl.h"

// gl.h first
#include <epoxy/egl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "base/error.h"

namespace crownfit {
namespace {

[[noreturn]] void NoGraphics(const std::string& what) {
  throw InputError("", "OpenGL", what,
                   "Install a graphics driver with OpenGL 3.3 or later. Without a graphics processor use Mesa's "
                   "(Debian: libgl1-mesa-dri, libegl1).");
}

GLuint Compile(GLenum kind, std::initializer_list<const char*> files) {
  std::string text = "#version 330 core\n#define Float float\n#define TERM\n#define OUT(T) out T\n" +
                     std::string(ShaderText("terms.glsl"));
  for (const char* file : files) text += "#line 1\n" + std::string(ShaderText(file));
  const GLuint shader = glCreateShader(kind);
  const char* source = text.c_str();
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good) return shader;
  char log[2000] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  NoGraphics("the graphics driver (" + GraphicsProcessor() + ") does not compile " + *(files.end() - 1) + ": " + log);
}

void Link(GLuint program) {
  glLinkProgram(program);
  GLint good = 0;
  glGetProgramiv(program, GL_LINK_STATUS, &good);
  if (good) return;
  char log[2000] = "";
  glGetProgramInfoLog(program, sizeof log, nullptr, log);
  NoGraphics("the graphics driver (" + GraphicsProcessor() + ") does not link a shader program: " + log);
}

GLuint Attached(std::initializer_list<std::pair<GLenum, std::initializer_list<const char*>>> shaders) {
  const GLuint program = glCreateProgram();
  for (const auto& [kind, files] : shaders) {
    const GLuint shader = Compile(kind, files);
    glAttachShader(program, shader);
    glDeleteShader(shader);
  }
  return program;
}

// Displays without a window: those of graphics processors, and last Mesa's, which renders on the CPU if it finds none.
// (Not every driver supports Mesa's platform; NVIDIA's has only devices.)
std::vector<EGLDisplay> DisplaysWithoutWindow() {
  std::vector<EGLDisplay> displays;
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices;
    EGLint count = 0;
    eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count);
    for (EGLDeviceEXT device : std::span(devices).first(static_cast<size_t>(count))) {
      const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
      if (extensions && std::strstr(extensions, "EGL_MESA_device_software")) continue;
      displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  displays.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr));
  return displays;
}

}  // namespace

OffscreenContext::OffscreenContext() {
  const EGLint attributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  for (EGLDisplay display : DisplaysWithoutWindow()) {
    EGLint major, minor;
    if (!display || !eglInitialize(display, &major, &minor)) continue;
    eglBindAPI(EGL_OPENGL_API);
    context_ = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    display_ = display;
    if (!context_) continue;
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) return;
    eglDestroyContext(display, context_);
  }
  NoGraphics(display_ ? "EGL offers no context of OpenGL 3.3" : "there is no EGL display without a window");
}

OffscreenContext::~OffscreenContext() {
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

std::string GraphicsProcessor() {
  const auto* name = glGetString(GL_RENDERER);
  return name ? reinterpret_cast<const char*>(name) : "no driver";
}

Buffer::~Buffer() {
  glDeleteTextures(1, &texture_);
  glDeleteBuffers(1, &buffer_);
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(buffer_, other.buffer_);
  std::swap(texture_, other.texture_);
  return *this;
}

void Buffer::Upload(const void* data, size_t bytes, GLenum format) {
  if (!buffer_) {
    glGenBuffers(1, &buffer_);
    glGenTextures(1, &texture_);
  }
  glBindBuffer(GL_TEXTURE_BUFFER, buffer_);
  glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(std::max(bytes, sizeof(glm::vec4))), nullptr,
               GL_DYNAMIC_DRAW);
  if (data && bytes) glBufferSubData(GL_TEXTURE_BUFFER, 0, static_cast<GLsizeiptr>(bytes), data);
  glBindTexture(GL_TEXTURE_BUFFER, texture_);
  glTexBuffer(GL_TEXTURE_BUFFER, format, buffer_);
}

void VertexArray::SetAttribute(GLuint index, const Buffer& buffer, int count) {
  Bind();
  glBindBuffer(GL_ARRAY_BUFFER, buffer.buffer());
  glEnableVertexAttribArray(index);
  glVertexAttribPointer(index, count, GL_FLOAT, GL_FALSE, sizeof(glm::vec4), nullptr);
}

void VertexArray::SetIntegerAttribute(GLuint index, const Buffer& buffer) {
  Bind();
  glBindBuffer(GL_ARRAY_BUFFER, buffer.buffer());
  glEnableVertexAttribArray(index);
  glVertexAttribIPointer(index, 1, GL_INT, sizeof(int), nullptr);
}

void VertexArray::SetIndices(const Buffer& buffer) {
  Bind();
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer.buffer());
}

Program Program::Of(std::initializer_list<const char*> vertex, std::initializer_list<const char*> fragment) {
  Program p(Attached({{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}));
  Link(p.program_);
  return p;
}

Program Program::Capturing(std::initializer_list<const char*> vertex, const char* captured) {
  Program p(Attached({{GL_VERTEX_SHADER, vertex}}));
  glTransformFeedbackVaryings(p.program_, 1, &captured, GL_INTERLEAVED_ATTRIBS);
  Link(p.program_);
  return p;
}

Program::~Program() {
  if (program_) glDeleteProgram(program_);
}

void Program::Use() {
  glUseProgram(program_);
  units_ = 0;
}

void Program::Set(const char* name, const Buffer& buffer) {
  const GLint at = At(name);
  if (at < 0) return;
  glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + units_));
  glBindTexture(GL_TEXTURE_BUFFER, buffer.texture());
  glUniform1i(at, units_++);
}

void Program::SetBlock(const char* name, const Buffer& buffer) const {
  glUniformBlockBinding(program_, glGetUniformBlockIndex(program_, name), 0);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, buffer.buffer());
}

void Program::CaptureInto(const Buffer& target, size_t count) const {
  glEnable(GL_RASTERIZER_DISCARD);
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, target.buffer());
  glBeginTransformFeedback(GL_POINTS);
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(count));
  glEndTransformFeedback();
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  glDisable(GL_RASTERIZER_DISCARD);
}

Canvas::Canvas(int width, int height) : width_(width), height_(height) {
  glGenFramebuffers(1, &frame_);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glGenTextures(1, &colour_);
  glBindTexture(GL_TEXTURE_2D, colour_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, width, height, 0, GL_RGBA, GL_FLOAT, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour_, 0);
  glGenRenderbuffers(1, &depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    NoGraphics("the graphics driver draws no pictures of " + std::to_string(width) + " x " + std::to_string(height) +
               " in floating point");
}

Canvas::~Canvas() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteRenderbuffers(1, &depth_);
  glDeleteTextures(1, &colour_);
}

void Canvas::Clear() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, width_, height_);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

Image Canvas::Read() const {
  std::vector<float> rgba(static_cast<size_t>(width_) * height_ * 4);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glReadPixels(0, 0, width_, height_, GL_RGBA, GL_FLOAT, rgba.data());
  Image image(width_, height_, 3);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x)
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = rgba[4 * (static_cast<size_t>(height_ - 1 - y) * width_ + x) + c];
  return image;
}

}  // namespace crownfit
