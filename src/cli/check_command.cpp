#include "cli/check_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/json_file.h"
#include "base/text.h"
#include "geometry/signed_distance.h"
#include "photo/image_io.h"
#include "plan/check_capture.h"
#include "report/finding_words.h"
#include "report/plain_words.h"
#include "report/sections.h"

namespace crownfit {
namespace {

std::string AsJson(const Capture& capture, const CaptureCheck& check) {
  JsonValue::Array photographs, measurements, free_names, foreseen, requirements, exact, shared;
  for (const auto& m : capture.measurements)
    measurements.push_back(JsonValue::Object{{"name", m.name}, {"use", m.is_holdout ? "holdout" : "fit"}});
  for (const auto& p : capture.photographs)
    photographs.push_back(JsonValue::Object{{"name", p.name}, {"use", p.is_holdout ? "holdout" : "fit"}});
  for (const auto& e : check.foreseen) {
    free_names.push_back(e.name);
    foreseen.push_back(capture.photographs.empty()
                           ? JsonValue::Object{{"name", e.name}, {"layered", e.by_path}}
                           : JsonValue::Object{{"name", e.name}, {"shader", e.by_shader}, {"path", e.by_path}});
  }
  for (const auto& r : check.requirements)
    requirements.push_back(JsonValue::Object{{"without", r.what},
                                             {"photograph", r.photograph},
                                             {"de00", r.de00},
                                             {"parameter", r.parameter},
                                             {"shift_in_stddevs", r.shift},
                                             {"saves_shader_s", r.shader_s},
                                             {"saves_path_s", r.path_s},
                                             {"needed", r.is_needed}});
  for (const ExactStatement& s : check.exact) {
    JsonValue::Object shifts;
    for (const auto& [parameter, share] : s.shifts) shifts.emplace_back(parameter, share);
    exact.push_back(JsonValue::Object{{"name", s.name}, {"value", s.value}, {"error", s.error}, {"shifts", shifts}});
  }
  for (const SharedScattering& s : check.shared) {
    JsonValue::Object asked{{"name", s.parameter},
                            {"shared", Word(s.law)},
                            {"stated", s.is_stated},
                            {"departure_published", s.published},
                            {"advised", s.IsAdvised()}};
    if (std::isfinite(s.told)) {
      asked.emplace_back("departure_stddev", s.told);
      asked.emplace_back("narrows", s.narrows);
      asked.emplace_back("parameter", s.narrowed);
    }
    shared.push_back(std::move(asked));
  }
  return ToJsonText(
      JsonValue::Object{{"valid", true},
                        {"photographs", photographs},
                        {"measurements", measurements},
                        {"free", free_names},
                        {"caveats", InWords(check.caveats)},
                        {"foreseen", foreseen},
                        {"weak_directions", AsVectors(check.weak_directions)},
                        {"requirements", requirements},
                        {"exact", exact},
                        {"shared", shared},
                        {"advice", check.advice},
                        {"seconds", JsonValue::Object{{"shader", check.shader_s}, {"path", check.path_s}}}});
}

/// ", 31 % of its surface outside 'enamel', by up to 0.90 mm": typical of roots, and of scans in different frames.
std::string StandsOut(const Capture& capture, const Crown& crown, size_t layer) {
  constexpr double kFew = 0.01;
  if (layer == 0) return "";
  const TriangleMesh &above = crown.surfaces[layer - 1], &own = crown.surfaces[layer];
  const RayCaster& caster = crown.casters[layer - 1];
  size_t outside = 0;
  double furthest = 0;
  for (const glm::dvec3& v : own.vertices) {
    if (IsInside(caster, above, v)) continue;
    ++outside;
    furthest = std::max(furthest, caster.DistanceToSurface(v));
  }
  const double share = static_cast<double>(outside) / static_cast<double>(own.vertices.size());
  if (share < kFew) return "";
  return Printed(", %.0f %% of its surface outside '%s', by up to %.2f mm", 100 * share,
                 capture.layers[layer - 1].name.c_str(), furthest);
}

void PrintScene(const Capture& capture, const CaptureCheck& check) {
  std::printf("%s: valid\n", capture.file.c_str());
  for (size_t i = 0; check.crown && i < capture.layers.size(); ++i)
    std::printf("  layer %-16s %8zu triangles, mean thickness %.2f mm%s\n", capture.layers[i].name.c_str(),
                check.crown->surfaces[i].triangles.size(), check.crown->thickness_mm[i],
                StandsOut(capture, *check.crown, i).c_str());
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& p = capture.photographs[i];
    std::printf("  photograph %-11s %4d x %-4d %s%s%s, %d saturated pixels in the mask; %s\n", p.name.c_str(),
                p.camera.width, p.camera.height, p.is_holdout ? "held out" : "fit", p.files.mask ? ", mask" : "",
                p.exposure_is_free ? ", exposure free" : "", check.input.photographs[i].saturated_pixels,
                check.input.photographs[i].encoding.c_str());
  }
  for (const FlatMeasurement& m : capture.measurements) {
    std::string what;
    for (const auto& [name, is_there] : {std::pair{"reflectance", m.reflectance.has_value()},
                                         {"transmittance", m.transmittance.has_value()},
                                         {"lab", m.lab.has_value()}})
      if (is_there) what += std::string(what.empty() ? "" : ", ") + name;
    std::printf("  measurement %-16s %s%s\n", m.name.c_str(), what.c_str(), m.is_holdout ? ", held out" : "");
  }
}

void PrintForeseen(const CaptureCheck& check) {
  std::printf(
      "\n%zu values are free. 95 %% intervals to expect from these %s, foreseen at the start values (a factor is upper "
      "/ lower end):\n",
      check.foreseen.size(), check.crown ? "photographs" : "measurements");
  if (check.foreseen.empty()) {
    std::printf("  none: a fit would only compare. Write {\"initial\": v} for each parameter that is to be fitted.\n");
    return;
  }
  if (check.crown) std::printf("  %-52s %-30s %s\n", "", "model shader, with its error", "model path");
  for (const auto& e : check.foreseen)
    std::printf("  %-52s %-*s %s\n", e.name.c_str(), check.crown ? 30 : 0, e.by_shader.c_str(), e.by_path.c_str());
  if (check.crown)
    std::printf(
        "  estimated time on two cores, at most: %.0f s by shader, %.0f s by path. `crownfit fit` begins with shader "
        "and\n"
        "  continues with path if needed.\n",
        check.shader_s, check.path_s);
  for (const auto& direction : check.weak_directions)
    std::printf("  Hardly determined: %s\n", InWords(direction).c_str());
  if (check.crown)
    std::printf("  %s\n", check.advice.empty()
                              ? "One more photograph with this rig would not narrow the intervals much."
                              : check.advice.c_str());
}

void PrintRequirements(const CaptureCheck& check) {
  if (check.requirements.empty()) return;
  std::printf(
      "\nWhat the scene requires. Without each part: change of the picture (CIEDE2000), seconds that a fit saves (by "
      "shader,\n"
      "by path), and error of the fitted values:\n");
  size_t width = 0;
  for (const auto& r : check.requirements) width = std::max(width, r.what.size());
  for (const auto& r : check.requirements)
    std::printf("  %-*s %6.2f in '%s'%*s %5.1f s %5.1f s %8.2g standard deviations of %s%s\n", static_cast<int>(width),
                r.what.c_str(), r.de00, r.photograph.c_str(), std::max(0, 14 - static_cast<int>(r.photograph.size())),
                "", r.shader_s, r.path_s, r.shift, r.parameter.c_str(), r.is_needed ? "" : "  (not needed)");
}

std::string LawInWords(const SharedScattering& s) {
  if (s.law == Sharing::kOneValue) return s.is_stated ? "one value, as stated" : "one value instead of a power law";
  return s.is_stated ? "a power law, as stated" : "a power law instead of three values";
}

void PrintShared(const CaptureCheck& check) {
  if (check.shared.empty()) return;
  std::printf(
      "\nScattering that channels may share. A law for all channels has fewer numbers to fit. It improves all fitted "
      "values if\n"
      "the material departs from it by less than the data could detect (one standard deviation, worst channel); "
      "otherwise\n"
      "it makes them worse:\n");
  for (const SharedScattering& s : check.shared) {
    const std::string told =
        !std::isfinite(s.told)
            ? "no departure could be detected: share it"
            : "detectable from " + Number(100 * s.told, 2) + " %, published teeth depart by about " +
                  Number(100 * s.published, 2) + " %: " + (s.IsAdvised() ? "share it" : "do not share it") +
                  Printed("; sharing makes the interval of %s %.2f times narrower", s.narrowed.c_str(), s.narrows);
    std::printf("  %-34s %-35s %s\n", s.parameter.c_str(), LawInWords(s).c_str(), told.c_str());
  }
  std::printf("  To change it for one fit: crownfit fit --share NAME=none, NAME=power_law or NAME=channels.\n");
}

void PrintExact(const CaptureCheck& check) {
  if (check.exact.empty()) return;
  std::printf(
      "\nValues that the capture states as exact. If one is off by the amount shown, the fitted values are off by "
      "about the\n"
      "percentages shown. Intervals do not include this error, and the photographs may not show it:\n");
  for (const ExactStatement& s : check.exact) {
    std::string shifts;
    for (const auto& [parameter, share] : s.shifts)
      shifts +=
          (shifts.empty() ? "" : ", ") + parameter + (share > 1 ? " over 100" : " " + Number(100 * share, 2)) + " %";
    std::printf("  %-28s %-8s off by %-6s %s\n", s.name.c_str(), Number(s.value).c_str(), s.error.c_str(),
                shifts.c_str());
  }
  std::printf("  (Errors of a fixed g or roughness are not included either; this model can't foresee their effect.)\n");
  std::printf("  If a value is not exact, write {\"initial\": v, \"prior\": {\"mean\": v, \"log_stddev\": s}}.\n");
}

}  // namespace

