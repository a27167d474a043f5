#include "viewer/sliders.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"

namespace crownfit {
namespace {

constexpr double kReach = 20.0;  // range of a logarithmic slider up and down from the fitted value, as a factor
constexpr float kChannel_em = 1.6f, kSlider_em = 10.5f, kValue_em = 5.6f;  // column widths, in font heights
const ImVec4 kDim{0.62f, 0.62f, 0.65f, 1}, kWarning{0.95f, 0.70f, 0.30f, 1};
constexpr ImU32 kIntervalColour = IM_COL32(120, 200, 120, 230), kFittedColour = IM_COL32(235, 235, 235, 255);

/// The slider's scale: maps values to positions in [0, 1].
struct SliderScale {
  double low, high;
  bool is_log;
  float Place(double value) const {
    const double t =
        is_log ? std::log(std::max(value, low) / low) / std::log(high / low) : (value - low) / (high - low);
    return static_cast<float>(std::clamp(t, 0.0, 1.0));
  }
  double Value(float place) const {
    return is_log ? low * std::pow(high / low, static_cast<double>(place)) : low + place * (high - low);
  }
};

SliderScale ScaleOf(const SliderNumber& number, const ParameterRow& row) {
  SliderScale scale{row.low, row.high, row.scale == Scale::kLog};
  if (!scale.is_log || number.fitted <= 0) return scale;
  const auto interval = number.interval95.value_or(std::array<double, 2>{number.fitted, number.fitted});
  scale.low = std::max(row.low, std::min(number.fitted / kReach, interval[0]));
  scale.high = std::min(row.high, std::max(number.fitted * kReach, interval[1]));
  return scale;
}

/// Draws the interval as a bar under the knob's track, and the fitted value as a tick.
void MarkInterval(const SliderNumber& number, const SliderScale& scale) {
  const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
  const float inset = 2 + 0.5f * ImGui::GetStyle().GrabMinSize;  // ImGui keeps the knob inside the frame
  const auto x = [&](double value) { return low.x + inset + scale.Place(value) * (high.x - low.x - 2 * inset); };
  ImDrawList* draw = ImGui::GetWindowDrawList();
  if (number.interval95)
    draw->AddRectFilled({x((*number.interval95)[0]), high.y - 4}, {x((*number.interval95)[1]) + 1, high.y - 1},
                        kIntervalColour);
  const float fitted = x(number.fitted);
  draw->AddLine({fitted, high.y - 6}, {fitted, high.y}, kFittedColour, 1.5f);
}

/// Right click opens an input field.
bool TypeNumber(SliderNumber& number, const ParameterRow& row) {
  if (!ImGui::BeginPopupContextItem()) return false;
  double typed = number.value;
  ImGui::SetNextItemWidth(8 * ImGui::GetFontSize());
  if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
  const bool entered = ImGui::InputDouble(row.unit, &typed, 0, 0, "%.6g", ImGuiInputTextFlags_EnterReturnsTrue);
  if (entered) {
    number.value = std::clamp(typed, row.low, row.high);
    ImGui::CloseCurrentPopup();
  }
  ImGui::EndPopup();
  return entered;
}

void DrawNumber(SliderNumber& number, const ParameterRow& row, PanelAnswer& answer) {
  const SliderScale scale = ScaleOf(number, row);
  float place = scale.Place(number.value);
  ImGui::SetNextItemWidth(kSlider_em * ImGui::GetFontSize());
  // The slider holds a position and not the value, so its own text input is off.
  if (ImGui::SliderFloat("##place", &place, 0, 1, "", ImGuiSliderFlags_NoInput)) {
    number.value = scale.Value(place);
    answer.material_moved = true;
  }
  if (ImGui::IsItemDeactivatedAfterEdit()) answer.material_released = true;
  MarkInterval(number, scale);
  if (TypeNumber(number, row)) answer.material_moved = answer.material_released = true;
}

void DrawStatus(const SliderParameter& parameter) {
  if (parameter.status.empty()) return;
  const bool is_weak = parameter.status != "fitted" && parameter.status != "fixed";
  ImGui::SameLine();
  ImGui::TextColored(is_weak ? kWarning : kDim, "%s", parameter.status.c_str());
}

bool EndButton(const char* label, bool is_possible) {
  ImGui::BeginDisabled(!is_possible);
  const bool pressed = ImGui::SmallButton(label);
  ImGui::EndDisabled();
  return pressed;
}

/// Buttons low, best, high at the right end of the line.
std::optional<End> EndButtons(bool has_interval, bool has_moved) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float width = ImGui::CalcTextSize("lowbesthigh").x + 6 * style.FramePadding.x + 2 * style.ItemSpacing.x;
  ImGui::SameLine(ImGui::GetContentRegionMax().x - width - style.ItemSpacing.x);
  std::optional<End> end;
  if (EndButton("low", has_interval)) end = End::kLow;
  ImGui::SameLine();
  if (EndButton("best", has_moved)) end = End::kBest;
  ImGui::SameLine();
  if (EndButton("high", has_interval)) end = End::kHigh;
  return end;
}

bool HasInterval(const SliderParameter& parameter) {
  return std::any_of(parameter.numbers.begin(), parameter.numbers.end(),
                     [](const SliderNumber& n) { return n.interval95.has_value(); });
}

bool HasMoved(const SliderParameter& parameter) {
  return std::any_of(parameter.numbers.begin(), parameter.numbers.end(),
                     [](const SliderNumber& n) { return n.value != n.fitted; });
}

void DrawParameter(const std::string& group, SliderParameter& parameter, const PanelState& state, PanelAnswer& answer,
                   Layout& layout) {
  const ParameterRow& row = RowOf(parameter.quantity);
  ImGui::PushID(row.key);
  ImGui::TextUnformatted(row.key);
  DrawStatus(parameter);
  if (const auto end = EndButtons(HasInterval(parameter), HasMoved(parameter))) {
    GoTo(*end, parameter);
    answer.material_moved = answer.material_released = true;
  }
  ImGui::BeginDisabled(!parameter.idle.empty());
  for (size_t c = 0; c < parameter.numbers.size(); ++c) {
    SliderNumber& number = parameter.numbers[c];
    ImGui::PushID(static_cast<int>(c));
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(kDim, "%s", parameter.numbers.size() > 1 ? state.channels[c].c_str() : "");
    ImGui::SameLine(kChannel_em * ImGui::GetFontSize());
    DrawNumber(number, row, answer);
    Note(layout, group + "." + row.key + (parameter.numbers.size() > 1 ? "." + state.channels[c] : ""));
    ImGui::SameLine();
    ImGui::TextUnformatted(Printed("%.4g", number.value).c_str());
    if (number.interval95) {
      ImGui::SameLine((kChannel_em + kSlider_em + kValue_em) * ImGui::GetFontSize());
      ImGui::TextColored(kDim, "%s", Printed("%.3g to %.3g", (*number.interval95)[0], (*number.interval95)[1]).c_str());
    }
    ImGui::PopID();
  }
  if (!parameter.idle.empty()) {
    ImGui::SameLine((kChannel_em + kSlider_em + kValue_em) * ImGui::GetFontSize());
    ImGui::TextDisabled("%s", parameter.idle.c_str());
  }
  ImGui::EndDisabled();
  ImGui::PopID();
}

void DrawAll(std::vector<SliderGroup>& groups, End end, const char* label, PanelAnswer& answer, Layout& layout) {
  const bool pressed = ImGui::Button(label);
  Note(layout, std::string("all.") + (end == End::kLow ? "low" : end == End::kBest ? "best" : "high"));
  if (!pressed) return;
  for (SliderGroup& group : groups)
    for (SliderParameter& parameter : group.parameters) GoTo(end, parameter);
  answer.material_moved = answer.material_released = true;
}

}  // namespace

void GoTo(End end, SliderParameter& parameter) {
  for (SliderNumber& number : parameter.numbers) {
    number.value = number.fitted;
    if (end != End::kBest && number.interval95) number.value = (*number.interval95)[end == End::kLow ? 0 : 1];
  }
}

void DrawSliders(PanelState& state, PanelAnswer& answer, Layout& layout) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted("all:");
  ImGui::SameLine();
  DrawAll(state.material, End::kLow, "low end", answer, layout);
  ImGui::SameLine();
  DrawAll(state.material, End::kBest, "reset to fit", answer, layout);
  ImGui::SameLine();
  DrawAll(state.material, End::kHigh, "high end", answer, layout);
  ImGui::BeginChild("sliders");
  for (SliderGroup& group : state.material) {
    if (!ImGui::CollapsingHeader(group.name.c_str(), ImGuiTreeNodeFlags_DefaultOpen)) continue;
    ImGui::PushID(group.name.c_str());
    for (SliderParameter& parameter : group.parameters) DrawParameter(group.name, parameter, state, answer, layout);
    ImGui::PopID();
  }
  ImGui::EndChild();
}

}  // namespace crownfit
