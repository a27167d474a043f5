#include <cmath>

#include "base/error.h"
#include "calibration/estimate_blur.h"
#include "cli/calibrate_parts.h"

namespace crownfit {
namespace {

struct BlurTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images;
  std::vector<double> region;  ///< x, y, width, height in pixels; empty: anywhere
  std::optional<double> dark_reflectance, light_reflectance;
  std::optional<std::filesystem::path> noise;
  std::string encoding = "file";
};

/// The part of a picture that starts at (x, y).
Image Part(const Image& image, int x0, int y0, int width, int height) {
  Image part(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c) part.at(x, y, c) = image.at(x0 + x, y0 + y, c);
  return part;
}

int RunBlur(const BlurTask& asked) {
  if (asked.images.size() != 1) throw InputError("", "IMAGES", "blur is measured from one photograph");
  ImageFile photo = ReadLinear(asked.images, asked.encoding)[0];
  BlurInput input;
  input.dark_reflectance = asked.dark_reflectance;
  input.light_reflectance = asked.light_reflectance;
  input.saturation = RemoveBlack(photo, asked.images[0], asked.noise);
  ImageFile searched = photo;
  glm::dvec2 corner(0.0);
  if (const auto& region = asked.region; !region.empty()) {
    const bool inside = region[0] >= 0 && region[1] >= 0 && region[2] >= 30 && region[3] >= 30 &&
                        region[0] + region[2] <= photo.image.width && region[1] + region[3] <= photo.image.height;
    if (!inside)
      throw InputError(asked.images[0], "--region", "lies outside of the picture, or is less than 30 px wide or high");
    corner = {std::floor(region[0]), std::floor(region[1])};
    searched.image = Part(photo.image, static_cast<int>(corner.x), static_cast<int>(corner.y),
                          static_cast<int>(region[2]), static_cast<int>(region[3]));
  }
  input.edges = FindSlantedSquare(searched);
  for (Edge& edge : input.edges) edge = {edge.from + corner, edge.to + corner};
  if (input.edges.empty())
    throw InputError(asked.images[0], "", "shows no dark square on white that is slanted against the pixel grid",
                     "Print `crownfit calibrate target jig` and lay it straight: its square is slanted by 5 degrees. "
                     "If other things in the picture are dark too, give --region.");
  return Finish(BlurProduct(photo.image, input), asked.images, asked.product);
}

}  // namespace

void AddCalibrateBlur(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<BlurTask>();
  auto* blur = AddProduct(&calibrate, asked->product, "blur",
                          "Measures point spread and veiling glare from a photograph of a slanted dark square.");
  blur->footer(
      "The jig of `crownfit calibrate target jig` has such a square.\n\n"
      "Example:\n"
      "  crownfit calibrate blur jig.dng --dark-reflectance 0.04 --noise noise.json -o blur.json\n"
      "Prints sigma and its standard deviation in pixels, and veiling_glare as a share of all light.");
  AddImages(blur, asked->images,
            "One photograph, RAW or linear, focused as for the crown. Expose the paper to half of\n"
            "saturation.");
  blur->add_option("--region", asked->region,
                   "X,Y,WIDTH,HEIGHT in pixels: where to look for the square (default: anywhere).")
      ->expected(4)
      ->delimiter(',');
  blur->add_option("--dark-reflectance", asked->dark_reflectance,
                   "Reflectance of the square, which the veiling glare needs: 0.03 to 0.05 for ink, 0 for a hole\n"
                   "into a dark box.")
      ->check(CLI::Range(0.0, 0.5));
  blur->add_option("--light-reflectance", asked->light_reflectance, "Reflectance of the paper (default 0.9).")
      ->check(CLI::Range(0.1, 1.0));
  blur->add_option("--noise", asked->noise, "noise.json of the camera, for black level and saturation.");
  AddEncodingOptions(blur, asked->encoding);
  RunWith(blur, command, asked, RunBlur);
}

}  // namespace crownfit
