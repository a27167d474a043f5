#pragma once
// What the calibration commands share.

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibrate/product.h"
#include "calibration/camera.h"
#include "command_line.h"
#include "photo/image_io.h"

namespace crownfit {

/// Writes the file unless it was refused, and the picture; prints figures, notes and refusals. The exit code.
int Finish(const Product& product, const std::vector<std::filesystem::path>& inputs, const CommandLine& line);

/// Throws InputError when the second picture is not as large as the first.
void RequireOneSize(const Image& image, const Image& first, const std::filesystem::path& file,
                    const std::filesystem::path& first_file);

/// Throws InputError when the picture is not of the camera's size.
void RequireSizeOf(const Camera& camera, const Image& image, const std::filesystem::path& file,
                   const std::filesystem::path& camera_file);

/// The file. Throws InputError naming the option where it is empty.
std::filesystem::path Required(const std::filesystem::path& file, const char* option);

/// NAME=FILE.
std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option);

/// Linear pictures. Throws InputError for encoded ones that are not to be taken as linear.
std::vector<ImageFile> ReadLinear(const std::vector<std::filesystem::path>& files, bool taken_as_linear);

/// Subtracts the black level of noise.json, where one is given; the levels from which its channels are saturated.
glm::dvec3 RemoveBlack(Image& image, const std::optional<std::filesystem::path>& noise_file);

/// Measures of the camera's values and of the lamps; those of its geometry stand in calibrate_commands.cpp.
int CalibrateNoise(const CommandLine& line);
int MergeSeries(const CommandLine& line);
int CalibrateBlur(const CommandLine& line);
int CalibrateColour(const CommandLine& line);
int CalibrateLights(const CommandLine& line);

}  // namespace crownfit
