#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "base/progress.h"
#include "calibrate/estimate_blur.h"
#include "calibrate/estimate_camera.h"
#include "calibrate/estimate_colour.h"
#include "calibrate/estimate_lights.h"
#include "calibrate/estimate_noise.h"
#include "calibrate/estimate_pose.h"
#include "calibrate/exposure_series.h"
#include "calibrate/find_chart.h"
#include "calibrate/printed_targets.h"
#include "calibrate/scan_poses_product.h"
#include "commands.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

/// Writes the file unless it was refused, and the picture; prints figures, notes and refusals. The exit code.
int Finish(const Product& product, const std::vector<std::filesystem::path>& inputs, const CommandLine& line) {
  std::filesystem::path picture = line.calibrate.picture.value_or("");
  if (picture.empty() && !line.output.empty()) picture = std::filesystem::path(line.output).replace_extension(".png");
  if (product.picture.width && !picture.empty()) WriteImageFile(picture, product.picture);
  const JsonValue file = ProductJson(product, inputs);
  const bool write = product.refusals.empty() && !line.output.empty();
  if (write && !product.format.empty()) WriteTextFile(line.output, ToJsonText(file));
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
  if (write && !line.json) std::printf("\nWritten: %s\n", line.output.c_str());
  if (product.picture.width && !picture.empty() && !line.json) std::printf("Look at: %s\n", picture.c_str());
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

void RequireOneSize(const Image& image, const Image& first, const std::filesystem::path& file,
                    const std::filesystem::path& first_file) {
  if (image.width == first.width && image.height == first.height && image.channels == first.channels) return;
  const auto size = [](const Image& i) {
    return std::to_string(i.width) + " x " + std::to_string(i.height) + " pixels of " + std::to_string(i.channels);
  };
  throw InputError(file, "",
                   "has " + size(image) + " channels, but " + first_file.filename().string() + " has " + size(first));
}

void RequireSizeOf(const Camera& camera, const Image& image, const std::filesystem::path& file,
                   const std::filesystem::path& camera_file) {
  if (image.width == camera.width && image.height == camera.height) return;
  throw InputError(file, "",
                   "is " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels, but " +
                       camera_file.filename().string() + " is for " + std::to_string(camera.width) + " x " +
                       std::to_string(camera.height));
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

/// Linear pictures, or a complaint.
std::vector<ImageFile> ReadLinear(const std::vector<std::filesystem::path>& files, bool taken_as_linear) {
  std::vector<ImageFile> photos;
  for (const auto& file : files) {
    photos.push_back(ReadImageFile(file));
    if (photos.back().is_srgb_encoded && !taken_as_linear)
      throw InputError(file, "",
                       "is encoded for display, and noise after a camera's tone curve says nothing of its sensor",
                       "Give RAW files, or say --linear when the values are proportional to the light.");
    RequireOneSize(photos.back().image, photos[0].image, file, files[0]);
  }
  return photos;
}

int CalibrateNoise(const CommandLine& line) {
  Progress progress(line.progress);
  progress.Show("reading", 0.0);
  const auto photos = ReadLinear(line.calibrate.images, line.calibrate.is_linear);
  const auto dark_files = ReadLinear(line.calibrate.darks, line.calibrate.is_linear);
  if (photos.size() < 2 || (!line.calibrate.is_series && photos.size() % 2))
    throw InputError("", "IMAGES", "expected pairs of photographs, found " + std::to_string(photos.size()),
                     "Photograph every scene twice, A A' B B'; or say --series.");
  std::vector<std::pair<const Image*, const Image*>> pairs;
  for (size_t i = 0; i + 1 < photos.size(); i += line.calibrate.is_series ? 1 : 2)
    pairs.emplace_back(&photos[i].image, &photos[i + 1].image);
  std::vector<const Image*> darks;
  for (const auto& dark : dark_files) darks.push_back(&dark.image);
  progress.Show("photon transfer", 0.5);
  const Product product = NoiseProduct(pairs, darks);
  progress.Clear();
  auto inputs = line.calibrate.images;
  inputs.insert(inputs.end(), line.calibrate.darks.begin(), line.calibrate.darks.end());
  return Finish(product, inputs, line);
}

/// The part of a picture from (x, y) on.
Image Part(const Image& image, int x0, int y0, int width, int height) {
  Image part(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c) part.at(x, y, c) = image.at(x0 + x, y0 + y, c);
  return part;
}

/// Subtracts the black level of noise.json, where one is given; the level from which values are saturated.
double RemoveBlack(Image& image, const std::optional<std::filesystem::path>& noise_file) {
  if (!noise_file) return 0.98;
  const SensorNoise noise = ReadSensorNoise(*noise_file);
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] -= static_cast<float>(noise.black[std::min<size_t>(i % image.channels, 2)]);
  return noise.saturation[0].value_or(0.98) - noise.black[0];
}

int CalibrateBlur(const CommandLine& line) {
  if (line.calibrate.images.size() != 1) throw InputError("", "IMAGES", "blur is measured in one photograph at a time");
  ImageFile photo = ReadLinear(line.calibrate.images, line.calibrate.is_linear)[0];
  BlurInput input;
  input.dark_reflectance = line.calibrate.dark_reflectance;
  input.light_reflectance = line.calibrate.light_reflectance;
  input.saturation = RemoveBlack(photo.image, line.calibrate.noise);
  photo.is_srgb_encoded = false;
  ImageFile searched = photo;
  glm::dvec2 corner(0.0);
  if (const auto& region = line.calibrate.region; !region.empty()) {
    const bool inside = region[0] >= 0 && region[1] >= 0 && region[2] >= 30 && region[3] >= 30 &&
                        region[0] + region[2] <= photo.image.width && region[1] + region[3] <= photo.image.height;
    if (!inside)
      throw InputError(line.calibrate.images[0], "--region", "is not inside the picture, or under 30 px wide");
    corner = {std::floor(region[0]), std::floor(region[1])};
    searched.image = Part(photo.image, static_cast<int>(corner.x), static_cast<int>(corner.y),
                          static_cast<int>(region[2]), static_cast<int>(region[3]));
  }
  input.edges = FindSlantedSquare(searched);
  for (Edge& edge : input.edges) edge = {edge.from + corner, edge.to + corner};
  if (input.edges.empty())
    throw InputError(
        line.calibrate.images[0], "", "shows no dark square on white that is slanted against the pixels",
        "Print `crownfit calibrate target jig`; its square is slanted by 5 degrees when the print lies straight. "
        "Give --region where other things in the picture are dark too.");
  return Finish(BlurProduct(photo.image, input), line.calibrate.images, line);
}

/// Divides by a white card's picture, smoothed over a twentieth of its width; its middle keeps its value.
void Flatten(Image& image, const Image& card) {
  const int radius = std::max(1, image.width / 40);
  const Image smooth = BoxMean(card, radius);
  for (int c = 0; c < image.channels; ++c) {
    const float middle = smooth.at(image.width / 2, image.height / 2, c);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) image.at(x, y, c) *= middle / std::max(smooth.at(x, y, c), 1e-6f);
  }
}

