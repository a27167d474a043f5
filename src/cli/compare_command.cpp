#include <cstdio>

#include "base/error.h"
#include "base/json_file.h"
#include "base/text.h"
#include "cli/common_options.h"
#include "photo/colour_difference.h"
#include "photo/figures.h"
#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

struct CompareCommand {
  std::filesystem::path image_a, image_b, mask, output;  ///< mask, output: empty: none
  std::string encoding = "file";                         ///< of both pictures
  bool json = false;
};

/// `name value unit` lines for people, or one JSON object.
class Figures {
 public:
  void Add(const std::string& name, double value, const std::string& unit) {
    json_.emplace_back(name, value);
    lines_ += Printed("%s %.6g %s\n", name.c_str(), value, unit.c_str());
  }
  void Print(bool json) const { std::fputs(json ? ToJsonText(JsonValue(json_)).c_str() : lines_.c_str(), stdout); }

 private:
  JsonValue::Object json_;
  std::string lines_;
};

int RunCompare(const CompareCommand& asked) {
  PhotographFiles a, b;
  a.image = asked.image_a;
  b.image = asked.image_b;
  if (!asked.mask.empty()) a.mask = asked.mask;
  a.encoding = b.encoding = Encoding::Named(asked.encoding, "--encoding");
  a.encoding_key = b.encoding_key = "--encoding";
  const Photograph first = ReadPhotograph(a), second = ReadPhotograph(b);
  if (first.linear.width != second.linear.width || first.linear.height != second.linear.height)
    throw InputError(asked.image_b, "", "has another size than " + asked.image_a.filename().string());
  std::vector<uint8_t> mask(first.usable.size());
  for (size_t i = 0; i < mask.size(); ++i) {
    const auto lit = [&](const Image& image) {
      return image.values[3 * i] + image.values[3 * i + 1] + image.values[3 * i + 2] > 0;
    };
    mask[i] = first.usable[i] && (first.has_mask || lit(first.linear) || lit(second.linear));
  }
  const ColourDifference d = ComparePictures(first.linear, second.linear, mask);
  if (d.pixels == 0) throw InputError(asked.image_a, "", "there is no pixel to compare", "Check the mask.");
  if (!asked.output.empty()) WriteImageFile(asked.output, DifferenceFigure(d));
  Figures figures;
  figures.Add("de00_median", d.median, "dE00");
  figures.Add("de00_p95", d.p95, "dE00");
  figures.Add("de00_mean", d.mean, "dE00");
  figures.Add("share_below_pt", d.share_below_pt, "1");
  figures.Add("share_below_at", d.share_below_at, "1");
  figures.Add("de00_median_pixel", d.pixel_median, "dE00");
  figures.Add("de00_p95_pixel", d.pixel_p95, "dE00");
  figures.Add("pixels", static_cast<double>(d.pixels), "1");
  figures.Print(asked.json);
  return 0;
}

}  // namespace

void AddCompare(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<CompareCommand>();
  auto* compare = app.add_subcommand(
      "compare", "Measures CIEDE2000 (D65, 2 degrees) between two linear pictures, over blocks of 8 x 8 pixels.");
  compare->footer(
      "Prints median, 95th percentile and mean, and the shares below 0.8 (not seen) and 1.8 (accepted).\n\n"
      "Example:\n"
      "  crownfit compare crown/photos/front.exr pictures/front.exr -o difference.png");
  compare->add_option("IMAGE_A", asked->image_a, "The photograph. It sets the brightness of both.")->required();
  compare->add_option("IMAGE_B", asked->image_b, "The picture to compare with it.")->required();
  compare->add_option("--mask", asked->mask, "Compare only where this picture is above 0.5.");
  compare->add_option("-o,--output", asked->output, "PNG map of the differences.");
  AddEncodingOptions(compare, asked->encoding);
  compare->add_flag("--json", asked->json, "Print the figures as JSON.");
  RunWith(compare, command, asked, RunCompare);
}

}  // namespace crownfit
