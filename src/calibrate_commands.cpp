#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "calibrate/estimate_camera.h"
#include "calibrate/estimate_pose.h"
#include "calibrate/printed_targets.h"
#include "calibrate/scan_poses_product.h"
#include "calibrate_steps.h"
#include "commands.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

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
    for (size_t k = 0; k < i; ++k)
      if (!views[i].corners.pixel.empty() && views[k].corners.pixel == views[i].corners.pixel)
        throw InputError(files[i], "",
                         "shows the board exactly where " + files[k].string() + " does: one picture twice",
                         "Give each photograph once; the board is to be seen from several sides.");
  }
  progress.Clear();
  return Finish(CameraProduct(views, width, height, model->second), files, line);
}

int AlignScanInPhotographs(const CommandLine& line) {
  const CalibrateLine& asked = line.calibrate;
  RequireDistinctNames(asked.images);
  const Camera camera = ReadCamera(asked.camera);
  const auto starts = ReadPoses(Required(asked.start, "--start"));
  Progress progress(line.progress);
  progress.Show("reading", 0.0);
  TriangleMesh mesh;
  for (const auto& file : asked.meshes) {
    const TriangleMesh part = ReadMeshFile(file);
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) mesh.triangles.push_back(t + first);
  }
  RigidTransform placed;
  if (const auto& p = asked.placed; !p.empty())
    placed = {RotationFromVector(std::numbers::pi / 180 * glm::dvec3(p[3], p[4], p[5])), {p[0], p[1], p[2]}};
  std::vector<Image> pictures;
  std::vector<ScanPhotograph> photographs;
  std::vector<std::string> names;
  pictures.reserve(asked.images.size());
  for (const auto& file : asked.images) {
    ImageFile photo = ReadImageFile(file);
    RequireSizeOf(camera, photo.image, file, asked.camera);
    if (photo.image.channels < 3) throw InputError(file, "", "is grey; outlines are found by colour");
    if (photo.is_srgb_encoded)
      for (float& v : photo.image.values) v = static_cast<float>(LinearFromSrgb(v));
    pictures.push_back(std::move(photo.image));
    names.push_back(file.stem().string());
    const StatedPose& start = PoseOf(starts, file, asked.start);
    photographs.push_back({&pictures.back(), camera, start.camera_from_object * placed, start.covariance});
  }
  AlignOptions options;
  options.search_mm = asked.search_mm;
  options.search_deg = asked.search_deg;
  options.threads = line.fit.threads;
  options.seed = line.fit.seed;
  std::vector<AlignedScan> aligned;
  if (asked.together) {
    aligned.push_back(AlignScan(mesh, photographs, options, [&](double share) { progress.Show("aligning", share); }));
  } else {
    for (size_t k = 0; k < photographs.size(); ++k)
      aligned.push_back(AlignScan(mesh, {photographs[k]}, options, [&](double share) {
        progress.Show("aligning", (static_cast<double>(k) + share) / static_cast<double>(photographs.size()), names[k]);
      }));
  }
  progress.Clear();
  auto inputs = asked.images;
  inputs.insert(inputs.end(), asked.meshes.begin(), asked.meshes.end());
  inputs.push_back(asked.camera);
  return Finish(ScanPosesProduct(mesh, names, photographs, aligned), inputs, line);
}

