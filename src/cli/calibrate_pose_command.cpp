#include <numbers>

#include "base/error.h"
#include "base/progress.h"
#include "calibration/estimate_pose.h"
#include "calibration/scan_poses_product.h"
#include "cli/calibrate_parts.h"
#include "exchange/opencv_file.h"
#include "geometry/mesh_file.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

struct PoseTask {
  ProductOptions product;
  std::vector<std::filesystem::path> images;
  std::filesystem::path camera, jig;
  BoardOptions board;
  std::vector<std::filesystem::path> meshes;  ///< the scan, instead of markers
  std::filesystem::path start;
  std::vector<double> placed;  ///< x, y, z in mm, a rotation vector in degrees: the object's frame in that of `start`
  bool together = false;
  double search_mm = 5, search_deg = 5;
};

int AlignScanInPhotographs(const PoseTask& asked) {
  RequireDistinctNames(asked.images);
  const Camera camera = ReadCameraOrOpenCv(asked.camera);
  const auto starts = ReadPoses(Required(asked.start, "--start"));
  Progress progress(asked.product.common.progress);
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
    ImageFile photo = ReadLight(file, "file");
    RequireSizeOf(camera, photo.image, file, asked.camera);
    if (photo.image.channels < 3) throw InputError(file, "", "is grey, but the outline is found by colour");
    pictures.push_back(std::move(photo.image));
    names.push_back(file.stem().string());
    const StatedPose& start = PoseOf(starts, file, asked.start);
    photographs.push_back({&pictures.back(), camera, start.camera_from_object * placed, start.covariance});
  }
  AlignOptions options;
  options.search_mm = asked.search_mm;
  options.search_deg = asked.search_deg;
  options.threads = asked.product.common.threads;
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
  return Finish(ScanPosesProduct(mesh, names, photographs, aligned), inputs, asked.product);
}

int RunPose(const PoseTask& asked) {
  if (!asked.meshes.empty()) return AlignScanInPhotographs(asked);
  RequireDistinctNames(asked.images);
  const Camera camera = ReadCameraOrOpenCv(asked.camera);
  const bool by_board = !asked.board.kind.empty();
  if (by_board != asked.jig.empty())
    throw InputError("", "--jig",
                     "give one way to find the pose: markers around the object (--jig FILE), a board (--board KIND), "
                     "or its scan (--mesh FILE --start FILE)");
  const Board board = by_board ? BoardOf(asked.board) : Board{};
  const Jig jig = by_board ? Jig{} : ReadJig(asked.jig);
  Progress progress(asked.product.common.progress);
  std::vector<ImageFile> photos;
  std::vector<PosedPhotograph> posed;
  photos.reserve(asked.images.size());
  for (const auto& file : asked.images) {
    progress.Show("markers", static_cast<double>(photos.size()) / static_cast<double>(asked.images.size()),
                  file.filename().string());
    photos.push_back(ReadImageFile(file));
    RequireSizeOf(camera, photos.back().image, file, asked.camera);
    posed.push_back({file.stem().string(), &photos.back().image,
                     by_board ? FindBoard(photos.back(), board) : FindJig(photos.back(), jig)});
  }
  progress.Clear();
  auto inputs = asked.images;
  inputs.push_back(asked.camera);
  Product product = MarkerPosesProduct(posed, camera);
  if (by_board && board.kind == BoardKind::kChessboard && (board.columns + board.rows) % 2 == 0)
    product.notes.push_back(
        "a chessboard of " + asked.board.corners +
        " corners looks the same after half a turn. These poses are right only if it stands upright in every "
        "photograph. Use one with an even and an odd number of corners, such as 9x6.");
  return Finish(product, inputs, asked.product);
}

}  // namespace

void AddCalibratePose(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<PoseTask>();
  auto* pose =
      AddProduct(&calibrate, asked->product, "pose",
                 "Finds the object's pose in photographs, from markers around it or from the outline of its scan.");
  pose->footer(
      "Example:\n"
      "  crownfit calibrate pose front.dng side.dng --camera camera.json --jig jig.json -o from_jig.json\n"
      "  crownfit calibrate pose front.dng side.dng --camera camera.json --mesh crown.stl --start from_jig.json \\\n"
      "    --placed 0,0,-5,180,0,0 --together -o poses.json\n"
      "The first finds the jig. The second finds the crown on it: here about 5 mm in front of the jig, turned by half "
      "a turn\n"
      "about x. Look at the picture: the outline of the scan must lie on the edge of the crown.");
  AddImages(pose, asked->images, "Photographs of one camera. The poses are named after the files.");
  pose->add_option("--camera", asked->camera, "camera.json of the camera, or a calibration by OpenCV (.yml, .xml).")
      ->required();
  pose->add_option("--jig", asked->jig, "Markers of the jig: jig.json of `crownfit calibrate target jig`.");
  pose->add_option("--board", asked->board.kind, "Instead of a jig: chessboard, charuco or apriltag.");
  AddBoard(pose, asked->board);
  pose->add_option("--mesh", asked->meshes,
                   "Instead of markers: the scan in mm (PLY, STL, OBJ). Repeatable, for several crowns.")
      ->allow_extra_args(false)
      ->group("Scan");
  pose->add_option("--start", asked->start, "poses.json with a rough pose of every photograph.")->group("Scan");
  pose->add_option("--placed", asked->placed,
                   "X,Y,Z,RX,RY,RZ: rough place of the scan's frame in the frame of --start, such as a jig's:\n"
                   "its origin in mm and a rotation vector in degrees.")
      ->expected(6)
      ->delimiter(',')
      ->group("Scan");
  pose->add_option("--search-mm", asked->search_mm, "Largest error of the rough poses in mm (default 5).")
      ->check(CLI::Range(0.0, 100.0))
      ->group("Scan");
  pose->add_option("--search-deg", asked->search_deg, "Largest error of the rough poses in degrees (default 5).")
      ->check(CLI::Range(0.0, 45.0))
      ->group("Scan");
  pose->add_flag("--together", asked->together,
                 "The rough poses are right relative to each other, as those of a jig: find one motion of the\n"
                 "object for all photographs.")
      ->group("Scan");
  RunWith(pose, command, asked, RunPose);
}

}  // namespace crownfit
