#pragma once
// RAII wrappers of OpenGL 3.3 objects, and a context without a window. Only this file and crown_renderer.cpp call the
// driver's entry points.

#include <epoxy/gl.h>

#include <glm/glm.hpp>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photo/image.h"
#include "viewer/shown_channels.h"

namespace crownfit {

inline glm::vec4 Vec4(const glm::dvec3& v, double w = 0) { return {glm::vec3(v), static_cast<float>(w)}; }
inline glm::vec4 Vec4(const Spectrum& v, const ShownChannels& shown, double w = 0) {
  return Vec4(glm::dvec3(v[shown[0]], v[shown[1]], v[shown[2]]), w);
}

/// A current OpenGL context without display or window (EGL): of a graphics processor if there is one, else of Mesa on
/// the CPU. Throws InputError when there is neither.
class OffscreenContext {
 public:
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

 private:
  void *display_ = nullptr, *context_ = nullptr;
};

/// The name of the graphics processor, or of its software replacement.
std::string GraphicsProcessor();

/// Numbers in memory of the graphics processor, read by texelFetch or as vertex attributes.
class Buffer {
 public:
  Buffer() = default;
  ~Buffer();
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept;

  void Upload(std::span<const glm::vec4> data) { Upload(data.data(), data.size_bytes(), GL_RGBA32F); }
  void Upload(std::span<const glm::ivec4> data) { Upload(data.data(), data.size_bytes(), GL_RGBA32I); }
  void Upload(std::span<const float> data) { Upload(data.data(), data.size_bytes(), GL_R32F); }
  void Upload(std::span<const int> data) { Upload(data.data(), data.size_bytes(), GL_R32I); }
  /// Allocates `count` vec4 for the graphics processor to write.
  void Allocate(size_t count) { Upload(nullptr, count * sizeof(glm::vec4), GL_RGBA32F); }
  GLuint buffer() const { return buffer_; }
  GLuint texture() const { return texture_; }

 private:
  void Upload(const void* data, size_t bytes, GLenum format);
  GLuint buffer_ = 0, texture_ = 0;
};

/// The buffers that a draw call reads as vertex attributes.
class VertexArray {
 public:
  VertexArray() { glGenVertexArrays(1, &vertices_); }
  ~VertexArray() { glDeleteVertexArrays(1, &vertices_); }
  VertexArray(const VertexArray&) = delete;
  VertexArray& operator=(const VertexArray&) = delete;
  void Bind() const { glBindVertexArray(vertices_); }
  /// The first `count` numbers of every vec4.
  void SetAttribute(GLuint index, const Buffer& buffer, int count);
  void SetIntegerAttribute(GLuint index, const Buffer& buffer);
  void SetIndices(const Buffer& buffer);

 private:
  GLuint vertices_ = 0;
};

/// Vertex and fragment shader, or a vertex shader alone that writes its output `captured` to a buffer.
class Program {
 public:
  /// Names of files in shaders/; terms.glsl is prepended. Throws InputError with the driver's error message.
  static Program Of(std::initializer_list<const char*> vertex, std::initializer_list<const char*> fragment);
  static Program Capturing(std::initializer_list<const char*> vertex, const char* captured);
  ~Program();
  Program(Program&& other) noexcept : program_(other.program_) { other.program_ = 0; }
  Program& operator=(Program&&) = delete;

  void Use();
  // Values of uniforms that the driver has optimised away are ignored.
  void Set(const char* name, bool value) const { glUniform1i(At(name), value); }
  void Set(const char* name, int value) const { glUniform1i(At(name), value); }
  void Set(const char* name, double value) const { glUniform1f(At(name), static_cast<float>(value)); }
  void Set(const char* name, const glm::vec2& v) const { glUniform2f(At(name), v.x, v.y); }
  void Set(const char* name, const glm::vec3& v) const { glUniform3f(At(name), v.x, v.y, v.z); }
  void Set(const char* name, const glm::mat3& m) const { glUniformMatrix3fv(At(name), 1, GL_FALSE, &m[0][0]); }
  void Set(const char* name, std::span<const float> v) const {
    glUniform1fv(At(name), static_cast<GLsizei>(v.size()), v.data());
  }
  void Set(const char* name, std::span<const int> v) const {
    glUniform1iv(At(name), static_cast<GLsizei>(v.size()), v.data());
  }
  void Set(const char* name, std::span<const glm::vec3> v) const {
    glUniform3fv(At(name), static_cast<GLsizei>(v.size()), &v[0].x);
  }
  /// The buffer as the samplerBuffer `name`; call after Use.
  void Set(const char* name, const Buffer& buffer);

  /// The buffer as the uniform block `name`.
  void SetBlock(const char* name, const Buffer& buffer) const;

  /// Runs the vertex shader `count` times and captures its output in `target`. Call after Use.
  void CaptureInto(const Buffer& target, size_t count) const;

 private:
  explicit Program(GLuint program) : program_(program) {}
  GLint At(const char* name) const { return glGetUniformLocation(program_, name); }
  GLuint program_ = 0;
  int units_ = 0;
};

/// A floating-point render target with depth.
class Canvas {
 public:
  Canvas(int width, int height);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  void Clear() const;  ///< also makes it the target of later draws
  Image Read() const;  ///< three channels, top row first
  GLuint texture() const { return colour_; }

 private:
  int width_, height_;
  GLuint frame_ = 0, colour_ = 0, depth_ = 0;
};

/// The text of a file in shaders/, as compiled in.
std::string_view ShaderText(std::string_view name);

}  // namespace crownfit
