#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <string_view>

#include "base/error.h"
#include "base/files.h"
#include "base/html.h"
#include "base/json_file.h"
#include "report/page_text.h"
#include "report/report_files.h"

namespace crownfit {
namespace {

std::string Bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw InputError(file, "", "the result has no such file, or it can't be read",
                     "Make the result again with crownfit fit, which writes all files that the page needs.");
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// RFC 4648.
std::string Base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t j = i; j < i + 3; ++j) three = three << 8 | (j < bytes.size() ? static_cast<uint8_t>(bytes[j]) : 0u);
    for (size_t j = 0; j < 4; ++j) text += i + j <= bytes.size() ? kDigits[three >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

/// JSON that is safe between <script> tags.
std::string InScript(const JsonValue& value) {
  std::string text;
  for (const char c : ToJsonText(value)) text += c == '<' ? "\\u003c" : std::string(1, c);
  return text;
}

/// The page with every {{name}} replaced.
std::string Filled(std::string_view page, const std::map<std::string_view, std::string_view>& texts) {
  std::string filled;
  while (true) {
    const size_t open = page.find("{{");
    filled += page.substr(0, open);
    if (open == page.npos) return filled;
    const size_t close = page.find("}}", open);
    filled += texts.at(page.substr(open + 2, close - open - 2));
    page.remove_prefix(close + 2);
  }
}

/// Every picture that report.json names, as a data URI.
JsonValue Pictures(const std::filesystem::path& folder, const JsonObject& report) {
  JsonValue::Object pictures;
  for (const JsonNode& photograph : report.Require("photographs").Items())
    for (const auto& [what, node] : photograph.Members()) {
      if (what != "pictures") continue;
      for (const auto& [kind, file] : node.Members()) {
        if (file.IsNumber()) continue;  // width, height
        const std::filesystem::path name = file.String();
        if (name.empty() || name.is_absolute() || name.lexically_normal() != name || *name.begin() == "..")
          file.Fail("a picture lies outside the result folder", "Make the result again with crownfit fit.");
        const std::string type = name.extension() == ".jpg" ? "jpeg" : "png";
        pictures.emplace_back(name.string(), "data:image/" + type + ";base64," + Base64(Bytes(folder / name)));
      }
    }
  return pictures;
}

}  // namespace

std::filesystem::path WriteReportPage(const std::filesystem::path& folder) {
  const JsonFile material(folder / "material.json", Bytes(folder / "material.json")),
      run(folder / "run.json", Bytes(folder / "run.json")),
      report(folder / "report.json", Bytes(folder / "report.json"));
  const JsonObject root = report.RootOfFormat(
      "crownfit-report/1", {"title", "headline", "sentences", "photographs_that_would_help", "photographs",
                            "difference_legend", "entries", "profiles", "convergence"});
  // Results of earlier versions have none.
  const auto elsewhere = folder / "prediction.json";
  JsonValue prediction;
  if (std::filesystem::exists(elsewhere)) {
    const JsonFile file(elsewhere, Bytes(elsewhere));
    file.RootOfFormat("crownfit-prediction/1", {"assumptions", "groups", "nearest_tabs", "missing"});
    prediction = file.value;
  }
  const std::string title = Html(root.Require("title").String());
  // For readers that run no scripts, such as mail previews: the main result is in the page itself.
  std::string plain = "<p><strong>" + Html(root.Require("headline").String()) + "</strong></p>\n";
  for (const JsonNode& sentence : root.Require("sentences").Items())
    plain += "<p>" + Html(sentence.String()) + "</p>\n";
  const std::string data = InScript(JsonValue::Object{{"material", material.value},
                                                      {"run", run.value},
                                                      {"report", report.value},
                                                      {"prediction", prediction},
                                                      {"pictures", Pictures(folder, root)}});
  const auto file = folder / "report.html";
  WriteTextFile(file, Filled(PageText("report.html"), {{"title", title},
                                                       {"plain", plain},
                                                       {"style", PageText("report.css")},
                                                       {"charts", PageText("chart.min.js")},
                                                       {"script", PageText("report.js")},
                                                       {"data", data}}));
  return file;
}

}  // namespace crownfit
