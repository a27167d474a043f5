#include "viewer/view_area.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "viewer/thickness_view.h"

namespace crownfit {
namespace {

constexpr ImU32 kInk = IM_COL32(235, 235, 235, 255), kPaper = IM_COL32(20, 20, 22, 190);

ImU32 Colour(const glm::vec3& c) { return ImGui::ColorConvertFloat4ToU32({c.x, c.y, c.z, 1}); }

void Label(ImDrawList* draw, ImVec2 at, const std::string& text) {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  draw->AddRectFilled({at.x - 5, at.y - 3}, {at.x + size.x + 5, at.y + size.y + 3}, kPaper, 3);
  draw->AddText(at, kInk, text.c_str());
}

const char* NameOf(Source source) {
  switch (source) {
    case Source::kPhotograph:
      return "photograph";
    case Source::kMap:
      return "CIEDE2000";
    default:
      return "viewer";
  }
}

void DrawDifferenceLegend(ImDrawList* draw, const PanelState& state, ImVec2 foot) {
  const float line = 1.35f * ImGui::GetFontSize();
  float y = foot.y - line * static_cast<float>(state.difference_legend.size());
  draw->AddRectFilled({foot.x - 6, y - 6}, {foot.x + 14 * ImGui::GetFontSize(), foot.y + 2}, kPaper, 3);
  for (const LegendStep& step : state.difference_legend) {
    draw->AddRectFilled({foot.x, y}, {foot.x + 1.6f * line, y + line - 4}, Colour(step.colour));
    draw->AddText({foot.x + 1.6f * line + 8, y}, kInk, step.label.c_str());
    y += line;
  }
}

void DrawThicknessLegend(ImDrawList* draw, const PanelState& state, ImVec2 foot) {
  const float em = ImGui::GetFontSize(), width = 15 * em, bar = 0.8f * em;
  const ImVec2 corner{foot.x + em, foot.y - 1.6f * em - bar};
  draw->AddRectFilled({foot.x - 6, corner.y - 1.7f * em}, {corner.x + width + 5 * em, foot.y}, kPaper, 3);
  draw->AddText({corner.x, corner.y - 1.4f * em}, kInk, ("thickness of " + state.thickness_of + " in mm").c_str());
  const auto& colours = kThicknessColours;
  for (size_t i = 0; i + 1 < colours.size(); ++i) {
    const float step = width / static_cast<float>(colours.size() - 1), x = corner.x + step * static_cast<float>(i);
    const ImU32 a = Colour({colours[i][0], colours[i][1], colours[i][2]}),
                b = Colour({colours[i + 1][0], colours[i + 1][1], colours[i + 1][2]});
    draw->AddRectFilledMultiColor({x, corner.y}, {x + step, corner.y + bar}, a, b, b, a);
  }
  for (int tick = 0; tick <= 5; ++tick) {
    const std::string text = Printed(tick < 5 ? "%.3g" : "%.3g or more", 0.2 * tick * state.most_thickness_mm);
    const float x = corner.x + width * static_cast<float>(tick) / 5;
    draw->AddText({x - (tick < 5 ? 0.5f * ImGui::CalcTextSize(text.c_str()).x : 0.5f * em), corner.y + bar + 1}, kInk,
                  text.c_str());
  }
}

void DrawNotes(ImDrawList* draw, const PanelState& state, const std::vector<Pane>& panes, double pixels_per_unit) {
  const auto unit = [&](int pixels) { return static_cast<float>(pixels / pixels_per_unit); };
  for (const Pane& pane : panes) {
    const ImVec2 low{unit(pane.corner.x), unit(pane.corner.y)},
        high{low.x + unit(pane.size.x), low.y + unit(pane.size.y)};
    const float divider = low.x + pane.divider * (high.x - low.x);
    if (pane.divider > 0) {
      draw->AddLine({divider, low.y}, {divider, high.y}, kInk, 2);
      draw->AddCircleFilled({divider, 0.5f * (low.y + high.y)}, 7, kInk);
      Label(draw, {low.x + 12, low.y + 10}, NameOf(pane.left));
    }
    if (pane.right == Source::kAsItIs) {
      DrawThicknessLegend(draw, state, {low.x + 16, high.y - 12});
    } else {
      Label(draw, {(pane.divider > 0 ? divider : low.x) + 12, low.y + 10}, NameOf(pane.right));
    }
    if (pane.right != Source::kMap) continue;
    DrawDifferenceLegend(draw, state, {low.x + 16, high.y - 12});
    if (state.no_difference.empty()) continue;
    const float width = std::min(22 * ImGui::GetFontSize(), high.x - low.x - 30);
    const ImVec2 size = ImGui::CalcTextSize(state.no_difference.c_str(), nullptr, false, width);
    draw->AddText(nullptr, 0, {0.5f * (low.x + high.x - size.x), 0.5f * (low.y + high.y - size.y)}, kInk,
                  state.no_difference.c_str(), nullptr, width);
  }
}

Drag BegunDrag(const PanelState& state, const Rectangle& area) {
  const ImGuiIO& io = ImGui::GetIO();
  const float divider = area.x + state.divider * area.width;
  if (ImGui::IsMouseClicked(ImGuiMouseButton_Middle)) return Drag::kPan;
  if (ImGui::IsMouseClicked(ImGuiMouseButton_Right)) return Drag::kLamps;
  if (!ImGui::IsMouseClicked(ImGuiMouseButton_Left)) return state.drag;
  if (state.mode == ViewMode::kWipe && std::abs(io.MousePos.x - divider) < 9) return Drag::kDivider;
  return io.KeyShift ? Drag::kLamps : io.KeyCtrl ? Drag::kPan : Drag::kOrbit;
}

void ReadMouse(PanelState& state, const Rectangle& area, double pixels_per_unit, ViewInput& input) {
  const ImGuiIO& io = ImGui::GetIO();
  if (ImGui::IsItemHovered()) input.wheel = io.MouseWheel;
  if (ImGui::IsItemHovered() || ImGui::IsItemActive()) state.drag = BegunDrag(state, area);
  if (!ImGui::IsItemActive()) state.drag = Drag::kNone;
  // In the frame of a click the mouse delta includes the way to the click.
  const bool is_new = ImGui::IsMouseClicked(0) || ImGui::IsMouseClicked(1) || ImGui::IsMouseClicked(2);
  const glm::dvec2 moved = (is_new ? 0.0 : 1.0) * pixels_per_unit * glm::dvec2(io.MouseDelta.x, io.MouseDelta.y);
  if (state.drag == Drag::kOrbit) input.orbit = moved;
  if (state.drag == Drag::kPan) input.pan = moved;
  if (state.drag == Drag::kLamps) input.lamps = moved;
  if (state.drag == Drag::kDivider) state.divider = std::clamp((io.MousePos.x - area.x) / area.width, 0.02f, 0.98f);
  input.turns_lamps = state.drag == Drag::kLamps;
}

}  // namespace

std::vector<Pane> PanesOf(const PanelState& state, glm::ivec2 corner, glm::ivec2 size) {
  const auto whole = [&](Source source) { return Pane{corner, size, source, source, 0}; };
  switch (state.mode) {
    case ViewMode::kPhotograph:
      return {whole(Source::kPhotograph)};
    case ViewMode::kDifference:
      return {whole(Source::kMap)};
    case ViewMode::kThickness:
      return {whole(Source::kAsItIs)};
    case ViewMode::kWipe:
      return {{corner, size, Source::kPhotograph, Source::kViewer, state.divider}};
    case ViewMode::kSideBySide: {
      std::vector<Pane> panes;
      const int gap = 4, width = std::max(1, (size.x - 2 * gap) / 3);
      for (const Source source : {Source::kPhotograph, Source::kViewer, Source::kMap}) {
        const int x = corner.x + static_cast<int>(panes.size()) * (width + gap);
        panes.push_back({{x, corner.y}, {width, size.y}, source, source, 0});
      }
      return panes;
    }
    default:
      return {whole(Source::kViewer)};
  }
}

ViewInput DrawViewArea(PanelState& state, const Rectangle& area, const std::vector<Pane>& panes, double pixels_per_unit,
                       Layout& layout) {
  ViewInput input;
  ImGui::SetNextWindowPos({area.x, area.y});
  ImGui::SetNextWindowSize({area.width, area.height});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::Begin("crown", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBackground |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoScrollWithMouse);
  ImGui::InvisibleButton(
      "mouse", {area.width, area.height},
      ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight | ImGuiButtonFlags_MouseButtonMiddle);
  Note(layout, "crown");
  ReadMouse(state, area, pixels_per_unit, input);
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const glm::dvec2 at = pixels_per_unit * glm::dvec2(mouse.x, mouse.y);
  for (const Pane& pane : panes) {
    const glm::dvec2 within = at - glm::dvec2(pane.corner);
    if (&pane != &panes.front() && within.x < 0) continue;
    input.at = within;
    input.pane = pane.size;
  }
  DrawNotes(ImGui::GetWindowDrawList(), state, panes, pixels_per_unit);
  ImGui::End();
  ImGui::PopStyleVar();
  return input;
}

}  // namespace crownfit
