#include <map>

#include "base/error.h"
#include "base/progress.h"
#include "calibration/estimate_camera.h"
#include "cli/calibrate_parts.h"

namespace crownfit {
namespace {

struct CameraTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images;
  BoardOptions board;
  std::string distortion;  ///< empty: as many coefficients as the corners determine
};

int RunCamera(const CameraTask& asked) {
  const Board board = BoardOf(asked.board);
  const std::map<std::string, std::optional<Distortion>> models{{"", {}},
                                                                {"none", Distortion::kNone},
                                                                {"radial1", Distortion::kRadial1},
                                                                {"radial2", Distortion::kRadial2},
                                                                {"radial2_tangential", Distortion::kRadial2Tangential},
                                                                {"full", Distortion::kFull}};
  const auto model = models.find(asked.distortion);
  if (model == models.end())
    throw InputError("", "--distortion",
                     "expected none, radial1, radial2, radial2_tangential or full, found '" + asked.distortion + "'");
  Progress progress(asked.product.common.progress);
  const auto& files = asked.images;
  std::vector<CameraView> views;
  int width = 0, height = 0;
  for (size_t i = 0; i < files.size(); ++i) {
    progress.Show("corners", static_cast<double>(i) / static_cast<double>(files.size()), files[i].filename().string());
    const ImageFile photo = ReadImageFile(files[i]);
    if (i > 0 && (photo.image.width != width || photo.image.height != height))
      throw InputError(files[i], "",
                       "is " + std::to_string(photo.image.width) + " x " + std::to_string(photo.image.height) +
                           " pixels, but " + files[0].filename().string() + " is " + std::to_string(width) + " x " +
                           std::to_string(height),
                       "A camera file is valid for one picture size. Take all photographs in the same orientation.");
    width = photo.image.width;
    height = photo.image.height;
    views.push_back({files[i].filename().string(), FindBoard(photo, board)});
    for (size_t k = 0; k < i; ++k)
      if (!views[i].corners.pixel.empty() && views[k].corners.pixel == views[i].corners.pixel)
        throw InputError(files[i], "",
                         "shows the board exactly where " + files[k].string() + " does: it is the same picture",
                         "Give each photograph once, and photograph the board from several sides.");
  }
  progress.Clear();
  return Finish(CameraProduct(views, width, height, model->second), files, asked.product);
}

}  // namespace

void AddCalibrateCamera(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<CameraTask>();
  auto* camera =
      AddProduct(&calibrate, asked->product, "camera",
                 "Measures focal length, principal point and distortion from 10 to 20 photographs of a board.");
  camera->footer(
      "Focus and aperture must be those of the photographs of the crown.\n\n"
      "Example:\n"
      "  crownfit calibrate camera board*.dng --board charuco --corners 9x6 --square-mm 10 -o camera.json\n"
      "Prints fx, fy, cx, cy, the distortion and rms in pixels, and writes camera.json and camera.png.");
  AddImages(camera, asked->images,
            "Photographs of the board, tilted in different directions, all at one focus and aperture.");
  camera->add_option("--board", asked->board.kind, "chessboard, charuco or apriltag (a grid of tags).")->required();
  AddBoard(camera, asked->board);
  camera->add_option("--distortion", asked->distortion,
                     "none, radial1, radial2, radial2_tangential or full (default: the terms that the corners\n"
                     "determine).");
  RunWith(camera, command, asked, RunCamera);
}

}  // namespace crownfit
