#pragma once
// The crown's picture in a pane of the window. It is redrawn only when something in it has changed: fast during
// changes, at full quality once they have stopped.

#include <chrono>
#include <memory>

#include "viewer/view_pose.h"
#include "viewer/view_scene.h"

namespace crownfit {

/// Everything that the picture depends on, besides the scene itself.
struct CrownView {
  size_t photograph = 0;
  ViewPose pose;
  glm::ivec2 pane{1};
  ShownTerms terms;
  bool is_thickness = false;
  bool operator==(const CrownView&) const = default;
};

class CrownCanvas {
 public:
  /// Needs a current context.
  explicit CrownCanvas(ViewScene& scene) : scene_(scene) {}

  /// Draws if necessary; true when it did. Passes on exceptions of the renderer, and leaves the picture black.
  /// `hurries`: full quality at once when nothing moves.
  bool Draw(CrownView view, bool is_moving, bool hurries);
  /// The linear picture at full quality, at exposure 1.
  Image InFull(const CrownView& view) const;
  bool OwesStill() const { return is_drawn_ && !is_still_; }
  GLuint texture() const { return canvas_->texture(); }

  static constexpr double kRest_s = 0.15;  ///< from the end of a movement to the full-quality picture

 private:
  using Clock = std::chrono::steady_clock;
  void DrawOn(const Canvas& canvas, glm::ivec2 size, const CrownView& view, Quality quality) const;
  void KeepTime(double seconds);

  ViewScene& scene_;
  std::unique_ptr<Canvas> canvas_;
  glm::ivec2 size_{0};
  CrownView drawn_;
  int version_ = -1;
  bool is_drawn_ = false, is_still_ = false;
  int coarseness_ = 1;  ///< pane pixels per pixel of a moving picture
  Clock::time_point moved_at_ = Clock::now();
};

}  // namespace crownfit
