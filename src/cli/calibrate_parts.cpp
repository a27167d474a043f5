#include "cli/calibrate_parts.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include "base/error.h"
#include "base/files.h"
#include "photo/photograph.h"

namespace crownfit {

CLI::App* AddProduct(CLI::App* calibrate, ProductOptions& options, const char* name, const std::string& what) {
  auto* task = calibrate->add_subcommand(name, what);
  task->add_option("-o,--output", options.output, "File to write.");
  task->add_option(
      "--picture", options.picture,
      "PNG picture of the result, to look at (default: the name of the file, with .png; where that is one of\n"
      "the photographs, with _result.png).");
  task->add_flag("--json", options.json, "Print the file and its figures as JSON.");
  AddCommonOptions(task, options.common);
  return task;
}

namespace {

bool IsOneOf(const std::filesystem::path& file, const std::vector<std::filesystem::path>& files) {
  return std::any_of(files.begin(), files.end(), [&](const std::filesystem::path& other) {
    std::error_code is_new;
    return std::filesystem::equivalent(file, other, is_new);
  });
}

/// Where the picture goes: as asked, or beside the output. No file that was read is replaced.
std::filesystem::path PictureFile(const std::vector<std::filesystem::path>& inputs, const ProductOptions& options) {
  const std::filesystem::path output = options.output;
  for (const std::filesystem::path& file : {output, options.picture.value_or("")})
    if (IsOneOf(file, inputs)) throw InputError(file, "", "would be replaced, but it was read", "Give another name.");
  if (options.picture || output.empty()) return options.picture.value_or("");
  const std::filesystem::path beside = std::filesystem::path(output).replace_extension(".png");
  return IsOneOf(beside, inputs) ? beside.parent_path() / (beside.stem().string() + "_result.png") : beside;
}

}  // namespace

int Finish(const Product& product, const std::vector<std::filesystem::path>& inputs, const ProductOptions& options) {
  const std::filesystem::path picture = PictureFile(inputs, options);
  if (product.picture.width && !picture.empty()) WriteImageFile(picture, product.picture);
  const JsonValue file = ProductJson(product, inputs);
  const bool write = product.refusals.empty() && !options.output.empty();
  if (write && !product.format.empty()) WriteTextFile(options.output, ToJsonText(file));
  if (options.json) {
    std::fputs(ToJsonText(file).c_str(), stdout);
  } else {
    for (const Figure& f : product.figures) std::printf("%s %.6g %s\n", f.name.c_str(), f.value, f.unit.c_str());
  }
  for (const auto& note : product.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  for (const auto& refusal : product.refusals) std::fprintf(stderr, "refused: %s\n", refusal.c_str());
  if (!product.refusals.empty())
    std::fprintf(stderr, "Nothing was written%s.\n",
                 product.picture.width && !picture.empty() ? (" except " + picture.string()).c_str() : "");
  if (write && !options.json) std::printf("\nWritten: %s\n", options.output.c_str());
  if (product.picture.width && !picture.empty() && !options.json) std::printf("Look at: %s\n", picture.c_str());
  return product.refusals.empty() ? 0 : 1;
}

void AddImages(CLI::App* task, std::vector<std::filesystem::path>& images, const char* what) {
  task->add_option("IMAGES", images, what)->required();
}

void AddBoard(CLI::App* task, BoardOptions& options) {
  Board& board = options.board;
  task->add_option("--corners", options.corners,
                   "COLUMNSxROWS of inner corners, such as 9x6: one less than squares each way. apriltag: of tags.");
  task->add_option("--square-mm", board.square_mm,
                   "Width of a square in mm, measured on the print. apriltag: of a tag.");
  task->add_option("--marker-mm", board.marker_mm, "charuco: width of a marker in mm (default: 3/4 of a square).");
  task->add_option("--gap-mm", board.gap_mm, "apriltag: gap between tags in mm (default: 3/10 of a tag).");
  task->add_option(
      "--dictionary", board.dictionary,
      "OpenCV's name of the markers' dictionary (default 4X4_250; apriltag: APRILTAG_36h11; jig: 4X4_50).");
}

Board BoardOf(const BoardOptions& options) {
  Board board = options.board;
  const std::map<std::string, BoardKind> kinds{
      {"chessboard", BoardKind::kChessboard}, {"charuco", BoardKind::kCharuco}, {"apriltag", BoardKind::kAprilTag}};
  const auto kind = kinds.find(options.kind);
  if (kind == kinds.end())
    throw InputError("", "", "'" + options.kind + "' is not a board: expected chessboard, charuco or apriltag");
  board.kind = kind->second;
  int length = 0;
  const std::string& corners = options.corners;
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
                   "has " + size(image) + " channels, but " + first_file.filename().string() + " has " + size(first),
                   "Give photographs of one camera at one setting, none of them cropped or scaled.");
}

void RequireSizeOf(const Camera& camera, const Image& image, const std::filesystem::path& file,
                   const std::filesystem::path& camera_file) {
  if (image.width == camera.width && image.height == camera.height) return;
  throw InputError(
      file, "",
      "is " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels, but " +
          camera_file.filename().string() + " is for " + std::to_string(camera.width) + " x " +
          std::to_string(camera.height),
      "Give the photograph as the camera took it, neither cropped nor scaled, or a camera file of its size.");
}

std::filesystem::path Required(const std::filesystem::path& file, const char* option) {
  if (file.empty()) throw InputError("", option, "this option is required here");
  return file;
}

ImageFile ReadLight(const std::filesystem::path& file, const std::string& encoding) {
  constexpr float kOpaque = 0.999f;
  ImageFile photo = ReadImageFile(file);
  Image& image = photo.image;
  for (size_t i = 0; photo.alpha_channel >= 0 && i < image.values.size(); i += image.channels)
    if (image.values[i + photo.alpha_channel] < kOpaque)
      throw InputError(file, "", "has pixels with an alpha below 1, whose light is mixed with what lies behind them",
                       "Give the photograph without a cut-out.");
  photo.transfer = Resolved(photo.transfer, Encoding::Named(encoding, "--encoding"), file, "--encoding");
  for (size_t i = 0; photo.transfer.is_encoded() && i < image.values.size(); ++i)
    if (const int c = static_cast<int>(i % image.channels); c != photo.alpha_channel)
      image.values[i] = static_cast<float>(photo.transfer.Light(image.values[i], std::min(c, 2)));
  return photo;
}

std::vector<ImageFile> ReadLinear(const std::vector<std::filesystem::path>& files, const std::string& encoding) {
  std::vector<ImageFile> photos;
  for (const auto& file : files) {
    photos.push_back(ReadLight(file, encoding));
    if (photos.back().transfer.is_encoded() && encoding == "file")
      throw InputError(file, "",
                       "is encoded for display: its values are not proportional to the light, because the camera "
                       "applied a tone curve",
                       "Give RAW files. If no tone curve but the stated encoding was applied, add --encoding; if the "
                       "values are proportional to the light, add --linear.");
    photos.back().transfer.kind = Transfer::Kind::kLinear;
    RequireOneSize(photos.back().image, photos[0].image, file, files[0]);
  }
  return photos;
}

glm::dvec3 RemoveBlack(ImageFile& photo, const std::filesystem::path& file,
                       const std::optional<std::filesystem::path>& noise_file) {
  constexpr double kUnknown = 0.98;
  if (!noise_file) return glm::dvec3(kUnknown);
  const SensorNoise noise = ReadSensorNoise(*noise_file);
  RequireSharesOfFullScale(noise, photo, file);
  Image& image = photo.image;
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] -= static_cast<float>(noise.black[std::min(static_cast<int>(i % image.channels), 2)]);
  glm::dvec3 saturation;
  for (int c = 0; c < 3; ++c)
    saturation[c] = (noise.saturation[c] > 0 ? noise.saturation[c] : kUnknown) - noise.black[c];
  return saturation;
}

}  // namespace crownfit
