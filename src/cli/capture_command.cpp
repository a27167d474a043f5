#include <charconv>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "base/error.h"
#include "capture/init_capture.h"
#include "cli/check_command.h"
#include "cli/named_file.h"
#include "exchange/import_capture.h"
#include "exchange/init_measurements.h"
#include "exchange/opencv_file.h"

namespace crownfit {
namespace {

struct InitCommand {
  std::filesystem::path output;
  CaptureParts parts;
  std::vector<std::string> channels;                                       ///< NAME=NM
  std::vector<std::string> meshes, photographs, masks, lit, polarisation;  ///< NAME=FILE, NAME=LIGHT,LIGHT, NAME=FILTER
  CommonOptions common;
};

struct ImportCommand {
  std::filesystem::path output;
  ImportParts parts;
  std::vector<std::string> meshes;    ///< NAME=FILE
  std::vector<std::string> channels;  ///< NAME=NM
  std::string scale_from;             ///< X,Y,Z:X,Y,Z=MM
  CommonOptions common;
};

struct MeasuredCommand {
  std::filesystem::path output;
  MeasuredParts parts;
  CommonOptions common;
};

/// "450nm=450" as a channel and its wavelength.
std::vector<std::pair<std::string, double>> ChannelsOf(const std::vector<std::string>& texts) {
  std::vector<std::pair<std::string, double>> channels;
  for (const std::string& text : texts) {
    const auto [name, file] = NamedFile(text, "--channel");
    const std::string number = file.string();
    double nm = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), nm);
    if (error != std::errc() || end != number.data() + number.size())
      throw InputError("", "--channel " + text, "'" + number + "' is no wavelength in nm", "Write NAME=NM.");
    channels.emplace_back(name, nm);
  }
  return channels;
}

void AddChannels(CLI::App* command, std::vector<std::string>& channels) {
  command
      ->add_option("--channel", channels,
                   "NAME=NM: a channel and its wavelength. Repeatable, in the order of the pictures' planes (default:\n"
                   "R, G and B).")
      ->take_all();
}

/// Makes a folder by `make`; where that fails, it leaves none behind that was not there before.
template <class Make>
void InNewFolder(const std::filesystem::path& folder, const Make& make) {
  std::error_code ignored;
  const bool was_there = std::filesystem::exists(folder, ignored);
  try {
    make();
  } catch (...) {
    if (!was_there) std::filesystem::remove_all(folder, ignored);
    throw;
  }
}

int CheckWhatWasMade(const std::filesystem::path& folder, const CommonOptions& common) {
  std::printf("Written: %s\n\n", (folder / "capture.json").c_str());
  return RunCheck({folder, {}, false, common});
}

int RunInit(const InitCommand& asked) {
  CaptureParts parts = asked.parts;
  parts.channels = ChannelsOf(asked.channels);
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
  if (IsOpenCvFile(parts.camera)) parts.known_camera = ReadOpenCvCalibration(parts.camera).camera;
  InNewFolder(asked.output, [&] { InitCapture(parts, asked.output); });
  std::printf(
      "Refractive index and g of each layer were chosen by its name. Correct them in %s if you know them better.\n",
      (std::filesystem::path(asked.output) / "capture.json").c_str());
  return CheckWhatWasMade(asked.output, asked.common);
}

int RunMeasured(const MeasuredCommand& asked) {
  InNewFolder(asked.output, [&] { InitMeasuredCapture(asked.parts, asked.output); });
  return CheckWhatWasMade(asked.output, asked.common);
}

/// The views of a calibration by OpenCV. Where it does not name photographs, its rows are those of the folder in the
/// order of their names.
std::vector<ImportedView> ViewsOfOpenCv(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const OpenCvCalibration calibration = ReadOpenCvCalibration(file);
  const size_t count = calibration.camera_from_board.size();
  if (count == 0)
    throw InputError(file, "extrinsic_parameters", "this key is missing: the file has a camera, but no poses",
                     "Find them by `crownfit calibrate pose ... --camera " + file.string() +
                         "`, and give both to `crownfit capture init`.");
  std::vector<std::string> names = calibration.photographs;
  if (names.empty()) {
    names = PhotographsIn(folder);
    if (names.size() != count)
      throw InputError(file, "extrinsic_parameters",
                       "has " + std::to_string(count) + " rows and names no photographs, and " + folder.string() +
                           " holds " + std::to_string(names.size()),
                       "Give a folder of just these photographs, or list them as image_names.");
    std::printf("%s names no photographs: its rows were taken for those of %s in the order of their names.\n",
                file.c_str(), folder.c_str());
  }
  std::vector<ImportedView> views;
  for (size_t k = 0; k < count; ++k) views.push_back({names[k], calibration.camera, calibration.camera_from_board[k]});
  return views;
}

