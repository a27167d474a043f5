#pragma once
// A window on the screen with an OpenGL context and Dear ImGui; knows nothing of what is shown. GLFW and ImGui's
// backends are named in window.cpp only.

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "photo/image.h"

struct GLFWwindow;

namespace crownfit {

/// Keys that type no character; those that do come as the character.
enum Key : unsigned { kKeyEscape = 0x110000, kKeyHome, kKeyF1 };

class Window {
 public:
  /// Makes its context current; is not on the screen yet. Throws InputError without a display or without OpenGL 3.3.
  Window(const std::string& title, int width, int height);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void Appear();
  /// Sleeps until the user does something, at most `seconds`. True when the user did.
  bool Wait(double seconds);
  bool IsClosed() const;
  /// Keys since the last call, but none while the user types into a field.
  std::vector<unsigned> TakeKeys();

  /// Starts a frame: clears the window and lets ImGui be used.
  void Begin();
  /// Draws ImGui's part. What stands in the window can be read until Show.
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
