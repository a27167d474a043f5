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
  bool is_linear = false;
};

/// The part of a picture from (x, y) on.
Image Part(const Image& image, int x0, int y0, int width, int height) {
  Image part(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c) part.at(x, y, c) = image.at(x0 + x, y0 + y, c);
  return part;
}

int RunBlur(const BlurTask& asked) {
  if (asked.images.size() != 1) throw InputError("", "IMAGES", "blur is measured in one photograph at a time");
  ImageFile photo = ReadLinear(asked.images, asked.is_linear)[0];
  BlurInput input;
  input.dark_reflectance = asked.dark_reflectance;
  input.light_reflectance = asked.light_reflectance;
  input.saturation = RemoveBlack(photo.image, asked.noise);
  photo.is_srgb_encoded = false;
  ImageFile searched = photo;
  glm::dvec2 corner(0.0);
  if (const auto& region = asked.region; !region.empty()) {
    const bool inside = region[0] >= 0 && region[1] >= 0 && region[2] >= 30 && region[3] >= 30 &&
                        region[0] + region[2] <= photo.image.width && region[1] + region[3] <= photo.image.height;
    if (!inside) throw InputError(asked.images[0], "--region", "is not inside the picture, or under 30 px wide");
    corner = {std::floor(region[0]), std::floor(region[1])};
    searched.image = Part(photo.image, static_cast<int>(corner.x), static_cast<int>(corner.y),
                          static_cast<int>(region[2]), static_cast<int>(region[3]));
  }
  input.edges = FindSlantedSquare(searched);
  for (Edge& edge : input.edges) edge = {edge.from + corner, edge.to + corner};
  if (input.edges.empty())
    throw InputError(
        asked.images[0], "", "shows no dark square on white that is slanted against the pixels",
        "Print `crownfit calibrate target jig`; its square is slanted by 5 degrees when the print lies straight. "
        "Give --region where other things in the picture are dark too.");
  return Finish(BlurProduct(photo.image, input), asked.images, asked.product);
}

}  // namespace

void AddCalibrateBlur(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<BlurTask>();
  auto* blur =
      AddProduct(&calibrate, asked->product, "blur",
                 "Point spread and veiling glare from a photograph of a slanted dark square (`calibrate target jig`).");
  AddImages(blur, asked->images,
            "One photograph, focused as for the crown, paper at half of saturation. RAW or linear.");
  blur->add_option("--region", asked->region, "X,Y,WIDTH,HEIGHT in pixels, where the square is (default: anywhere).")
      ->expected(4)
      ->delimiter(',');
  blur->add_option("--dark-reflectance", asked->dark_reflectance,
                   "Of the square, for the veiling glare: 0.03 to 0.05 for ink, 0 for a hole into a dark box.")
      ->check(CLI::Range(0.0, 0.5));
  blur->add_option("--light-reflectance", asked->light_reflectance, "Of the paper (default 0.9).")
      ->check(CLI::Range(0.1, 1.0));
  blur->add_option("--noise", asked->noise, "noise.json of the camera: black level and saturation.");
  blur->add_flag("--linear", asked->is_linear, "Take the file as linear.");
  RunWith(blur, command, asked, RunBlur);
}

}  // namespace crownfit