int RunImport(const ImportCommand& asked) {
  ImportParts parts = asked.parts;
  parts.capture.channels = ChannelsOf(asked.channels);
  for (const auto& text : asked.meshes) parts.capture.meshes.push_back(NamedFile(text, "--mesh"));
  if (!asked.scale_from.empty()) parts.mm_per_unit = ScaleFromPoints(asked.scale_from);
  const std::filesystem::path& source = parts.sources[0];
  if (parts.photographs.empty())
    parts.photographs = std::filesystem::is_directory(source) ? source : source.parent_path();
  if (IsOpenCvFile(source)) parts.views = ViewsOfOpenCv(source, parts.photographs);
  std::vector<std::string> left_out;
  InNewFolder(asked.output, [&] { left_out = ImportCapture(parts, asked.output); });
  if (!left_out.empty())
    std::printf("%zu photographs of the source are not in %s and were left out, such as %s.\n", left_out.size(),
                parts.photographs.c_str(), left_out[0].c_str());
  return CheckWhatWasMade(asked.output, asked.common);
}

void AddImport(CLI::App& capture, Command& command) {
  const auto asked = std::make_shared<ImportCommand>();
  ImportParts& parts = asked->parts;
  auto* import = capture.add_subcommand(
      "import", "Makes a capture of photographs whose cameras and poses another program found, and checks it.");
  import->footer(
      "Reads a sparse model of COLMAP (.bin or .txt), transforms.json of NeRF programs, and scenes of Mitsuba 3 (.xml, "
      "or\n"
      "a folder of them). A scene brings the object's meshes, material and lamps with it. Meshes and lights that you "
      "give\n"
      "are in millimetres and in the source's axes. A light named like a photograph is on in it alone. docs/import.md\n"
      "lists axes, camera models and what is refused.\n\n"
      "Examples:\n"
      "  crownfit capture import sparse/0 -o crown --photographs images --mm-per-unit 12.4 \\\n"
      "    --mesh enamel=crown.ply --lights light_rig.json\n"
      "  crownfit capture import mitsuba_scenes -o crown --photographs images");
  import
      ->add_option("SOURCE", parts.sources,
                   "Folder of COLMAP's sparse model, transforms.json, scenes of Mitsuba 3, or a calibration by OpenCV.")
      ->required();
  import->add_option("-o,--output", asked->output, "Folder of the capture; it is created if missing.")->required();
  import->add_option("--photographs", parts.photographs,
                     "Folder of the photographs (default: that of SOURCE). They are found by their names, with or\n"
                     "without folder and ending.");
  auto* unit = import
                   ->add_option("--mm-per-unit", parts.mm_per_unit,
                                "Millimetres of one unit of the source's lengths, from a length you know (default 1).")
                   ->check(CLI::PositiveNumber);
  import
      ->add_option("--scale-from", asked->scale_from,
                   "X,Y,Z:X,Y,Z=MM: the same from two points in the source's unit and their distance in mm.")
      ->excludes(unit);
  import
      ->add_option("--mesh", asked->meshes,
                   "LAYER=FILE: as in `capture init`. Repeatable, outermost layer first. Needed unless a scene has\n"
                   "the object.")
      ->take_all();
  import->add_option("--layer", parts.capture.more_layers, "A further layer inside, without a mesh. Repeatable.")
      ->take_all();
  import
      ->add_option("--thickness-mm", parts.capture.thickness_mm,
                   "Thickness in mm of the layer above a layer without a mesh (default 0.8).")
      ->check(CLI::PositiveNumber);
  import->add_option("--lights", parts.capture.lights,
                     "Light rig (crownfit-light-rig/1). Needed unless a scene has lamps, which it replaces.");
  import->add_option("--noise", parts.capture.noise, "noise.json of `crownfit calibrate noise`.");
  import->add_option("--colour", parts.capture.colour, "colour.json of `crownfit calibrate colour`.");
  import
      ->add_option("--holdout", parts.capture.holdouts,
                   "NAME of a photograph that is not fitted, but compared with its prediction. Repeatable.")
      ->take_all();
  AddChannels(import, asked->channels);
  import->add_flag("--exposure-free", parts.capture.exposure_is_free, "Free the exposures.");
  AddCommonOptions(import, asked->common);
  RunWith(import, command, asked, RunImport);
}

}  // namespace

