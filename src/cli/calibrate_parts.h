#pragma once
// Shared code of the tasks of `crownfit calibrate`.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/boards.h"
#include "calibration/product.h"
#include "capture/camera.h"
#include "cli/common_options.h"
#include "photo/image_io.h"

namespace crownfit {

/// Options of every task that makes a calibration product.
struct ProductOptions {
  std::filesystem::path output;
  std::optional<std::filesystem::path> picture;
  bool json = false;
  CommonOptions common;
};

/// Adds a task with those options.
CLI::App* AddProduct(CLI::App* calibrate, ProductOptions& options, const char* name, const std::string& what);

/// Writes the file unless it was refused, and the picture; prints values, notes and refusals. Returns the exit code.
int Finish(const Product& product, const std::vector<std::filesystem::path>& inputs, const ProductOptions& options);

void AddImages(CLI::App* task, std::vector<std::filesystem::path>& images, const char* what);

struct BoardOptions {
  std::string kind;     ///< chessboard, charuco or apriltag
  std::string corners;  ///< COLUMNSxROWS
  Board board;
};

void AddBoard(CLI::App* task, BoardOptions& options);

/// The board as the options describe it. Throws InputError.
Board BoardOf(const BoardOptions& options);

/// Throws InputError when the second picture is not as large as the first.
void RequireOneSize(const Image& image, const Image& first, const std::filesystem::path& file,
                    const std::filesystem::path& first_file);

/// Throws InputError when the picture is not of the camera's size.
void RequireSizeOf(const Camera& camera, const Image& image, const std::filesystem::path& file,
                   const std::filesystem::path& camera_file);

/// Returns the file. Throws InputError naming the option if it is empty.
std::filesystem::path Required(const std::filesystem::path& file, const char* option);

/// Reads linear pictures. Throws InputError for encoded ones that are not `taken_as_linear`.
std::vector<ImageFile> ReadLinear(const std::vector<std::filesystem::path>& files, const std::string& encoding);

/// The photograph's light, by what is asked or what the file states; `transfer`, if any, says how it was decoded.
/// Throws InputError: grey, an alpha below 1, an unknown encoding.
ImageFile ReadLight(const std::filesystem::path& file, const std::string& encoding);

/// Subtracts the black level of noise.json, if given, from the photograph read of `file`; returns the saturation level
/// of each channel.
glm::dvec3 RemoveBlack(ImageFile& photo, const std::filesystem::path& file,
                       const std::optional<std::filesystem::path>& noise_file);

/// The tasks, one file each.
void AddCalibrateBlur(CLI::App& calibrate, Command& command);
void AddCalibrateCamera(CLI::App& calibrate, Command& command);
void AddCalibrateColour(CLI::App& calibrate, Command& command);
void AddCalibrateExposures(CLI::App& calibrate, Command& command);
void AddCalibrateLights(CLI::App& calibrate, Command& command);
void AddCalibrateNoise(CLI::App& calibrate, Command& command);
void AddCalibratePose(CLI::App& calibrate, Command& command);
void AddCalibrateTarget(CLI::App& calibrate, Command& command);

}  // namespace crownfit
