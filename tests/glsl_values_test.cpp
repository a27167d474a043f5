// shaders/terms.glsl as the graphics driver computes it, against the same text in double. Runs without a display (EGL
// surfaceless: Mesa's llvmpipe where there is no graphics processor).

#include <epoxy/gl.h>
// gl.h first
#include <epoxy/egl.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "base/random.h"
#include "support/term_cases.h"

namespace crownfit {
namespace {

constexpr int kSide = 64;  // samples per term: kSide^2

/// Makes a context without a window current; says what failed, or nothing.
std::string MakeContext() {
  const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  EGLint major, minor;
  if (!eglInitialize(display, &major, &minor)) return "eglInitialize";
  eglBindAPI(EGL_OPENGL_API);
  const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
  const EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT) return "eglCreateContext";
  return eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) ? "" : "eglMakeCurrent";
}

GLuint Compile(GLenum kind, const std::string& text) {
  const GLuint shader = glCreateShader(kind);
  const char* source = text.c_str();
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  char log[2000] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  EXPECT_TRUE(good) << log;
  return shader;
}

GLuint FloatTexture(const float* data) {
  GLuint texture;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, kSide, kSide, 0, GL_RGBA, GL_FLOAT, data);
  return texture;
}

std::string TermsText() {
  std::ifstream file(CROWNFIT_TERMS_GLSL);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The term at every argument, computed by a fragment shader.
std::vector<float> Rendered(const TermCase& term, const std::vector<float>& arguments) {
  std::string call = term.call;
  for (size_t at; (at = call.find("T::")) != std::string::npos;) call.erase(at, 3);
  const GLuint program = glCreateProgram();
  glAttachShader(
      program,
      Compile(GL_VERTEX_SHADER,
              "#version 330 core\nvoid main() {\n"
              "  gl_Position = vec4(vec2[3](vec2(-1, -1), vec2(3, -1), vec2(-1, 3))[gl_VertexID], 0, 1);\n}\n"));
  glAttachShader(program,
                 Compile(GL_FRAGMENT_SHADER,
                         "#version 330 core\n#define Float float\n#define TERM\n#define OUT(T) out T\n" + TermsText() +
                             "uniform sampler2D arguments;\nout vec4 value;\nvoid main() {\n"
                             "  vec4 a = texelFetch(arguments, ivec2(gl_FragCoord.xy), 0);\n"
                             "  float x[4] = float[4](a.x, a.y, a.z, a.w);\n  value = vec4(" +
                             call + ");\n}\n"));
  glLinkProgram(program);
  GLuint frame, vertices;
  glGenVertexArrays(1, &vertices);
  glBindVertexArray(vertices);
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  const GLuint target = FloatTexture(nullptr), source = FloatTexture(arguments.data());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
  glViewport(0, 0, kSide, kSide);
  glUseProgram(program);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, source);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  std::vector<float> pixels(4 * kSide * kSide);
  glReadPixels(0, 0, kSide, kSide, GL_RGBA, GL_FLOAT, pixels.data());
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  glDeleteProgram(program);
  std::vector<float> values;
  for (size_t i = 0; i < pixels.size(); i += 4) values.push_back(pixels[i]);
  return values;
}

TEST(Glsl, EveryTermOnTheGraphicsDriverEqualsDoubleToSinglePrecision) {
  if (const std::string failed = MakeContext(); !failed.empty())
    GTEST_SKIP() << "no OpenGL without a display: " << failed;
  std::printf("%s\n", reinterpret_cast<const char*>(glGetString(GL_RENDERER)));
  for (const TermCase& term : TermCases()) {
    std::vector<float> arguments;
    for (int i = 0; i < kSide * kSide; ++i)
      for (size_t k = 0; k < 4; ++k) {
        const auto [low, high] = k < term.ranges.size() ? term.ranges[k] : std::pair(0.0, 0.0);
        arguments.push_back(static_cast<float>(low + (high - low) * Uniform(i, k)));
      }
    const std::vector<float> values = Rendered(term, arguments);
    double worst = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      double x[4];
      for (int k = 0; k < 4; ++k) x[k] = arguments[4 * i + k];
      const double exact = term.plain(x);
      // What rounding every argument to single precision could do to the value.
      double conditioning = 0;
      for (int k = 0; k < 4; ++k) {
        const double at = x[k];
        x[k] = at * (1 + std::ldexp(1.0, -24));
        conditioning += std::abs(term.plain(x) - exact);
        x[k] = at;
      }
      const double miss = std::abs(values[i] - exact);
      worst = std::max(worst, miss / std::max(std::abs(exact), 1e-30));
      ASSERT_LE(miss, 2e-5 * std::abs(exact) + 4 * conditioning + 1e-9)
          << term.name << " sample " << i << ": " << exact;
    }
    std::printf("  %-22s at most %.1e from double\n", term.name.c_str(), worst);
  }
}

}  // namespace
}  // namespace crownfit
