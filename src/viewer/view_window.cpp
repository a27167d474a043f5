#include "viewer/view_window.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "base/error.h"
#include "base/text.h"
#include "photo/figures.h"
#include "scene/build_crown.h"
#include "viewer/crown_canvas.h"
#include "viewer/material_sliders.h"
#include "viewer/saved_files.h"
#include "viewer/view_area.h"
#include "viewer/view_pose.h"
#include "viewer/window.h"

namespace crownfit {
namespace {

constexpr double kPixelsPerTurn = 900;  // length of a drag for one full turn
constexpr double kWheelFactor = 1.15;
constexpr int kSettlingFrames = 3;  // frames that ImGui needs until its layout is final
constexpr float kNoMap = 0.2f;      // grey in place of a difference

std::string DifferenceText(const ColourDifference& d) {
  return Printed("CIEDE2000, 8 x 8 blocks: median %.2f, 95 %% %.2f\n%.0f %% not seen, %.0f %% acceptable", d.median,
                 d.p95, 100 * d.share_below_pt, 100 * d.share_below_at);
}

class CrownWindow {
 public:
  CrownWindow(Window& window, ViewScene& scene, const MaterialRecord& record, const WindowOptions& options);
  /// Handles events, and draws if there were any. False: closed.
  bool Step();

 private:
  const PhotographSpec& photo() const { return scene_.capture().photographs[state_.photograph]; }
  SceneWish Wish() const;
  double TimeToWait() const;
  bool ShowsCrown() const { return state_.mode != ViewMode::kPhotograph && state_.mode != ViewMode::kDifference; }
  bool OwesStill() const { return ShowsCrown() && canvas_.OwesStill(); }
  bool HasToSave() const { return asked_.saves_picture || asked_.saves_window; }
  CrownView View(const std::vector<Pane>& panes) const;
  void DrawFrame();
  void TellState();
  void Apply(const ViewInput& input, const PanelAnswer& answer);
  void DrawPanes(const std::vector<Pane>& panes);
  void SavePicture(const std::vector<Pane>& panes);
  void SaveWindow();
  void SaveSliders();
  void Say(const std::string& text, bool is_error = false);
  bool Attempt(const std::function<void()>& what);
  void PrintLayout(const Layout& layout);

