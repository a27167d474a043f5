#pragma once
// Displays linear pictures: exposure, colour, and the layout of pictures in the window.

#include <glm/glm.hpp>

#include "photo/image.h"
#include "viewer/gl.h"

namespace crownfit {

enum class Source : int { kViewer, kPhotograph, kMap, kAsItIs };

/// A part of the window, in its own pixels from the top left. It shows `left` up to the divider, then `right`.
struct Pane {
  glm::ivec2 corner{0}, size{1};
  Source left = Source::kViewer, right = Source::kViewer;
  float divider = 0;
};

/// The photograph's position in a pane, and the conversion from linear values to colours.
struct DisplaySettings {
  glm::dvec2 picture_size_px{1}, centre_px{0.5};
  double scale = 1;                               ///< pane pixels per pixel of the photograph
  double viewer_scale = 1, photograph_scale = 1;  ///< factors on linear values
  glm::dmat3 rgb_from_sensor{1.0};
};

/// A picture in the graphics processor's memory.
class PictureTexture {
 public:
  PictureTexture();
  ~PictureTexture();
  PictureTexture(const PictureTexture&) = delete;
  PictureTexture& operator=(const PictureTexture&) = delete;
  /// Three channels. Throws InputError when it is larger than the driver's textures.
  void Upload(const Image& picture, bool smooth);
  GLuint texture() const { return texture_; }

 private:
  GLuint texture_ = 0;
};

class Display {
 public:
  Display();
  ~Display();
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  PictureTexture photograph, map;

  static void Clear(glm::ivec2 window_size);
  void Draw(const Pane& pane, glm::ivec2 window_size, GLuint canvas, const DisplaySettings& settings);

 private:
  Program program_;
  GLuint nothing_ = 0;  ///< vertex array without data: the shader makes the corners from their index
};

}  // namespace crownfit
