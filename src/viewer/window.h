#pragma once
// A window on the screen with an OpenGL context and Dear ImGui, independent of its content. GLFW and ImGui's backends
// are named in window.cpp only.

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "photo/image.h"

struct GLFWwindow;

namespace crownfit {

/// Keys without a character; other keys are given by their character.
enum Key : unsigned { kKeyEscape = 0x110000, kKeyHome, kKeyF1 };

class Window {
 public:
  /// Makes its context current; not visible yet. Throws InputError without a display or without OpenGL 3.3.
  Window(const std::string& title, int width, int height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void Appear();
  /// Sleeps until user input, at most `seconds`. True when there was input.
  bool Wait(double seconds);
  bool IsClosed() const;
  /// Keys since the last call; none while the user types into a field.
  std::vector<unsigned> TakeKeys();

  /// Starts a frame: clears the window and enables ImGui calls.
  void Begin();
  /// Draws ImGui's widgets. The window's content can be read until Show.
  void DrawWidgets();
  void Show();
  /// A part of the window in its own pixels, from the top left; sRGB-encoded.
  Image Read(glm::ivec2 corner, glm::ivec2 size) const;

  glm::ivec2 size() const;         ///< in its own pixels, which are finer than ImGui's units on some screens
  double pixels_per_unit() const;  ///< of ImGui's units

 private:
  GLFWwindow* window_ = nullptr;
};

}  // namespace crownfit
