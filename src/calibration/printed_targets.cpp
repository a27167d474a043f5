#include "calibration/printed_targets.h"

#include <cmath>
#include <numbers>
#include <set>

#include "base/json_file.h"
#include "base/text.h"
#include "capture/rigid_transform.h"

namespace crownfit {
namespace {

std::vector<glm::dvec2> Rectangle(const glm::dvec2& low, const glm::dvec2& size) {
  return {low, low + glm::dvec2(size.x, 0), low + size, low + glm::dvec2(0, size.y)};
}

/// Squares of a marker whose black border starts at `at_mm`.
void AddMarker(const std::string& dictionary, int id, const glm::dvec2& at_mm, double size_mm, PrintedTarget& target) {
  const auto squares = MarkerSquares(dictionary, id);
  const double cell = size_mm / static_cast<double>(squares.size());
  target.patches.push_back({Rectangle(at_mm, glm::dvec2(size_mm)), 0.0});
  for (size_t y = 0; y < squares.size(); ++y)
    for (size_t x = 0; x < squares.size(); ++x)
      if (!squares[y][x]) target.patches.push_back({Rectangle(at_mm + cell * glm::dvec2(x, y), glm::dvec2(cell)), 1.0});
}

/// A square turned by 5 degrees: edges that cross pixel rows slowly, for sharpness.
void AddSlantedSquare(const glm::dvec2& centre_mm, double side_mm, PrintedTarget& target) {
  const double angle = 5.0 * std::numbers::pi / 180.0, h = 0.5 * side_mm;
  const glm::dvec2 u(h * std::cos(angle), h * std::sin(angle)), v(-u.y, u.x);
  target.patches.push_back({{centre_mm - u - v, centre_mm + u - v, centre_mm + u + v, centre_mm - u + v}, 0.0});
}

}  // namespace

PrintedTarget PrintedBoard(const Board& board) {
  const double s = board.square_mm;
  PrintedTarget target;
  const std::string dictionary = DictionaryNameOf(board);
  if (board.kind == BoardKind::kAprilTag) {
    const double step = TagStep_mm(board), gap = step - s;
    target.size_mm = step * glm::dvec2(board.columns, board.rows) - gap + 2.0 * s;
    for (int row = 0; row < board.rows; ++row)
      for (int column = 0; column < board.columns; ++column)
        AddMarker(dictionary, row * board.columns + column, glm::dvec2(s) + step * glm::dvec2(column, row), s, target);
  } else {
    const int columns = board.columns + 1, rows = board.rows + 1;
    target.size_mm = s * glm::dvec2(columns + 2, rows + 2);
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column)
        if (row % 2 == column % 2)
          target.patches.push_back({Rectangle(s * glm::dvec2(column + 1, row + 1), glm::dvec2(s)), 0.0});
    if (board.kind == BoardKind::kCharuco) {
      const double marker = CharucoMarker_mm(board);
      const auto squares = CharucoMarkers(board, true);
      for (size_t id = 0; id < squares.size(); ++id)
        AddMarker(dictionary, static_cast<int>(id), s * glm::dvec2(squares[id] + 1) + glm::dvec2(0.5 * (s - marker)),
                  marker, target);
    }
  }
  target.texts.push_back({{s, target.size_mm.y - 0.3 * s},
                          std::min(4.0, 0.4 * s),
                          Printed("%dx%d, %g mm: measure it", board.columns, board.rows, s)});
  return target;
}

Jig JigOf(const JigLayout& layout) {
  // Markers form a square ring, each with a marker's gap of white around it.
  Jig jig{layout.dictionary, {}, {}};
  const double m = layout.marker_mm, gap = 0.25 * m, radius = 0.5 * layout.inside_mm + gap + 0.5 * m;
  const int along = std::max(2, static_cast<int>(2.0 * radius / (m + gap)));
  const auto add = [&](const glm::dvec2& centre) {
    jig.ids.push_back(static_cast<int>(jig.ids.size()));
    const double h = 0.5 * m;
    jig.corners_mm.push_back({glm::dvec3(centre.x - h, centre.y - h, 0), glm::dvec3(centre.x + h, centre.y - h, 0),
                              glm::dvec3(centre.x + h, centre.y + h, 0), glm::dvec3(centre.x - h, centre.y + h, 0)});
  };
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < along; ++i) {
      const double t = -radius + 2.0 * radius * i / along;
      const glm::dvec2 on_top(t, -radius);
      const double c[] = {1, 0, -1, 0}, s[] = {0, 1, 0, -1};
      add({c[side] * on_top.x - s[side] * on_top.y, s[side] * on_top.x + c[side] * on_top.y});
    }
  return jig;
}