int CalibrateColour(const CommandLine& line) {
  if (line.calibrate.images.size() != 1) throw InputError("", "IMAGES", "colour is calibrated from one photograph");
  const auto& path = line.calibrate.images[0];
  const Chart chart = ReadChart(line.calibrate.chart);
  const ImageFile photo = ReadImageFile(path);
  if (photo.image.channels < 3) throw InputError(path, "", "is grey; a colour chart needs a colour photograph");
  const bool encoded = photo.is_srgb_encoded && !line.calibrate.is_linear;
  Image linear = photo.image;
  if (encoded)
    for (float& v : linear.values) v = static_cast<float>(LinearFromSrgb(v));
  double saturation = RemoveBlack(linear, line.calibrate.noise);
  if (line.calibrate.flat_field) {
    Image card = ReadImageFile(*line.calibrate.flat_field).image;
    RequireOneSize(card, linear, *line.calibrate.flat_field, path);
    if (encoded)
      for (float& v : card.values) v = static_cast<float>(LinearFromSrgb(v));
    RemoveBlack(card, line.calibrate.noise);
    for (float& v : linear.values)
      if (v >= saturation) v = 1e9f;  // still to be seen when the card has changed its value
    Flatten(linear, card);
    saturation = 1e6;
  }
  ChartCorners corners;
  if (!line.calibrate.chart_corners.empty()) {
    for (int k = 0; k < 4; ++k)
      corners[k] = {line.calibrate.chart_corners[2 * k], line.calibrate.chart_corners[2 * k + 1]};
  } else {
    const auto found = FindClassicChart(photo, linear, chart);
    if (!found)
      throw InputError(path, "", "no ColorChecker was found: it must be whole, in focus, and at least 150 px wide",
                       "Give the outer patches' corners by hand: --chart-corners X1,Y1,X2,Y2,X3,Y3,X4,Y4.");
    corners = *found;
  }
  const auto readings = ReadPatches(linear, chart, corners, kClassicGap, saturation);
  return Finish(ColourProduct(chart, readings, {&linear, encoded, photo.is_jpeg}), line.calibrate.images, line);
}

