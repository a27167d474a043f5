#include "report/report_files.h"

#include <algorithm>
#include <cmath>

#include "base/files.h"
#include "base/json_file.h"
#include "capture/capture.h"
#include "fit/fit_result.h"
#include "photo/figures.h"
#include "photo/image_io.h"
#include "report/plain_words.h"
#include "report/zones.h"

namespace crownfit {
namespace {

std::vector<double> List(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

double InItsUnit(const FreeEntry& e, double v) { return e.scale == Scale::kLog ? std::exp(v) : v; }

JsonValue EntriesJson(const CrownFit& fit) {
  JsonValue::Array entries;
  for (size_t k = 0; k < fit.entries.size(); ++k) {
    const FreeEntry& e = fit.entries[k];
    entries.push_back(
        JsonValue::Object{{"name", e.name},
                          {"unit", e.role == FreeEntry::Role::kPowerExponent ? "1" : RowOf(e.quantity).unit},
                          {"scale", e.scale == Scale::kLog ? "log" : "linear"},
                          {"value", InItsUnit(e, fit.best[static_cast<Eigen::Index>(k)])}});
  }
  return entries;
}

const char* Word(LikelihoodProfile::By by) {
  switch (by) {
    case LikelihoodProfile::By::kParabola:
      return "parabola";
    case LikelihoodProfile::By::kFits:
      return "fits";
    case LikelihoodProfile::By::kSlopes:
      return "slopes";
  }
  return "";
}

JsonValue ProfilesJson(const CrownFit& fit) {
  JsonValue::Array profiles;
  for (const LikelihoodProfile& p : fit.profiles) {
    std::vector<double> at;
    for (const double v : p.at) at.push_back(InItsUnit(fit.entries[p.entry], v));
    profiles.push_back(JsonValue::Object{
        {"entry", fit.entries[p.entry].name}, {"by", Word(p.by)}, {"value", at}, {"delta_chi2", p.delta_chi2}});
  }
  return profiles;
}

JsonValue ConvergenceJson(const CrownFit& fit) {
  JsonValue::Array shader, walks;
  for (const ShaderIteration& i : fit.iterations_by_shader)
    shader.push_back(JsonValue::Object{{"cast", i.cast}, {"reduced_chi2", i.reduced_chi2}});
  for (const WalkedFitStep& s : fit.steps)
    walks.push_back(
        JsonValue::Object{{"stage", s.stage}, {"reduced_chi2", s.reduced_chi2}, {"block_chi2", s.block_chi2}});
  return JsonValue::Object{{"shader", shader}, {"walks", walks}};
}

JsonValue ZonesJson(const PhotographResult& p) {
  JsonValue::Array zones;
  for (const ZoneDifference& z : ZonesOf(p))
    zones.push_back(JsonValue::Object{{"zone", z.zone},
                                      {"pixels", static_cast<double>(z.difference.pixels)},
                                      {"de00_of_means", z.off_de00},
                                      {"de00_median", z.difference.median},
                                      {"photograph_lab", List(z.difference.photograph_lab)},
                                      {"off_lab", List(z.off_lab)},
                                      {"prediction_is", DifferenceWords(z.off_lab)}});
  return zones;
}

std::string TitleOf(const CrownFit& fit) {
  std::string title;
  for (const TogetherWith& t : fit.together) title += (title.empty() ? "" : " + ") + t.name;
  return title.empty() ? std::filesystem::weakly_canonical(fit.capture.folder).filename().string() : title;
}

Image Cropped(const Image& image, const PixelBox& box) {
  Image part(box.x1 - box.x0, box.y1 - box.y0, image.channels);
  for (int y = 0; y < part.height; ++y)
    std::copy_n(&image.values[(static_cast<size_t>(box.y0 + y) * image.width + box.x0) * image.channels],
                static_cast<size_t>(part.width) * image.channels,
                &part.values[static_cast<size_t>(y) * part.width * image.channels]);
  return part;
}

/// Nearest-pixel resampling: colours of a legend must not be mixed.
Image Picked(const Image& image, int width, int height) {
  Image picked(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c)
        picked.at(x, y, c) =
            image.at((2 * x + 1) * image.width / (2 * width), (2 * y + 1) * image.height / (2 * height), c);
  return picked;
}

/// Writes a photograph's pictures and returns their paths.
JsonValue WritePictures(const std::filesystem::path& folder, const PhotographResult& p, double most_pixels) {
  const PixelBox box = BoxAround(p.difference.map);
  const double w = box.x1 - box.x0, h = box.y1 - box.y0, shrink = std::min(1.0, std::sqrt(most_pixels / (w * h)));
  const int width = std::max(1, static_cast<int>(w * shrink)), height = std::max(1, static_cast<int>(h * shrink));
  const double scale = ComparisonScale(p.photograph, p.compared, p.rgb_from_sensor);
  JsonValue::Object files;
  const auto write = [&](const char* what, const char* extension, const Image& picture) {
    const std::string file = "report/" + p.name + "_" + what + extension;
    WriteImageFile(folder / file, picture);
    files.emplace_back(what, file);
  };
  const auto small = [&](const Image& linear) {
    const Image part = Cropped(linear, box);
    return DisplayPicture(shrink < 1 ? Resized(part, width, height) : part, scale, p.rgb_from_sensor);
  };
  write("photograph", ".jpg", small(p.photograph));
  write("prediction", ".jpg", small(p.prediction));
  write("difference", ".png", Picked(Cropped(DifferenceColours(p.difference, glm::vec3(0.85f)), box), width, height));
  files.emplace_back("width", width);
  files.emplace_back("height", height);
  return files;
}

}  // namespace

void WriteReportFiles(const std::filesystem::path& folder, const CrownFit& fit) {
  // At 1.2 bytes a pixel for all three pictures in base64, a page stays below 5 MB for any number of photographs.
  constexpr double kPagePixels = 3.5e6, kPicturePixels = 3.5e5;
  const double most_pixels =
      std::min(kPicturePixels, kPagePixels / std::max(1.0, static_cast<double>(fit.photographs.size())));
  JsonValue::Array photographs, legend;
  for (const PhotographResult& p : fit.photographs)
    photographs.push_back(JsonValue::Object{{"name", p.name},
                                            {"use", p.is_holdout ? "holdout" : "fit"},
                                            {"pictures", WritePictures(folder, p, most_pixels)},
                                            {"compared_pixels", static_cast<double>(p.difference.pixels)},
                                            {"saturated_pixels", p.saturated_pixels},
                                            {"level", p.level},
                                            {"zones", ZonesJson(p)}});
  for (const DifferenceStep& step : kDifferenceSteps)
    legend.push_back(JsonValue::Object{{"label", step.label}, {"rgb", List(glm::dvec3(step.colour))}});
  const PlainVerdict verdict = PlainVerdictOf(fit);
  WriteTextFile(folder / "report.json",
                ToJsonText(JsonValue::Object{{"format", "crownfit-report/1"},
                                             {"title", TitleOf(fit)},
                                             {"headline", verdict.headline},
                                             {"sentences", verdict.sentences},
                                             {"photographs_that_would_help", verdict.photographs_that_would_help},
                                             {"photographs", photographs},
                                             {"difference_legend", legend},
                                             {"entries", EntriesJson(fit)},
                                             {"profiles", ProfilesJson(fit)},
                                             {"convergence", ConvergenceJson(fit)}}));
}

}  // namespace crownfit
