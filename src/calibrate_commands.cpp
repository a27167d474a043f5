#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>

#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "calibrate/estimate_camera.h"
#include "calibrate/printed_targets.h"
#include "commands.h"

namespace crownfit {
namespace {

/// Writes the file unless it was refused, and the picture; prints figures, notes and refusals. The exit code.
int Finish(const Product& product, const std::vector<std::filesystem::path>& inputs, const CommandLine& line) {
  std::filesystem::path picture = line.calibrate.picture.value_or("");
  if (picture.empty() && !line.output.empty()) picture = std::filesystem::path(line.output).replace_extension(".png");
  if (product.picture.width && !picture.empty()) WriteImageFile(picture, product.picture);
  const JsonValue file = ProductJson(product, inputs);
  const bool write = product.refusals.empty() && !line.output.empty();
  if (write) WriteTextFile(line.output, ToJsonText(file));
  if (line.json) {
    std::fputs(ToJsonText(file).c_str(), stdout);
  } else {
    for (const Figure& f : product.figures) std::printf("%s %.6g %s\n", f.name.c_str(), f.value, f.unit.c_str());
  }
  for (const auto& note : product.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  for (const auto& refusal : product.refusals) std::fprintf(stderr, "refused: %s\n", refusal.c_str());
  if (!product.refusals.empty())
    std::fprintf(stderr, "Nothing was written%s.\n",
                 product.picture.width && !picture.empty() ? (" but " + picture.string()).c_str() : "");
  if (write && !line.json) std::printf("\nWritten: %s\nLook at: %s\n", line.output.c_str(), picture.c_str());
  return product.refusals.empty() ? 0 : 1;
}

/// The board as the options describe it, --corners read.
Board BoardOf(const CommandLine& line) {
  Board board = line.calibrate.board;
  const std::map<std::string, BoardKind> kinds{
      {"chessboard", BoardKind::kChessboard}, {"charuco", BoardKind::kCharuco}, {"apriltag", BoardKind::kAprilTag}};
  const auto kind = kinds.find(line.calibrate.target);
  if (kind == kinds.end())
    throw InputError("", "", "'" + line.calibrate.target + "' is no board: expected chessboard, charuco or apriltag");
  board.kind = kind->second;
  int length = 0;
  const std::string& corners = line.calibrate.corners;
  if (std::sscanf(corners.c_str(), "%dx%d%n", &board.columns, &board.rows, &length) != 2 ||
      static_cast<size_t>(length) != corners.size())
    throw InputError("", "--corners", "expected COLUMNSxROWS, such as 9x6, found '" + corners + "'");
  if (const std::string fault = FaultOf(board); !fault.empty()) throw InputError("", "", fault);
  return board;
}

int CalibrateCamera(const CommandLine& line) {
  const Board board = BoardOf(line);
  const std::map<std::string, std::optional<Distortion>> models{{"", {}},
                                                                {"none", Distortion::kNone},
                                                                {"radial1", Distortion::kRadial1},
                                                                {"radial2", Distortion::kRadial2},
                                                                {"radial2_tangential", Distortion::kRadial2Tangential},
                                                                {"full", Distortion::kFull}};
  const auto model = models.find(line.calibrate.distortion);
  if (model == models.end())
    throw InputError(
        "", "--distortion",
        "expected none, radial1, radial2, radial2_tangential or full, found '" + line.calibrate.distortion + "'");
  Progress progress(line.progress);
  const auto& files = line.calibrate.images;
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
                       "One camera file holds for one size of picture, taken all upright or all on their side.");
    width = photo.image.width;
    height = photo.image.height;
    views.push_back({files[i].filename().string(), FindBoard(photo, board)});
  }
  progress.Clear();
  return Finish(CameraProduct(views, width, height, model->second), files, line);
}

int WriteTarget(const CommandLine& line) {
  if (line.output.extension() != ".svg") throw InputError(line.output, "-o", "a target is written as .svg");
  if (line.calibrate.target != "jig") {
    WriteTextFile(line.output, SvgText(PrintedBoard(BoardOf(line))));
  } else {
    JigLayout layout{.inside_mm = line.calibrate.inside_mm};
    if (line.calibrate.board.marker_mm > 0) layout.marker_mm = line.calibrate.board.marker_mm;
    WriteTextFile(line.output, SvgText(PrintedJig(layout)));
    WriteTextFile(std::filesystem::path(line.output).replace_extension(".json"), ToJsonText(JigJson(JigOf(layout))));
  }
  std::printf("Written: %s; print it at 100 %%, on matt paper, and measure it\n", line.output.c_str());
  return 0;
}

}  // namespace

int RunCalibrate(const CommandLine& line) {
  const std::map<std::string, std::function<int(const CommandLine&)>> tasks{{"camera", CalibrateCamera},
                                                                            {"target", WriteTarget}};
  return tasks.at(line.calibrate.task)(line);
}

}  // namespace crownfit