int CalibratePose(const CommandLine& line) {
  if (!line.calibrate.meshes.empty()) return AlignScanInPhotographs(line);
  RequireDistinctNames(line.calibrate.images);
  const Camera camera = ReadCamera(line.calibrate.camera);
  const bool by_board = !line.calibrate.target.empty();
  if (by_board != line.calibrate.jig.empty())
    throw InputError("", "--jig",
                     "say how: markers around the object (--jig FILE), a board (--board KIND), or its scan (--mesh "
                     "FILE --start FILE)");
  const Board board = by_board ? BoardOf(line) : Board{};
  const Jig jig = by_board ? Jig{} : ReadJig(line.calibrate.jig);
  Progress progress(line.progress);
  std::vector<ImageFile> photos;
  std::vector<PosedPhotograph> posed;
  photos.reserve(line.calibrate.images.size());
  for (const auto& file : line.calibrate.images) {
    progress.Show("markers", static_cast<double>(photos.size()) / static_cast<double>(line.calibrate.images.size()),
                  file.filename().string());
    photos.push_back(ReadImageFile(file));
    RequireSizeOf(camera, photos.back().image, file, line.calibrate.camera);
    posed.push_back({file.stem().string(), &photos.back().image,
                     by_board ? FindBoard(photos.back(), board) : FindJig(photos.back(), jig)});
  }
  progress.Clear();
  auto inputs = line.calibrate.images;
  inputs.push_back(line.calibrate.camera);
  Product product = MarkerPosesProduct(posed, camera);
  if (by_board && board.kind == BoardKind::kChessboard && (board.columns + board.rows) % 2 == 0)
    product.notes.push_back(
        "a chessboard of " + line.calibrate.corners +
        " corners looks the same turned by half a turn: these poses hold where it stands upright in "
        "every photograph. One with an even and an odd number of corners, such as 9x6, can't be "
        "mistaken.");
  return Finish(product, inputs, line);
}

int WriteTarget(const CommandLine& line) {
  if (line.output.extension() != ".svg") throw InputError(line.output, "-o", "a target is written as .svg");
  if (line.calibrate.target != "jig") {
    WriteTextFile(line.output, SvgText(PrintedBoard(BoardOf(line))));
  } else {
    JigLayout layout{.inside_mm = line.calibrate.inside_mm};
    if (!line.calibrate.board.dictionary.empty()) layout.dictionary = line.calibrate.board.dictionary;
    if (line.calibrate.board.marker_mm > 0) layout.marker_mm = line.calibrate.board.marker_mm;
    WriteTextFile(line.output, SvgText(PrintedJig(layout)));
    WriteTextFile(std::filesystem::path(line.output).replace_extension(".json"), ToJsonText(JigJson(JigOf(layout))));
  }
  std::printf("Written: %s; print it at 100 %%, on matt paper, and measure it\n", line.output.c_str());
  return 0;
}

}  // namespace

int RunCalibrate(const CommandLine& line) {
  const std::map<std::string, std::function<int(const CommandLine&)>> tasks{
      {"camera", CalibrateCamera}, {"noise", CalibrateNoise},   {"blur", CalibrateBlur},    {"pose", CalibratePose},
      {"lights", CalibrateLights}, {"colour", CalibrateColour}, {"exposures", MergeSeries}, {"target", WriteTarget}};
  return tasks.at(line.calibrate.task)(line);
}

int RunCaptureInit(const CommandLine& line) {
  if (!line.measured.file.empty()) return RunCaptureMeasured(line);
  CaptureParts parts = line.calibrate.parts;
  for (const auto& text : line.calibrate.init_meshes) parts.meshes.push_back(NamedFile(text, "--mesh"));
  for (const auto& text : line.calibrate.init_photographs) parts.photographs.push_back(NamedFile(text, "--photo"));
  for (const auto& text : line.calibrate.init_masks) parts.masks.push_back(NamedFile(text, "--mask"));
  for (const auto& text : line.calibrate.init_polarisation) {
    const auto [name, filter] = NamedFile(text, "--polarisation");
    parts.polarisation.emplace_back(name, filter.string());
  }
  for (const auto& text : line.calibrate.init_lit) {
    const auto [name, list] = NamedFile(text, "--lit");
    std::vector<std::string> lights;
    std::istringstream words(list.string());
    for (std::string light; std::getline(words, light, ',');) lights.push_back(light);
    parts.lit.emplace_back(name, lights);
  }
  InitCapture(parts, line.output);
  std::printf("Index and g of every layer were taken by its name. Correct them in %s where you know better.\n",
              (std::filesystem::path(line.output) / "capture.json").c_str());
  return CheckWhatWasMade(line);
}

}  // namespace crownfit