std::filesystem::path Required(const std::filesystem::path& file, const char* option) {
  if (file.empty()) throw InputError("", option, "this option is needed here");
  return file;
}

int AlignScanInPhotographs(const CommandLine& line) {
  const CalibrateLine& asked = line.calibrate;
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
    photographs.push_back({&pictures.back(), camera, PoseOf(starts, file, asked.start).camera_from_object});
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
  return Finish(MarkerPosesProduct(posed, camera), inputs, line);
}

/// NAME=FILE.
std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw InputError("", option, "expected NAME=FILE, such as left=ball_left.dng, found '" + text + "'");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

int CalibrateLights(const CommandLine& line) {
  const CalibrateLine& asked = line.calibrate;
  if (asked.lights.empty() == asked.rig.empty())
    throw InputError("", "", "give either photographs of mirror balls (NAME=FILE) or a measured rig (--rig FILE)");
  std::optional<Camera> camera;
  if (!asked.camera.empty()) camera = ReadCamera(asked.camera);
  Progress progress(line.progress);
  std::vector<std::filesystem::path> inputs;
  std::vector<std::string> notes;
  std::vector<Light> lights;
  double saturation = 0.98;
  const auto read = [&](const std::filesystem::path& file) {
    progress.Show("reading", 0.3, file.filename().string());
    inputs.push_back(file);
    ImageFile photo = ReadLinear({file}, asked.is_linear)[0];
    saturation = RemoveBlack(photo.image, asked.noise);
    photo.is_srgb_encoded = false;
    return photo;
  };
  std::vector<ImageFile> balls;
  balls.reserve(asked.lights.size());
  if (!asked.rig.empty()) {
    lights = ReadLightRig(asked.rig).lights;
    inputs.push_back(asked.rig);
  } else {
    if (camera && asked.ball_mm <= 0) throw InputError("", "--ball-mm", "the balls' diameter is needed to place them");
    if (asked.balls.size() % 3) throw InputError("", "--ball", "expected X,Y,RADIUS for every ball");
    std::vector<BallPhotograph> photographs;
    for (const std::string& text : asked.lights) {
      const auto [name, file] = NamedFile(text, "BALLS");
      balls.push_back(read(file));
      BallPhotograph photo{name, &balls.back().image, {}};
      for (size_t b = 0; b + 2 < asked.balls.size(); b += 3)
        photo.balls.push_back({{asked.balls[b], asked.balls[b + 1]}, asked.balls[b + 2], 0});
      if (photo.balls.empty()) photo.balls = FindBalls(balls.back(), asked.ball_count);
      if (photo.balls.empty())
        throw InputError(file, "", "no ball was found",
                         "Say where they are: --ball X,Y,RADIUS in pixels, once for each.");
      photographs.push_back(photo);
    }
    lights = LightsFromBalls(photographs, camera ? &*camera : nullptr, 0.5 * asked.ball_mm, notes);
  }
  std::vector<ImageFile> cards;
  cards.reserve(asked.cards.size());
  std::vector<CardPhotograph> card_photographs;
  if (!asked.cards.empty()) {
    const auto poses = ReadPoses(Required(asked.card_poses, "--card-pose"));
    if (!camera) throw InputError("", "--camera", "is needed to read cards");
    if (asked.card_mm.size() != 4)
      throw InputError("", "--card-mm", "say which part of the card to read: X0,Y0,X1,Y1 in mm");
    for (const std::string& text : asked.cards) {
      const auto [name, file] = NamedFile(text, "--card");
      cards.push_back(read(file));
      RequireSizeOf(*camera, cards.back().image, file, asked.camera);
      card_photographs.push_back({name,
                                  &cards.back().image,
                                  *camera,
                                  PoseOf(poses, file, asked.card_poses).camera_from_object,
                                  {asked.card_mm[0], asked.card_mm[1]},
                                  {asked.card_mm[2], asked.card_mm[3]},
                                  glm::dvec3(asked.card_reflectance),
                                  saturation});
    }
  }
  progress.Show("fitting", 0.7);
  const Product product = LightsProduct(lights, card_photographs, asked.refine, notes);
  progress.Clear();
  return Finish(product, inputs, line);
}

