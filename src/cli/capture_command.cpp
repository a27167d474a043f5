#include <cstdio>
#include <sstream>

#include "capture/init_capture.h"
#include "cli/check_command.h"
#include "cli/named_file.h"
#include "exchange/init_measurements.h"

namespace crownfit {
namespace {

struct InitCommand {
  std::filesystem::path output;
  CaptureParts parts;
  std::vector<std::string> meshes, photographs, masks, lit, polarisation;  ///< NAME=FILE, NAME=LIGHT,LIGHT, NAME=FILTER
  CommonOptions common;
};

struct MeasuredCommand {
  std::filesystem::path output;
  MeasuredParts parts;
  CommonOptions common;
};

int CheckWhatWasMade(const std::filesystem::path& folder, const CommonOptions& common) {
  std::printf("Written: %s\n\n", (folder / "capture.json").c_str());
  return RunCheck({folder, {}, false, common});
}

int RunInit(const InitCommand& asked) {
  CaptureParts parts = asked.parts;
  for (const auto& text : asked.meshes) parts.meshes.push_back(NamedFile(text, "--mesh"));
  for (const auto& text : asked.photographs) parts.photographs.push_back(NamedFile(text, "--photo"));
  for (const auto& text : asked.masks) parts.masks.push_back(NamedFile(text, "--mask"));
  for (const auto& text : asked.polarisation) {
    const auto [name, filter] = NamedFile(text, "--polarisation");
    parts.polarisation.emplace_back(name, filter.string());
  }
  for (const auto& text : asked.lit) {
    const auto [name, list] = NamedFile(text, "--lit");
    std::vector<std::string> lights;
    std::istringstream words(list.string());
    for (std::string light; std::getline(words, light, ',');) lights.push_back(light);
    parts.lit.emplace_back(name, lights);
  }
  InitCapture(parts, asked.output);
  std::printf("Index and g of every layer were taken by its name. Correct them in %s where you know better.\n",
              (std::filesystem::path(asked.output) / "capture.json").c_str());
  return CheckWhatWasMade(asked.output, asked.common);
}

int RunMeasured(const MeasuredCommand& asked) {
  InitMeasuredCapture(asked.parts, asked.output);
  return CheckWhatWasMade(asked.output, asked.common);
}

}  // namespace

void AddCapture(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<InitCommand>();
  const auto measured_asked = std::make_shared<MeasuredCommand>();
  auto* capture = app.add_subcommand(
      "capture",
      "Makes captures, of photographs or of an instrument's readings: see crownfit capture init --help and\n"
      "crownfit capture measured --help.");
  capture->require_subcommand(1);
  auto* measured = capture->add_subcommand(
      "measured",
      "A capture of measurements alone, from iad's file of total reflectance and transmittance (.rxt), and checks it:\n"
      "scattering and absorption free, index and g fixed, a measurement for each thickness. docs/measurements.md.");
  MeasuredParts& m = measured_asked->parts;
  measured->add_option("FILE", m.file, "The .rxt file; its readings must need no correction for a sphere.")->required();
  measured->add_option("-o,--output", measured_asked->output, "The capture's folder (made when missing).")->required();
  measured
      ->add_option("--wavelengths", m.wavelengths_nm,
                   "NM,NM,NM: of the three bands, or one for all (default 600,540,450). Between the file's own the "
                   "readings are interpolated.")
      ->delimiter(',');
  measured
      ->add_option("--rows", m.rows,
                   "N,N,N: rows of a file without wavelengths that are taken as the bands, or one for all, from 1.")
      ->delimiter(',');
  measured
      ->add_option("--stddev", m.stddev,
                   "Of every reading, repeatability and calibration together (default 0.005). Intervals rest on it.")
      ->check(CLI::Range(1e-7, 0.5));
  measured->add_option("--g", m.asymmetry, "Mean cosine of scattering, where the file has no column g (default 0.8).")
      ->check(CLI::Range(-0.99, 0.99));
  measured->add_option("--layer", m.layer, "Name of the material (default sample).");
  AddCommonOptions(measured, measured_asked->common);
  RunWith(measured, command, measured_asked, RunMeasured);

  auto* init = capture->add_subcommand(
      "init",
      "Gathers meshes, photographs and calibration products into a folder with capture.json, and checks it. "
      "Scattering,\n"
      "absorption and roughness are left free, exposures fixed to 1; edit capture.json for the rest.");
  CaptureParts& parts = asked->parts;
  init->add_option("-o,--output", asked->output, "The capture's folder (made when missing).")->required();
  init->add_option("--mesh", asked->meshes,
                   "LAYER=FILE: surface of a layer in mm, such as enamel=crown.stl; outermost first.")
      ->take_all()
      ->required();
  init->add_option("--layer", parts.more_layers, "A further layer inside, without a mesh, such as dentine.")
      ->take_all();
  init->add_option("--thickness-mm", parts.thickness_mm, "Of the layer above such a one (default 0.8).")
      ->check(CLI::PositiveNumber);
  init->add_option("--photo", asked->photographs, "NAME=FILE: a photograph; repeat it.")->take_all()->required();
  init->add_option("--camera", parts.camera, "camera.json of `crownfit calibrate camera`.")->required();
  init->add_option("--poses", parts.poses,
                   "poses.json of `crownfit calibrate pose`; poses are found by the files' names.")
      ->required();
  init->add_option("--lights", parts.lights, "light_rig.json of `crownfit calibrate lights`.")->required();
  init->add_option("--lit", asked->lit, "NAME=LIGHT,LIGHT: the lights that were on (default: all).")->take_all();
  init->add_option("--polarisation", asked->polarisation, "NAME=none, cross or parallel.")->take_all();
  init->add_option("--mask", asked->masks, "NAME=FILE: use only where this picture is above 0.5.")->take_all();
  init->add_option("--noise", parts.noise, "noise.json of `crownfit calibrate noise`.");
  init->add_option("--colour", parts.colour, "colour.json of `crownfit calibrate colour`.");
  init->add_option("--blur", parts.blur, "blur.json of `crownfit calibrate blur`.");
  init->add_option("--holdout", parts.holdouts, "NAME of a photograph that the fit is not to see.")->take_all();
  AddCommonOptions(init, asked->common);
  init->add_flag("--exposure-free", parts.exposure_is_free,
                 "Exposures are unknown: no card gave the lights' intensity.");
  RunWith(init, command, asked, RunInit);
}

}  // namespace crownfit
