// Commands that measure a camera's values: noise, exposures, blur, colour.

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/files.h"
#include "base/progress.h"
#include "calibrate/colour_product.h"
#include "calibrate/estimate_blur.h"
#include "calibrate/exposure_series.h"
#include "calibrate/find_chart.h"
#include "calibrate/noise_product.h"
#include "calibrate_steps.h"
#include "photo/photograph.h"

namespace crownfit {

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

void RequireOneSize(const Image& image, const Image& first, const std::filesystem::path& file,
                    const std::filesystem::path& first_file) {
  if (image.width == first.width && image.height == first.height && image.channels == first.channels) return;
  const auto size = [](const Image& i) {
    return std::to_string(i.width) + " x " + std::to_string(i.height) + " pixels of " + std::to_string(i.channels);
  };
  throw InputError(file, "",
                   "has " + size(image) + " channels, but " + first_file.filename().string() + " has " + size(first),
                   "Give photographs of one camera at one setting, none cropped or scaled.");
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
  if (file.empty()) throw InputError("", option, "this option is needed here");
  return file;
}

std::pair<std::string, std::filesystem::path> NamedFile(const std::string& text, const char* option) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw InputError("", option, "expected NAME=FILE, such as left=ball_left.dng, found '" + text + "'");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<ImageFile> ReadLinear(const std::vector<std::filesystem::path>& files, bool taken_as_linear) {
  std::vector<ImageFile> photos;
  for (const auto& file : files) {
    photos.push_back(ReadImageFile(file));
    if (photos.back().is_srgb_encoded && !taken_as_linear)
      throw InputError(
          file, "", "is encoded for display: after a camera's tone curve its values are not proportional to the light",
          "Give RAW files, or say --linear when the values are proportional to the light.");
    RequireOneSize(photos.back().image, photos[0].image, file, files[0]);
  }
  return photos;
}

glm::dvec3 RemoveBlack(Image& image, const std::optional<std::filesystem::path>& noise_file) {
  constexpr double kUnknown = 0.98;
  if (!noise_file) return glm::dvec3(kUnknown);
  const SensorNoise noise = ReadSensorNoise(*noise_file);
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] -= static_cast<float>(noise.black[std::min<size_t>(i % image.channels, 2)]);
  glm::dvec3 saturation;
  for (int c = 0; c < 3; ++c) saturation[c] = noise.saturation[c].value_or(kUnknown) - noise.black[c];
  return saturation;
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
  bool any_compared = false;
  for (size_t k = 0; k < merged.time_ratios.size(); ++k) {
    const std::string times = Text(series.times[k + 1]) + "_to_" + Text(series.times[k]);
    any_compared |= merged.time_ratios[k].has_value();
    if (merged.time_ratios[k])
      product.figures.push_back({"ratio_" + times + "_over_times", *merged.time_ratios[k], ""});
    else
      product.notes.push_back("exposures " + times +
                              ": none of the longer one's values lies between 0.15 and half of " +
                              "saturation, so their times could not be checked.");
  }
  product.figures.push_back({"nonlinearity", 100 * merged.worst_ratio, "%"});
  product.figures.push_back({"shift", merged.shift_px, "px"});
  product.figures.push_back({"saturated_in_all", 100 * merged.share_saturated, "% of pixels"});
  if (merged.worst_ratio > 0.1)
    product.refusals.push_back(
        "exposures differ by " + Text(100 * merged.worst_ratio, "%") +
        " from what their times let expect: are the times right, did the light drift, are the files "
        "linear?");
  else if (!any_compared)
    product.refusals.push_back("no two exposures can be compared: are the times right, is the picture too dark?");
  else if (merged.worst_ratio > 0.03)
    product.notes.push_back("exposures depart by " + Text(100 * merged.worst_ratio, "%") + " from their times.");
  constexpr double kMoved = 1.0, kSeen = 0.2;  // px
  if (merged.shift_px > kMoved)
    product.refusals.push_back("two exposures are shifted by about " + Text(merged.shift_px, "px") +
                               ": the camera or the scene moved. Use a tripod and a remote release.");
  else if (merged.shift_px > kSeen)
    product.notes.push_back("two exposures are shifted by " + Text(merged.shift_px, "px") +
                            ": edges are blurred by it.");
  if (merged.share_saturated > 0)
    product.notes.push_back("what is saturated in every exposure has its lowest value: state \"saturation\": " +
                            Text(0.99 * merged.saturation) + " for this picture in the capture.");
  if (product.refusals.empty()) {
    const std::filesystem::path variance = line.output.stem().string() + "_variance.exr";
    WriteImageFile(line.output, merged.linear);
    WriteImageFile(line.output.parent_path() / variance, merged.variance);
  }
  return Finish(product, files, line);
}

namespace {

/// The part of a picture from (x, y) on.
Image Part(const Image& image, int x0, int y0, int width, int height) {
  Image part(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c) part.at(x, y, c) = image.at(x0 + x, y0 + y, c);
  return part;
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

}  // namespace

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
  glm::dvec3 saturation = RemoveBlack(linear, line.calibrate.noise);
  if (line.calibrate.flat_field) {
    Image card = ReadImageFile(*line.calibrate.flat_field).image;
    RequireOneSize(card, linear, *line.calibrate.flat_field, path);
    if (encoded)
      for (float& v : card.values) v = static_cast<float>(LinearFromSrgb(v));
    const auto is_saturated = [&, saturation](const Image& image, size_t i) {
      return image.values[i] >= saturation[std::min(2, static_cast<int>(i % image.channels))];
    };
    RemoveBlack(card, line.calibrate.noise);
    size_t clipped = 0;
    for (size_t i = 0; i < card.values.size(); ++i) clipped += is_saturated(card, i);
    if (const double share = 100.0 * static_cast<double>(clipped) / static_cast<double>(card.values.size());
        share > 0.1)
      throw InputError(*line.calibrate.flat_field, "--flat-field", Text(share, "%") + " of its values are saturated",
                       "Expose the white card to half of full scale.");
    for (size_t i = 0; i < linear.values.size(); ++i)
      if (is_saturated(linear, i)) linear.values[i] = 1e9f;  // still to be seen when the card has changed its value
    Flatten(linear, card);
    saturation = glm::dvec3(1e6);
  }
  const ColourSource source{&linear, encoded, photo.is_jpeg};
  if (const auto& r = line.calibrate.grey_card; !r.empty())
    return Finish(GreyCardProduct(linear, {r[0], r[1], r[2], r[3]}, line.calibrate.card_reflectance.value_or(0.18),
                                  saturation, source),
                  line.calibrate.images, line);
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
  return Finish(ColourProduct(chart, readings, source), line.calibrate.images, line);
}

}  // namespace crownfit