  Window& window_;
  ViewScene& scene_;
  const MaterialRecord& record_;
  const WindowOptions& options_;
  Display display_;
  PanelState state_;
  ViewPose pose_;
  size_t posed_photograph_ = 0;
  CrownCanvas canvas_;
  bool material_is_held_ = false, turns_lamps_ = false, refused_ = false, closes_ = false;
  PanelAnswer asked_;  ///< requests to save, done once everything is at rest
  int settling_ = kSettlingFrames, frames_ = 0;
  std::shared_ptr<const Photograph> uploaded_picture_;
  std::optional<int> uploaded_comparison_;
};

CrownWindow::CrownWindow(Window& window, ViewScene& scene, const MaterialRecord& record, const WindowOptions& options)
    : window_(window), scene_(scene), record_(record), options_(options), canvas_(scene) {
  const Capture& capture = scene.capture();
  state_.photograph = posed_photograph_ = options.photograph;
  for (const auto& p : capture.photographs) state_.photographs.push_back(p.name);
  state_.channels = capture.channel_names;
  state_.material = SlidersOf(capture, record);
  state_.about = GraphicsProcessor() + " \xc2\xb7 F1: help";
  if (!options.note.empty()) state_.about += "\n" + options.note;
  state_.thickness_of = capture.layers.size() > 1 ? capture.layers[0].name : "the whole object";
  for (const DifferenceStep& step : kDifferenceSteps) state_.difference_legend.push_back({step.label, step.colour});
  if (!options.has_photographs)
    state_.no_photograph = "There is no photograph to compare with, because the crown is given by --mesh.";
  pose_ = HomePose(photo(), scene.crown().fine);
}

SceneWish CrownWindow::Wish() const {
  SceneWish wish;
  wish.photograph = state_.photograph;
  wish.light_turn = pose_.light_turn;
  wish.is_turning = turns_lamps_;
  wish.material_rests = !material_is_held_;
  wish.terms = state_.terms;
  const bool compares = state_.mode == ViewMode::kDifference || state_.mode == ViewMode::kSideBySide;
  wish.photograph_is_shown = options_.has_photographs;
  wish.difference_is_shown = compares && options_.has_photographs && IsAtHome(pose_, photo());
  return wish;
}

double CrownWindow::TimeToWait() const {
  constexpr double kForever_s = 3600;
  if (settling_ > 0) return 0;
  if (scene_.IsBusy()) return 0.01;
  return OwesStill() || HasToSave() ? CrownCanvas::kRest_s : kForever_s;
}

bool CrownWindow::Step() {
  const bool touched = window_.Wait(TimeToWait()), changed = scene_.Update(Wish());
  if (touched || changed) {
    settling_ = kSettlingFrames;
  } else if (settling_ > 0) {
    --settling_;
  }
  if (turns_lamps_ && !changed && scene_.IsCastingLight()) return true;  // the next frame handles the whole drag so far
  const bool is_due = !scene_.IsBusy() && (OwesStill() || HasToSave());
  if (touched || changed || settling_ > 0 || is_due) DrawFrame();
  return !closes_ && !window_.IsClosed();
}

void CrownWindow::Say(const std::string& text, bool is_error) {
  state_.message = text;
  state_.message_is_error = is_error;
}

/// Shows a user's mistake in the panel; the window stays open.
bool CrownWindow::Attempt(const std::function<void()>& what) {
  try {
    what();
    return true;
  } catch (const InputError& e) {
    Say(e.what(), true);
    return false;
  }
}

/// Updates the text that the panel shows.
void CrownWindow::TellState() {
  if (const std::string error = scene_.TakeError(); !error.empty()) Say(error, true);
  state_.busy = scene_.busy_with();
  state_.most_thickness_mm = scene_.thickness_view().most_mm();
  if (options_.has_photographs) state_.no_photograph = scene_.picture_error(state_.photograph);
  const SceneDifference* difference = scene_.difference(state_.photograph);
  if (!state_.no_photograph.empty()) {
    state_.no_difference = "no photograph";
  } else if (!IsAtHome(pose_, photo())) {
    state_.no_difference =
        "Shown only from the photograph's camera and under its lamps; press R to return to them. You can zoom and move "
        "the picture.";
  } else {
    state_.no_difference = difference ? "" : "comparing ...";
  }
  state_.difference = difference && state_.no_difference.empty() ? DifferenceText(difference->colours) : "";
}

void CrownWindow::Apply(const ViewInput& input, const PanelAnswer& answer) {
  if (answer.closes) closes_ = true;
  if (state_.photograph != posed_photograph_ || answer.goes_home) {
    posed_photograph_ = state_.photograph;
    pose_ = HomePose(photo(), scene_.crown().fine);
  }
  const double per_turn = kPixelsPerTurn * window_.pixels_per_unit();
  if (input.orbit != glm::dvec2(0)) TurnCrown(pose_, scene_.middle(), TurnByDrag(input.orbit, per_turn));
  if (input.lamps != glm::dvec2(0)) TurnLamps(pose_, TurnByDrag(input.lamps, per_turn));
  if (input.pan != glm::dvec2(0)) Pan(pose_, photo().camera, input.pane, input.pan);
  if (input.wheel != 0) Zoom(pose_, photo().camera, input.pane, input.at, std::pow(kWheelFactor, input.wheel));
  turns_lamps_ = input.turns_lamps;
  if (answer.material_moved) scene_.SetMaterial(MaterialOf(state_.material, record_.material));
  material_is_held_ = (material_is_held_ || answer.material_moved) && !answer.material_released;
  if (answer.saves_picture) asked_.saves_picture = true;
  if (answer.saves_window) {
    asked_.saves_window = true;
    Say("");
  }
}

CrownView CrownWindow::View(const std::vector<Pane>& panes) const {
  return {state_.photograph, pose_, panes.front().size, state_.terms, state_.mode == ViewMode::kThickness};
}

void CrownWindow::DrawPanes(const std::vector<Pane>& panes) {
  if (const auto picture = scene_.picture(state_.photograph); picture != uploaded_picture_) {
    uploaded_picture_ = picture;  // also if the driver rejects it
    display_.photograph.Upload(picture ? picture->linear : Image(1, 1, 3), /*smooth=*/true);
  }
  const SceneDifference* difference = scene_.difference(state_.photograph);
  std::optional<int> comparison;
  if (difference && state_.no_difference.empty()) comparison = difference->number;
  if (comparison != uploaded_comparison_ || !comparison)
    display_.map.Upload(comparison ? difference->map : Image(1, 1, 3, kNoMap), /*smooth=*/false);
  uploaded_comparison_ = comparison;
  const Camera& camera = photo().camera;
  const double brightness = scene_.brightness(state_.photograph) * std::exp2(state_.exposure_stops);
  Display::Clear(window_.size());
  for (const Pane& pane : panes) {
    DisplaySettings settings;
    settings.picture_size_px = {camera.width, camera.height};
    settings.centre_px = pose_.centre_px;
    settings.scale = ScaleOf(pose_, camera, pane.size);
    settings.viewer_scale = brightness * scene_.exposure(state_.photograph);
    settings.photograph_scale = brightness;
    const std::vector<glm::dvec3>& columns = photo().rgb_from_sensor.columns;
    if (state_.true_colour && columns.size() == 3) settings.rgb_from_sensor = {columns[0], columns[1], columns[2]};
    display_.Draw(pane, window_.size(), canvas_.texture(), settings);
  }
}

void CrownWindow::SavePicture(const std::vector<Pane>& panes) {
  asked_.saves_picture = false;
  const glm::ivec2 corner = panes.front().corner, end = panes.back().corner + panes.back().size;
  Image linear = canvas_.InFull(View(panes));
  if (state_.mode != ViewMode::kThickness)
    for (float& v : linear.values) v *= static_cast<float>(scene_.exposure(state_.photograph));
  Say(SavePictures(options_.save_to, photo().name, window_.Read(corner, end - corner), linear));
}

void CrownWindow::SaveWindow() {
  asked_.saves_window = false;
  Say(SaveWindowPicture(options_.save_to, photo().name, window_.Read({0, 0}, window_.size())));
}

void CrownWindow::SaveSliders() {
  Say(SaveMaterial(options_.save_to, scene_.capture(), MaterialOf(state_.material, record_.material),
                   record_.linear_scales, options_.material_file));
}

/// After the frames that ImGui needs for its layout.
void CrownWindow::PrintLayout(const Layout& layout) {
  if (!options_.prints_layout || ++frames_ != kSettlingFrames) return;
  for (const LayoutItem& item : layout)
    std::printf("%s %.0f %.0f %.0f %.0f\n", item.name.c_str(), item.x, item.y, item.width, item.height);
  std::printf("end 0 0 0 0\n");
  std::fflush(stdout);
}

void CrownWindow::DrawFrame() {
  const bool may_save = !scene_.IsBusy();
  TellState();
  window_.Begin();
  Layout layout;
  const glm::ivec2 size = window_.size();
  const double unit = window_.pixels_per_unit();
  const auto width = static_cast<float>(size.x / unit), height = static_cast<float>(size.y / unit);
  const Rectangle view{0, 0, std::max(1.0f, width - PanelWidth()), height};
  const glm::ivec2 view_px(std::lround(view.width * unit), size.y);
  std::vector<Pane> panes = PanesOf(state_, {0, 0}, view_px);
  const ViewInput input = DrawViewArea(state_, view, panes, unit, layout);
  PanelAnswer answer = DrawPanel(state_, {view.width, 0, width - view.width, height}, layout);
  ApplyKeys(window_.TakeKeys(), state_, answer);
  DrawHelp(state_);
  const bool saves_picture = asked_.saves_picture && may_save, saves_window = asked_.saves_window && may_save;
  const bool accepted = Attempt([&] {
    Apply(input, answer);
    panes = PanesOf(state_, {0, 0}, view_px);
    const bool is_moving = state_.drag != Drag::kNone || input.wheel != 0 || material_is_held_;
    if (ShowsCrown() && canvas_.Draw(View(panes), is_moving, HasToSave()) && refused_) Say("");
  });
  refused_ = !accepted || (refused_ && !state_.message.empty());
  Attempt([&] { DrawPanes(panes); });
  if (answer.saves_material) Attempt([&] { SaveSliders(); });
  if (saves_picture) Attempt([&] { SavePicture(panes); });
  window_.DrawWidgets();
  if (saves_window) Attempt([&] { SaveWindow(); });
  PrintLayout(layout);
  window_.Show();
}

}  // namespace

void ViewInWindow(const Capture& stated, const MaterialRecord& record, const WindowOptions& options,
                  Progress& progress) {
  const Capture capture = ForScreen(WithLinearScales(stated, record.linear_scales));
  CheckShaderSupports(capture, record.material);
  const auto [width, height] = options.size.value_or(std::pair{1400, 900});
  Window window("crownfit view " + options.material_file.filename().string(), width, height);
  progress.Show("reading", 0.0);
  CrownInput input = ReadInput(capture, options.threads, /*with_images=*/false);
  progress.Show("building the layers", 0.3);
  auto crown = BuildCrown(capture, input.source, ThicknessesOf(capture, record.material), options.threads);
  progress.Clear();
  ViewScene scene(capture, record.material, std::move(input), std::move(crown), options.threads);
  CrownWindow view(window, scene, record, options);
  window.Appear();
  while (view.Step()) {
  }
}

}  // namespace crownfit
