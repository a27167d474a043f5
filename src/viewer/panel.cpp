#include "viewer/panel.h"

#include <imgui.h>

#include <algorithm>

#include "viewer/sliders.h"
#include "viewer/window.h"

namespace crownfit {
namespace {

struct Shortcut {
  const char *keys, *does;
};
constexpr Shortcut kShortcuts[] = {{"left drag", "turn the crown"},
                                   {"right drag, Shift + left drag", "turn the lamps about the crown"},
                                   {"middle drag, Ctrl + left drag", "move the picture"},
                                   {"wheel", "zoom at the pointer"},
                                   {"R, Home", "back to the photograph's camera and lamps"},
                                   {"1 to 9", "photograph"},
                                   {"V", "next view"},
                                   {"T", "true colour on or off"},
                                   {"+, -", "half a stop brighter, darker"},
                                   {"right click on a slider", "type a number"},
                                   {"S", "save the picture: .png as shown, .exr linear"},
                                   {"P", "save the whole window as .png"},
                                   {"M", "save the material as it stands"},
                                   {"F1, ?", "this list"},
                                   {"Q, Esc", "close"}};

const ImVec4 kDim{0.62f, 0.62f, 0.65f, 1}, kBad{1.0f, 0.48f, 0.42f, 1}, kGood{0.62f, 0.86f, 0.62f, 1};

bool NeedsPhotograph(ViewMode mode) {
  return mode == ViewMode::kPhotograph || mode == ViewMode::kDifference || mode == ViewMode::kSideBySide ||
         mode == ViewMode::kWipe;
}

void DrawChoices(PanelState& state, PanelAnswer& answer, Layout& layout) {
  const float width = -6.5f * ImGui::GetFontSize();
  ImGui::SetNextItemWidth(width);
  if (ImGui::BeginCombo("photograph", state.photographs[state.photograph].c_str())) {
    for (size_t i = 0; i < state.photographs.size(); ++i)
      if (ImGui::Selectable(state.photographs[i].c_str(), i == state.photograph)) state.photograph = i;
    ImGui::EndCombo();
  }
  Note(layout, "photograph");
  ImGui::SetNextItemWidth(width);
  const bool is_open = ImGui::BeginCombo("view", kViewModes[static_cast<size_t>(state.mode)]);
  Note(layout, "view");
  if (is_open) {
    for (size_t i = 0; i < kViewModes.size(); ++i) {
      const auto mode = static_cast<ViewMode>(i);
      const bool is_closed = NeedsPhotograph(mode) && !state.no_photograph.empty();
      if (ImGui::Selectable(kViewModes[i], mode == state.mode, is_closed ? ImGuiSelectableFlags_Disabled : 0))
        state.mode = mode;
    }
    ImGui::EndCombo();
  }
  ImGui::SetNextItemWidth(width);
  ImGui::SliderFloat("##exposure", &state.exposure_stops, -4, 4, "");
  Note(layout, "exposure");
  ImGui::SameLine(0, ImGui::GetStyle().ItemInnerSpacing.x);
  ImGui::Text("%+.1f stops", state.exposure_stops);
  ImGui::Checkbox("true colour", &state.true_colour);
  Note(layout, "true_colour");
  ImGui::SameLine();
  if (ImGui::Button("photograph's camera (R)")) answer.goes_home = true;
  Note(layout, "home");
  ImGui::Checkbox("diffuse", &state.terms.diffuse);
  Note(layout, "diffuse");
  ImGui::SameLine();
  ImGui::Checkbox("first order", &state.terms.first_order);
  Note(layout, "first_order");
  ImGui::SameLine();
  ImGui::Checkbox("gloss", &state.terms.gloss);
  Note(layout, "gloss");
  ImGui::Checkbox("tile and scenery", &state.terms.scenery);
  Note(layout, "scenery");
}

void DrawSaving(PanelState& state, PanelAnswer& answer, Layout& layout) {
  if (ImGui::Button("save picture")) answer.saves_picture = true;
  Note(layout, "save_picture");
  ImGui::SameLine();
  if (ImGui::Button("save material")) answer.saves_material = true;
  Note(layout, "save_material");
  ImGui::SameLine();
  if (ImGui::Button("help")) state.shows_help = !state.shows_help;
  Note(layout, "help");
}

void DrawSaid(const PanelState& state, float height) {
  ImGui::BeginChild("said", {0, height});
  ImGui::PushTextWrapPos(0);
  if (!state.difference.empty()) ImGui::TextUnformatted(state.difference.c_str());
  if (!state.no_photograph.empty()) ImGui::TextColored(kDim, "%s", state.no_photograph.c_str());
  if (!state.busy.empty()) ImGui::TextColored(kDim, "%s ...", state.busy.c_str());
  if (!state.message.empty()) ImGui::TextColored(state.message_is_error ? kBad : kGood, "%s", state.message.c_str());
  ImGui::TextColored(kDim, "%s", state.about.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndChild();
}

}  // namespace

void Note(Layout& layout, const std::string& name) {
  const ImVec2 low = ImGui::GetItemRectMin(), size = ImGui::GetItemRectSize();
  LayoutItem item{name, low.x, low.y, size.x, size.y};
  std::replace(item.name.begin(), item.name.end(), ' ', '_');
  layout.push_back(item);
}

float PanelWidth() { return 28 * ImGui::GetFontSize(); }

PanelAnswer DrawPanel(PanelState& state, const Rectangle& area, Layout& layout) {
  PanelAnswer answer;
  ImGui::SetNextWindowPos({area.x, area.y});
  ImGui::SetNextWindowSize({area.width, area.height});
  ImGui::Begin("panel", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
  const float said_height = 7.5f * ImGui::GetTextLineHeightWithSpacing();
  DrawChoices(state, answer, layout);
  DrawSaving(state, answer, layout);
  ImGui::Separator();
  ImGui::BeginChild("material", {0, -said_height - ImGui::GetStyle().ItemSpacing.y});
  DrawSliders(state, answer, layout);
  ImGui::EndChild();
  ImGui::Separator();
  DrawSaid(state, said_height - 2 * ImGui::GetStyle().ItemSpacing.y);
  ImGui::End();
  return answer;
}

void ApplyKeys(const std::vector<unsigned>& keys, PanelState& state, PanelAnswer& answer) {
  for (const unsigned key : keys) {
    const unsigned lower = key >= 'A' && key <= 'Z' ? key + ('a' - 'A') : key;
    if (key >= '1' && key <= '9' && key - '1' < state.photographs.size()) state.photograph = key - '1';
    if (key == kKeyF1 || key == '?') state.shows_help = !state.shows_help;
    if (lower == 'q' || key == kKeyEscape) answer.closes = true;
    if (lower == 'r' || key == kKeyHome) answer.goes_home = true;
    if (lower == 's') answer.saves_picture = true;
    if (lower == 'p') answer.saves_window = true;
    if (lower == 'm') answer.saves_material = true;
    if (lower == 't') state.true_colour = !state.true_colour;
    if (key == '+') state.exposure_stops = std::min(4.0f, state.exposure_stops + 0.5f);
    if (key == '-') state.exposure_stops = std::max(-4.0f, state.exposure_stops - 0.5f);
    if (lower == 'v') {
      auto next = static_cast<size_t>(state.mode);
      do next = (next + 1) % kViewModes.size();
      while (NeedsPhotograph(static_cast<ViewMode>(next)) && !state.no_photograph.empty());
      state.mode = static_cast<ViewMode>(next);
    }
  }
}

void DrawHelp(PanelState& state) {
  if (!state.shows_help) return;
  ImGui::SetNextWindowPos({40, 40}, ImGuiCond_Appearing);
  if (ImGui::Begin("Shortcuts", &state.shows_help, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse) &&
      ImGui::BeginTable("shortcuts", 2, ImGuiTableFlags_SizingFixedFit)) {
    for (const Shortcut& shortcut : kShortcuts) {
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(shortcut.keys);
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(shortcut.does);
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

}  // namespace crownfit
