#include "viewer/crown_canvas.h"

#include <algorithm>

namespace crownfit {
namespace {

// Slower drivers draw moving pictures at lower resolution, faster ones at higher.
constexpr double kSlow_s = 0.06, kQuick_s = 0.02;
constexpr int kCoarsest = 4;

}  // namespace

bool CrownCanvas::Draw(CrownView view, bool is_moving, bool hurries) {
  view.pose.light_turn = glm::dmat3(1.0);  // turned lamps show once their light is cast, as a new version
  const auto begin = Clock::now();
  if (is_moving) moved_at_ = begin;
  const bool rests = !is_moving && !scene_.IsBusy() &&
                     (hurries || std::chrono::duration<double>(begin - moved_at_).count() >= kRest_s);
  const bool still = rests || view.is_thickness;
  if (is_drawn_ && view == drawn_ && scene_.version() == version_ && (is_still_ || !still)) return false;
  const glm::ivec2 size = glm::max(view.pane / (still ? 1 : coarseness_), glm::ivec2(1));
  if (!canvas_ || size_ != size) canvas_ = std::make_unique<Canvas>(size.x, size.y);
  size_ = size;
  drawn_ = view;  // also if the renderer throws: it would throw again
  version_ = scene_.version();
  is_drawn_ = true;
  is_still_ = still;
  DrawOn(*canvas_, size, view, still ? Quality::kStill : Quality::kMoving);
  if (still) return true;
  glFinish();
  KeepTime(std::chrono::duration<double>(Clock::now() - begin).count());
  return true;
}

void CrownCanvas::KeepTime(double seconds) {
  if (seconds > kSlow_s) coarseness_ = std::min(coarseness_ + 1, kCoarsest);
  if (seconds < kQuick_s) coarseness_ = std::max(coarseness_ - 1, 1);
}

void CrownCanvas::DrawOn(const Canvas& canvas, glm::ivec2 size, const CrownView& view, Quality quality) const {
  PhotographSpec posed = scene_.capture().photographs[view.photograph];
  posed.camera = PaneCamera(view.pose, posed.camera, size);
  posed.camera_from_object = view.pose.camera_from_object;
  canvas.Clear();
  if (view.is_thickness) {
    scene_.thickness_view().Draw(posed, canvas, scene_.outer_thickness_scale());
  } else if (scene_.HasLightOf(view.photograph)) {
    scene_.renderer().Draw(posed, view.terms, canvas, quality);
  }
}

Image CrownCanvas::InFull(const CrownView& view) const {
  const Canvas canvas(view.pane.x, view.pane.y);
  DrawOn(canvas, view.pane, view, Quality::kStill);
  return canvas.Read();
}

}  // namespace crownfit
