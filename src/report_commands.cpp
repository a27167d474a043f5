#include <cstdio>

#include "base/error.h"
#include "base/files.h"
#include "calibration/colour_file.h"
#include "commands.h"
#include "prediction_file.h"
#include "report/report_files.h"

namespace crownfit {
namespace {

/// Camera colours as the capture states them, if it does; what shows as white is a white surface.
void WriteColour(const std::filesystem::path& folder, const Capture& capture) {
  for (const PhotographSpec& p : capture.photographs) {
    if (!p.has_colour_file) continue;
    const glm::dvec3 white = BandColour{p.rgb_from_sensor}.Reflectance(glm::dvec3(1.0));
    JsonValue::Object content{{"format", "crownfit-colour/1"}};
    for (auto& member : ColourContent({p.rgb_from_sensor, white})) content.push_back(std::move(member));
    return WriteTextFile(folder / "colour.json", ToJsonText(content));
  }
}

}  // namespace

void WriteResultWithPage(const CommandLine& line, const std::filesystem::path& folder, const CrownFit& fit,
                         const RunRecord& run, Progress& progress) {
  WriteColour(folder, fit.capture);
  WriteResult(folder, fit, run);
  try {
    WritePrediction(line, folder, progress);
  } catch (const InputError& e) {
    WriteWhyNoPrediction(folder, e.what());
  }
  WriteReportPage(folder);
}

int RunReport(const CommandLine& line) {
  if (line.predict.is_asked) {
    Progress progress(line.progress);
    WritePrediction(line, line.output, progress);
  }
  std::printf("%s\n", WriteReportPage(line.output).c_str());
  return 0;
}

}  // namespace crownfit
