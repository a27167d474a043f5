#include "viewer/display.h"

#include <algorithm>

#include "base/error.h"

namespace crownfit {

PictureTexture::PictureTexture() {
  glGenTextures(1, &texture_);
  Upload(Image(1, 1, 3), false);
}

PictureTexture::~PictureTexture() { glDeleteTextures(1, &texture_); }

void PictureTexture::Upload(const Image& picture, bool smooth) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (std::max(picture.width, picture.height) > largest)
    throw InputError("", "OpenGL",
                     "the graphics driver shows no pictures above " + std::to_string(largest) +
                         " pixels, but this one has " + std::to_string(picture.width) + " x " +
                         std::to_string(picture.height),
                     "Use a smaller photograph, with a camera file of its size.");
  glBindTexture(GL_TEXTURE_2D, texture_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, picture.width, picture.height, 0, GL_RGB, GL_FLOAT, picture.values.data());
  if (smooth) glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, smooth ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, smooth ? GL_LINEAR : GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

Display::Display() : program_(Program::Of({"viewer/display.vert"}, {"viewer/display.frag"})) {
  glGenVertexArrays(1, &nothing_);
}

Display::~Display() { glDeleteVertexArrays(1, &nothing_); }

void Display::Clear(glm::ivec2 window_size) {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, window_size.x, window_size.y);
  glClearColor(0.10f, 0.10f, 0.11f, 1);
  glClear(GL_COLOR_BUFFER_BIT);
}

void Display::Draw(const Pane& pane, glm::ivec2 window_size, GLuint canvas, const DisplaySettings& settings) {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(pane.corner.x, window_size.y - pane.corner.y - pane.size.y, pane.size.x, pane.size.y);
  program_.Use();
  const GLuint textures[] = {canvas, photograph.texture(), map.texture()};
  const char* const names[] = {"canvas", "photograph", "map"};
  for (int i = 0; i < 3; ++i) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + i));
    glBindTexture(GL_TEXTURE_2D, textures[i]);
    program_.Set(names[i], i);
  }
  glActiveTexture(GL_TEXTURE0);  // the canvas can be coarser than the pane
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  program_.Set("pane_size", glm::vec2(pane.size));
  program_.Set("picture_size", glm::vec2(settings.picture_size_px));
  program_.Set("picture_centre", glm::vec2(settings.centre_px));
  program_.Set("pane_scale", settings.scale);
  program_.Set("left_source", static_cast<int>(pane.left));
  program_.Set("right_source", static_cast<int>(pane.right));
  program_.Set("divider", static_cast<double>(pane.divider));
  program_.Set("viewer_scale", settings.viewer_scale);
  program_.Set("photograph_scale", settings.photograph_scale);
  program_.Set("rgb_from_sensor", glm::mat3(settings.rgb_from_sensor));
  glBindVertexArray(nothing_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace crownfit