PrintedTarget PrintedJig(const JigLayout& layout) {
  const Jig jig = JigOf(layout);
  const double half = 0.5 * layout.inside_mm + 1.5 * layout.marker_mm + 0.5, strip = 16.0;
  PrintedTarget target;
  target.size_mm = {2 * half, 2 * half + strip};
  const glm::dvec2 middle(half, half);
  for (size_t m = 0; m < jig.ids.size(); ++m)
    AddMarker(jig.dictionary, jig.ids[m], middle + glm::dvec2(jig.corners_mm[m][0]), layout.marker_mm, target);
  target.cuts_mm.push_back(Rectangle(middle - glm::dvec2(0.5 * layout.inside_mm), glm::dvec2(layout.inside_mm)));
  target.cuts_mm.push_back(Rectangle({0, 0}, target.size_mm));
  // Below the ring: a scale bar of 20 mm, places for grey patches, a slanted edge.
  const double y = 2 * half + 1;
  for (int mm = 0; mm <= 20; ++mm)
    target.patches.push_back({Rectangle({2.0 + mm - 0.05, y}, {0.1, mm % 5 == 0 ? 3.0 : 1.5}), 0.0});
  target.texts.push_back({{2, y + 5}, 1.8, "20 mm: measure it"});
  const int places = std::min(3, static_cast<int>((target.size_mm.x - 14) / 7));
  for (int i = 0; i < places; ++i) target.cuts_mm.push_back(Rectangle({2.0 + 7 * i, y + 6.5}, {6, 6}));
  target.texts.push_back({{2, y + 14.5}, 1.8, "grey card here"});
  AddSlantedSquare({target.size_mm.x - 7, y + 8}, 8, target);
  return target;
}

JsonValue JigJson(const Jig& jig) {
  JsonValue::Array markers;
  for (size_t m = 0; m < jig.ids.size(); ++m) {
    JsonValue::Array corners;
    for (const auto& c : jig.corners_mm[m]) corners.emplace_back(std::vector<double>{c.x, c.y, c.z});
    markers.emplace_back(JsonValue::Object{{"id", jig.ids[m]}, {"corners_mm", corners}});
  }
  return JsonValue::Object{{"format", "crownfit-jig/1"}, {"dictionary", jig.dictionary}, {"markers", markers}};
}

Jig ReadJig(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat("crownfit-jig/1", {"dictionary", "markers"});
  Jig jig{root.Require("dictionary").String(), {}, {}};
  std::set<int> seen;
  for (const JsonNode& node : root.Require("markers").Items()) {
    const JsonObject marker(node, {"id", "corners_mm"});
    const int id = marker.Require("id").Integer(0, 100000);
    if (!seen.insert(id).second)
      marker.Require("id").Fail("marker " + std::to_string(id) + " occurs twice", "List each marker once.");
    jig.ids.push_back(id);
    const auto corners = marker.Require("corners_mm").Items();
    if (corners.size() != 4)
      marker.Require("corners_mm").Fail("expected four corners, clockwise from the top left one");
    jig.corners_mm.emplace_back();
    for (size_t k = 0; k < 4; ++k) jig.corners_mm.back()[k] = ReadVector(corners[k]);
  }
  return jig;
}

std::string SvgText(const PrintedTarget& target) {
  std::string svg = Printed(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%gmm\" height=\"%gmm\" viewBox=\"0 0 %g %g\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      target.size_mm.x, target.size_mm.y, target.size_mm.x, target.size_mm.y);
  const auto points = [&](const std::vector<glm::dvec2>& outline) {
    std::string list;
    for (const auto& p : outline) list += Printed("%s%.6g,%.6g", list.empty() ? "" : " ", p.x, p.y);
    return list;
  };
  for (const Patch& patch : target.patches) {
    const int level = static_cast<int>(std::lround(255 * patch.grey));
    svg +=
        "<polygon points=\"" + points(patch.outline_mm) + Printed("\" fill=\"#%02x%02x%02x\"/>\n", level, level, level);
  }
  for (const auto& cut : target.cuts_mm)
    svg += "<polygon points=\"" + points(cut) + "\" fill=\"none\" stroke=\"#999\" stroke-width=\"0.1\"/>\n";
  for (const PrintedText& line : target.texts) {
    svg += Printed("<text x=\"%g\" y=\"%g\" font-family=\"sans-serif\" font-size=\"%g\">", line.at_mm.x, line.at_mm.y,
                   line.size_mm);
    svg += line.text + "</text>\n";
  }
  return svg + "</svg>\n";
}

}  // namespace crownfit
