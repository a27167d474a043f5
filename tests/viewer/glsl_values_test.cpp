// shaders/terms.glsl as the graphics driver computes it, against the same text in double, over corners and the whole
// range of what a capture may state. Runs without a display (on Mesa's llvmpipe where there is no graphics processor).

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include "base/error.h"
#include "base/random.h"
#include "support/term_rows.h"
#include "viewer/gl.h"

namespace crownfit {
namespace {

constexpr int kSide = 64;    // samples per term: kSide^2
constexpr size_t kMost = 8;  // arguments of a term: two textures of four

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

/// The term at every sample's kMost arguments, computed by a fragment shader.
std::vector<float> Rendered(std::string call, const std::vector<float>& arguments) {
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
                             "uniform sampler2D first, second;\nout vec4 value;\nvoid main() {\n"
                             "  vec4 a = texelFetch(first, ivec2(gl_FragCoord.xy), 0);\n"
                             "  vec4 b = texelFetch(second, ivec2(gl_FragCoord.xy), 0);\n"
                             "  float x[8] = float[8](a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w);\n  value = vec4(" +
                             call + ");\n}\n"));
  glLinkProgram(program);
  GLuint frame, vertices;
  glGenVertexArrays(1, &vertices);
  glBindVertexArray(vertices);
  glGenFramebuffers(1, &frame);
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  const GLuint target = FloatTexture(nullptr);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
  glViewport(0, 0, kSide, kSide);
  glUseProgram(program);
  for (const int unit : {0, 1}) {
    std::vector<float> half;
    for (size_t i = 4 * unit; i < arguments.size(); i += kMost)
      half.insert(half.end(), &arguments[i], &arguments[i] + 4);
    glActiveTexture(GL_TEXTURE0 + unit);
    FloatTexture(half.data());
    glUniform1i(glGetUniformLocation(program, unit ? "second" : "first"), unit);
  }
  glDrawArrays(GL_TRIANGLES, 0, 3);
  std::vector<float> pixels(4 * kSide * kSide);
  glReadPixels(0, 0, kSide, kSide, GL_RGBA, GL_FLOAT, pixels.data());
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  glDeleteProgram(program);
  std::vector<float> values;
  for (size_t i = 0; i < pixels.size(); i += 4) values.push_back(pixels[i]);
  return values;
}

TEST(Glsl, EveryTermMatchesDoubleToSinglePrecision) {
  std::optional<OffscreenContext> context;
  try {
    context.emplace();
  } catch (const InputError& e) {
    GTEST_SKIP() << e.what();
  }
  std::printf("%s\n", GraphicsProcessor().c_str());
  ForEachTerm([](const TermRow& term, const auto& in_double) {
    std::vector<float> arguments;
    for (uint64_t i = 0; i < kSide * kSide; ++i)
      for (uint64_t k = 0; k < kMost; ++k)
        arguments.push_back(k < term.ranges.size() ? static_cast<float>(term.ranges[k].Draw(Key(i, k))) : 0.0f);
    const std::vector<float> values = Rendered(term.call, arguments);
    double worst = 0, worst_allowed = 0;
    int beyond = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      double x[kMost];
      for (size_t k = 0; k < kMost; ++k) x[k] = arguments[kMost * i + k];
      const double exact = in_double(x);
      // The possible error from rounding every argument to single precision.
      double conditioning = 0;
      for (size_t k = 0; k < term.ranges.size(); ++k) {
        const double at = x[k];
        x[k] = at * (1 + std::ldexp(1.0, -24));
        conditioning += std::abs(in_double(x) - exact);
        x[k] = at;
      }
      const double miss = std::abs(values[i] - exact);
      const double allowed = 2e-5 * std::abs(exact) + 4 * conditioning + 1e-9;
      worst = std::max(worst, miss / std::max(std::abs(exact), 1e-30));
      worst_allowed = std::max(worst_allowed, miss / allowed);
      if (miss <= allowed) continue;
      if (beyond++ > 3) continue;
      std::string text;
      for (size_t k = 0; k < term.ranges.size(); ++k) text += " " + std::to_string(x[k]);
      ADD_FAILURE() << term.name << " at" << text << ": " << values[i] << ", in double " << exact;
    }
    std::printf("  %-32s at most %.1e from double, %.2f of what is allowed\n", term.name, worst, worst_allowed);
  });
}

TEST(Glsl, EveryShaderTermIsCompared) {
  std::string calls;
  ForEachTerm([&](const TermRow& term, const auto&) { calls += term.call; });
  const std::string text = TermsText();
  const std::string definition = "TERM Float ";
  int terms = 0;
  for (size_t at = text.find(definition); at != std::string::npos; at = text.find(definition, at + 1), ++terms) {
    const size_t name = at + definition.size();
    const std::string call = text.substr(name, text.find('(', name) + 1 - name);
    EXPECT_NE(calls.find("T::" + call), std::string::npos) << call << ") has no row in term_rows.h";
  }
  EXPECT_GT(terms, 20);
}

}  // namespace
}  // namespace crownfit