int RunCheck(const CheckCommand& asked) {
  Progress progress(asked.common.progress);
  const Capture capture = ReadCapture(asked.capture);
  FitOptions options;
  options.threads = asked.common.threads;
  const CaptureCheck check = CheckCapture(capture, options, progress);
  if (!asked.output.empty()) {
    RequirePhotographs(capture);
    std::vector<std::string> names;
    for (const auto& layer : capture.layers) names.push_back(layer.name);
    WriteImageFile(asked.output, SectionFigure(check.crown->surfaces, names, options.threads));
  }
  progress.Clear();
  PrintNotes(check.input.source.messages);
  for (const auto& caveat : InWords(check.caveats)) std::fprintf(stderr, "warning: %s\n", caveat.c_str());
  if (asked.json) {
    std::fputs(AsJson(capture, check).c_str(), stdout);
    return 0;
  }
  PrintScene(capture, check);
  PrintForeseen(check);
  PrintRequirements(check);
  PrintShared(check);
  PrintExact(check);
  return 0;
}

void AddCheck(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<CheckCommand>();
  auto* check = app.add_subcommand(
      "check", "Checks a capture and all its files, and foresees what a fit would find. It fits nothing.");
  check->footer(
      "Prints for every free value the interval to expect, which parts of the scene matter, what errors of fixed "
      "values do,\n"
      "and which photograph to take next.\n\n"
      "Example:\n"
      "  crownfit check crown -o slices.png\n"
      "Look at slices.png: the layers must lie inside each other as in the crown.");
  check->add_option("CAPTURE", asked->capture, "Folder that holds capture.json, or that file.")->required();
  check->add_option("-o,--output", asked->output, "PNG with slices through the layers, to look at.");
  check->add_flag("--json", asked->json, "Print the result as JSON.");
  AddCommonOptions(check, asked->common);
  RunWith(check, command, asked, RunCheck);
}

}  // namespace crownfit