void AddCapture(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<InitCommand>();
  const auto measured_asked = std::make_shared<MeasuredCommand>();
  auto* capture = app.add_subcommand("capture",
                                     "Makes a capture from photographs (init), another program's cameras (import) or "
                                     "an instrument's readings\n(measured).");
  capture->require_subcommand(1);
  capture->footer(
      "Examples:\n"
      "  crownfit capture init -o crown --mesh enamel=crown.stl --photo front=front.dng --camera camera.json \\\n"
      "    --poses poses.json --lights light_rig.json\n"
      "  crownfit capture measured ceramic.rxt -o ceramic");
  auto* measured = capture->add_subcommand(
      "measured", "Makes a capture of measurements alone from an .rxt file of iad, and checks it.");
  measured->footer(
      "Scattering and absorption are free, index and g fixed. Every thickness in the file becomes a measurement.\n"
      "docs/measurements.md describes the file.\n\n"
      "Example:\n"
      "  crownfit capture measured ceramic.rxt -o ceramic --wavelengths 600,540,450 --stddev 0.005\n"
      "  crownfit fit ceramic -o result");
  MeasuredParts& m = measured_asked->parts;
  measured->add_option("FILE", m.file, "The .rxt file. Its readings must already be corrected for the sphere.")
      ->required();
  measured->add_option("-o,--output", measured_asked->output, "Folder of the capture; it is created if missing.")
      ->required();
  measured
      ->add_option("--wavelengths", m.wavelengths_nm,
                   "NM,NM,NM: wavelengths of the three bands, or one for all (default 600,540,450). Readings are\n"
                   "interpolated between the wavelengths of the file.")
      ->delimiter(',');
  measured
      ->add_option("--rows", m.rows,
                   "N,N,N, for a file without wavelengths: the rows, counted from 1, that become the three bands;\n"
                   "or one row for all.")
      ->delimiter(',');
  measured
      ->add_option("--stddev", m.stddev,
                   "Standard deviation of every reading, repeatability and calibration together (default 0.005).\n"
                   "The intervals depend on it.")
      ->check(CLI::Range(1e-7, 0.5));
  measured->add_option("--g", m.asymmetry, "Mean cosine of scattering, if the file has no column g (default 0.8).")
      ->check(CLI::Range(-0.99, 0.99));
  measured->add_option("--layer", m.layer, "Name of the material (default: sample).");
  AddImport(*capture, command);
  AddCommonOptions(measured, measured_asked->common);
  RunWith(measured, command, measured_asked, RunMeasured);

  auto* init = capture->add_subcommand(
      "init", "Gathers meshes, photographs and calibration files into a capture, and checks it.");
  init->footer(
      "Scattering, absorption and roughness are free, exposures fixed to 1. Edit capture.json for anything else.\n\n"
      "Example:\n"
      "  crownfit capture init -o crown --mesh enamel=crown.stl --layer dentine --thickness-mm 0.8 \\\n"
      "    --photo front=front.dng --photo back=back.dng --lit back=left --holdout back --camera camera.json \\\n"
      "    --poses poses.json --lights light_rig.json --noise noise.json --colour colour.json --blur blur.json\n"
      "  crownfit fit crown -o result");
  CaptureParts& parts = asked->parts;
  init->add_option("-o,--output", asked->output, "Folder of the capture; it is created if missing.")->required();
  init->add_option("--mesh", asked->meshes,
                   "LAYER=FILE: surface of a layer in mm, such as enamel=crown.stl. Repeatable, outermost layer\n"
                   "first.")
      ->take_all()
      ->required();
  init->add_option("--layer", parts.more_layers, "A further layer inside, without a mesh, such as dentine. Repeatable.")
      ->take_all();
  init->add_option("--thickness-mm", parts.thickness_mm,
                   "Thickness in mm of the layer above a layer without a mesh (default 0.8).")
      ->check(CLI::PositiveNumber);
  init->add_option("--photo", asked->photographs, "NAME=FILE: a photograph. Repeatable.")->take_all()->required();
  init->add_option("--camera", parts.camera,
                   "camera.json of `crownfit calibrate camera`, or a calibration by OpenCV (.yml, .xml).")
      ->required();
  init->add_option("--poses", parts.poses,
                   "poses.json of `crownfit calibrate pose`. Poses are found by the names of the photographs' files.")
      ->required();
  init->add_option("--lights", parts.lights, "light_rig.json of `crownfit calibrate lights`.")->required();
  init->add_option("--lit", asked->lit, "NAME=LIGHT,LIGHT: the lights that were on in photograph NAME (default: all).")
      ->take_all();
  init->add_option("--polarisation", asked->polarisation,
                   "NAME=none, cross or parallel: the polarisers of photograph NAME (default: none).")
      ->take_all();
  init->add_option("--mask", asked->masks, "NAME=FILE: use photograph NAME only where this picture is above 0.5.")
      ->take_all();
  init->add_option("--noise", parts.noise, "noise.json of `crownfit calibrate noise`.");
  init->add_option("--colour", parts.colour, "colour.json of `crownfit calibrate colour`.");
  init->add_option("--blur", parts.blur, "blur.json of `crownfit calibrate blur`.");
  init->add_option("--holdout", parts.holdouts,
                   "NAME of a photograph that is not fitted, but compared with its prediction. Repeatable.")
      ->take_all();
  AddCommonOptions(init, asked->common);
  AddChannels(init, asked->channels);
  init->add_flag("--exposure-free", parts.exposure_is_free,
                 "Free the exposures, because no card gave the intensity of the lights.");
  RunWith(init, command, asked, RunInit);
}

}  // namespace crownfit