int MergeSeries(const CommandLine& line) {
  auto files = line.calibrate.images;
  if (line.calibrate.times.size() != files.size())
    throw InputError(
        "", "--times",
        std::to_string(line.calibrate.times.size()) + " times for " + std::to_string(files.size()) + " photographs");
  if (files.size() < 2) throw InputError("", "IMAGES", "a series has at least two exposures");
  if (line.output.extension() != ".exr") throw InputError(line.output, "-o", "the merged picture is written as .exr");
  std::vector<std::pair<double, std::filesystem::path>> order;
  for (size_t i = 0; i < files.size(); ++i) order.emplace_back(line.calibrate.times[i], files[i]);
  std::sort(order.begin(), order.end());
  if (order.front().first <= 0) throw InputError("", "--times", "exposure times are positive");
  std::vector<ImageFile> photos;
  ExposureSeries series;
  for (const auto& [time, file] : order) {
    photos.push_back(ReadImageFile(file));
    RequireOneSize(photos.back().image, photos[0].image, file, order[0].second);
    series.times.push_back(time);
  }
  if (line.calibrate.noise) series.noise = ReadSensorNoise(*line.calibrate.noise);
  const bool encoded = photos[0].is_srgb_encoded && !line.calibrate.is_linear;
  Product product;
  if (encoded) {
    const auto response = EstimateResponse(photos, series.times);
    double departure = 0;
    for (int v = 8; v < 250; ++v)
      for (int c = 0; c < 3; ++c) departure = std::max(departure, std::abs(SrgbFromLinear(response[v][c]) - v / 255.0));
    product.figures.push_back({"response_from_srgb", 255 * departure, "of 255"});
    for (auto& photo : photos) photo.image = Decoded(photo.image, response);
  }
  for (auto& photo : photos) series.photographs.push_back(std::move(photo.image));
  if (!line.calibrate.darks.empty()) {
    const auto darks = ReadLinear(line.calibrate.darks, true);
    for (int c = 0; c < 3; ++c) {
      double sum = 0, count = 0;
      for (const auto& dark : darks)
        for (size_t i = std::min(c, dark.image.channels - 1); i < dark.image.values.size(); i += dark.image.channels)
          sum += dark.image.values[i], ++count;
      series.noise.black[c] = sum / count;
    }
  }
  const MergedExposures merged = MergeExposures(series);
  for (size_t k = 0; k < merged.time_ratios.size(); ++k)
    product.figures.push_back({"ratio_" + Text(series.times[k + 1]) + "_to_" + Text(series.times[k]) + "_over_times",
                               merged.time_ratios[k], ""});
  product.figures.push_back({"nonlinearity", 100 * merged.worst_ratio, "%"});
  product.figures.push_back({"saturated_in_all", 100 * merged.share_saturated, "% of pixels"});
  if (merged.worst_ratio > 0.1)
    product.refusals.push_back(
        "exposures differ by " + Text(100 * merged.worst_ratio, "%") +
        " from what their times let expect: are the times right, did the light drift, are the files "
        "linear?");
  else if (merged.worst_ratio > 0.03)
    product.notes.push_back("exposures depart by " + Text(100 * merged.worst_ratio, "%") + " from their times.");
  if (product.refusals.empty()) {
    const std::filesystem::path variance = line.output.stem().string() + "_variance.exr";
    WriteImageFile(line.output, merged.linear);
    WriteImageFile(line.output.parent_path() / variance, merged.variance);
  }
  return Finish(product, files, line);
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
  const std::map<std::string, std::function<int(const CommandLine&)>> tasks{
      {"camera", CalibrateCamera}, {"noise", CalibrateNoise},   {"blur", CalibrateBlur},    {"pose", CalibratePose},
      {"lights", CalibrateLights}, {"colour", CalibrateColour}, {"exposures", MergeSeries}, {"target", WriteTarget}};
  return tasks.at(line.calibrate.task)(line);
}

int RunCaptureInit(const CommandLine& line) {
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
  std::printf("Written: %s\n\n", (line.output / "capture.json").c_str());
  CommandLine check = line;
  check.capture = line.output;
  check.output.clear();
  return RunCheck(check);
}

}  // namespace crownfit
