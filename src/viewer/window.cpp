#include "viewer/window.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <imgui.h>

#include <filesystem>

#include "base/error.h"
#include "photo/font.h"
// after epoxy
#include <GLFW/glfw3.h>

namespace crownfit {
namespace {

constexpr float kFont_px = 16.0f;

/// State that GLFW's callbacks set, as they carry no context. There is one window.
struct Happened {
  bool anything = false;
  std::vector<unsigned> keys;
  std::string error;
} happened;

[[noreturn]] void NoWindow() {
  throw InputError("", "window", happened.error.empty() ? "no window can be opened here" : happened.error,
                   "Use --screenshot FILE or --benchmark N, which need no display. Or set DISPLAY to a screen whose "
                   "driver has OpenGL 3.3.");
}

/// ImGui's backend calls the callbacks that it replaces.
void ListenTo(GLFWwindow* window) {
  const auto something = [](GLFWwindow*, auto...) { happened.anything = true; };
  glfwSetCursorPosCallback(window, something);
  glfwSetMouseButtonCallback(window, something);
  glfwSetScrollCallback(window, something);
  glfwSetWindowFocusCallback(window, something);
  glfwSetWindowRefreshCallback(window, something);
  glfwSetFramebufferSizeCallback(window, something);
  glfwSetWindowCloseCallback(window, something);
  glfwSetCharCallback(window, [](GLFWwindow*, unsigned character) {
    happened.anything = true;
    happened.keys.push_back(character);
  });
  glfwSetKeyCallback(window, [](GLFWwindow*, int key, int, int action, int) {
    happened.anything = true;
    if (action != GLFW_PRESS) return;
    if (key == GLFW_KEY_ESCAPE) happened.keys.push_back(kKeyEscape);
    if (key == GLFW_KEY_HOME) happened.keys.push_back(kKeyHome);
    if (key == GLFW_KEY_F1) happened.keys.push_back(kKeyF1);
  });
}

void LoadFont(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  std::error_code ignored;
  if (std::filesystem::exists(kFontFile, ignored)) {
    io.Fonts->AddFontFromFileTTF(kFontFile, kFont_px * scale);
  } else {
    io.FontGlobalScale = scale;
  }
}

void SetStyle(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.FrameRounding = style.GrabRounding = 3;
  style.ItemSpacing = {8, 5};
  style.Colors[ImGuiCol_WindowBg] = {0.13f, 0.13f, 0.14f, 1};
  style.ScaleAllSizes(scale);
}

}  // namespace

Window::Window(const std::string& title, int width, int height) {
  happened = {};
  glfwSetErrorCallback([](int, const char* what) { happened.error = what; });
  if (!glfwInit()) NoWindow();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  window_ = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (!window_) {
    glfwTerminate();
    NoWindow();
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  ListenTo(window_);
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  float scale = 1, unused = 1;
  glfwGetWindowContentScale(window_, &scale, &unused);
  LoadFont(scale);
  SetStyle(scale);
  ImGui_ImplGlfw_InitForOpenGL(window_, /*install_callbacks=*/true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::Appear() { glfwShowWindow(window_); }

bool Window::Wait(double seconds) {
  happened.anything = false;
  if (seconds > 0) {
    glfwWaitEventsTimeout(seconds);
  } else {
    glfwPollEvents();
  }
  return happened.anything;
}

bool Window::IsClosed() const { return glfwWindowShouldClose(window_); }

std::vector<unsigned> Window::TakeKeys() {
  std::vector<unsigned> keys;
  keys.swap(happened.keys);
  if (ImGui::GetIO().WantTextInput) keys.clear();
  return keys;
}

void Window::Begin() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Window::DrawWidgets() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::Show() { glfwSwapBuffers(window_); }

Image Window::Read(glm::ivec2 corner, glm::ivec2 size) const {
  const int height = this->size().y;
  std::vector<uint8_t> rgba(static_cast<size_t>(size.x) * size.y * 4);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glReadPixels(corner.x, height - corner.y - size.y, size.x, size.y, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  Image image(size.x, size.y, 3);
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x)
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) =
            static_cast<float>(rgba[4 * (static_cast<size_t>(size.y - 1 - y) * size.x + x) + c]) / 255.0f;
  return image;
}

glm::ivec2 Window::size() const {
  glm::ivec2 size;
  glfwGetFramebufferSize(window_, &size.x, &size.y);
  return size;
}

double Window::pixels_per_unit() const { return ImGui::GetIO().DisplayFramebufferScale.x; }

}  // namespace crownfit
