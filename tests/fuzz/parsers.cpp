#include "fuzz/parsers.h"

#include <cstdlib>
#include <fstream>

#include "base/error.h"
#include "base/json_file.h"
#include "batch/manifest.h"
#include "capture/blur.h"
#include "capture/camera.h"
#include "capture/capture.h"
#include "capture/colour_file.h"
#include "capture/light_rig.h"
#include "capture/poses.h"
#include "dental/shades_file.h"
#include "exchange/imported_views.h"
#include "exchange/mitsuba_scene.h"
#include "exchange/opencv_file.h"
#include "exchange/rxt_file.h"
#include "geometry/mesh_file.h"
#include "optics/material_file.h"
#include "optics/slab.h"
#include "photo/photograph.h"
#include "support/temporary_folder.h"
#include "synthetic/recipe.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

/// In memory where the system has a RAM disk: a fuzzer writes thousands of files a second.
const Path& Folder() {
  static const struct InMemory {
    InMemory() {
      if (std::filesystem::is_directory("/dev/shm")) setenv("TMPDIR", "/dev/shm", 0);
    }
  } first;
  static const TemporaryFolder folder;
  static const bool filled = [] {
    std::filesystem::copy(Path(CROWNFIT_DATASETS) / "sphere", folder.path,
                          std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    return true;
  }();
  (void)filled;
  return folder.path;
}

void ReadJson(const Path& file) {
  const std::string text = ToJsonText(JsonFile(file).value);
  Check(ToJsonText(JsonFile("again", text).value) == text, "what is read and written is read as the same");
}

void ReadMesh(const Path& file) {
  std::vector<std::string> messages;
  const TriangleMesh mesh = ReadClosedSurface(file, messages);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      Check(t[k] >= 0 && t[k] < static_cast<int>(mesh.vertices.size()), "a face's corners exist");
  for (const auto& [name, values] : mesh.vertex_properties)
    Check(values.size() == mesh.vertices.size(), "every vertex has its properties");
  Check(Volume(mesh) >= 0, "a closed surface looks outwards");
}

void ReadManifestFile(const Path& file) {
  FitCommand fit;
  fit.columns = {{"model", false, false}, {"fix", false, true}, {"no-priors", true, false}};
  fit.fault = [](const std::vector<std::string>&, const std::filesystem::path&) { return std::string(); };
  const Manifest manifest = ReadManifest(file, fit);
  Check(!manifest.rows.empty(), "a manifest has rows or is refused");
}

void ReadMaterial(const Path& file) {
  static const Capture capture = ReadCapture(Folder() / "as_bundled.json");
  (void)ReadMaterialOutline(file);
  (void)ReadMaterialRecord(file, capture);
}

/// The images of a model of COLMAP that has one camera.
void ReadColmapText(const Path& images) {
  std::filesystem::remove(images.parent_path() / "images.bin");
  std::ofstream(images.parent_path() / "cameras.txt") << "1 PINHOLE 64 48 100 100 32 24\n";
  (void)ReadColmap(images.parent_path());
}

void ReadColmapBinary(const Path& images) {
  const uint64_t one = 1, size[] = {64, 48};
  const uint32_t id_and_model[] = {1, 1};
  const double parameters[] = {100, 100, 32, 24};
  {
    std::ofstream cameras(images.parent_path() / "cameras.bin", std::ios::binary);
    cameras.write(reinterpret_cast<const char*>(&one), sizeof one);
    cameras.write(reinterpret_cast<const char*>(id_and_model), sizeof id_and_model);
    cameras.write(reinterpret_cast<const char*>(size), sizeof size);
    cameras.write(reinterpret_cast<const char*>(parameters), sizeof parameters);
  }
  (void)ReadColmap(images.parent_path());
}

void ReadRig(const Path& file) { (void)ReadLightRig(file); }

void ReadScene(const Path& file) {
  for (const ImportedView& view : ReadMitsuba(file, 1.0).views)
    Check(view.camera.fx > 0 && view.camera.width > 0, "a view that is read has a camera");
}

template <auto Read>
void Ignore(const Path& file) {
  (void)Read(file);
}

template <auto Read>
void IgnoreOfThreeChannels(const Path& file) {
  (void)Read(file, 3);
}

constexpr Parser kParsers[] = {
    {"json", "a.json", ReadJson},
    {"capture", "capture.json", Ignore<ReadCapture>},
    {"recipe", "recipe.json", Ignore<ReadRecipe>},
    {"slab", "slab.json", Ignore<ReadSlab>},
    {"material", "material.json", ReadMaterial},
    {"manifest_json", "manifest.json", ReadManifestFile},
    {"manifest_csv", "manifest.csv", ReadManifestFile},
    {"camera", "camera.json", Ignore<ReadCamera>},
    {"light_rig", "light_rig.json", ReadRig},
    {"colour", "colour.json", IgnoreOfThreeChannels<ReadColourTransform>},
    {"noise", "noise.json", IgnoreOfThreeChannels<ReadSensorNoise>},
    {"blur", "blur.json", Ignore<ReadBlur>},
    {"poses", "poses.json", Ignore<ReadPoses>},
    {"transforms", "transforms.json", Ignore<ReadNerfTransforms>},
    {"colmap_text", "images.txt", ReadColmapText},
    {"colmap_binary", "images.bin", ReadColmapBinary},
    {"mitsuba", "scene.xml", ReadScene},
    {"opencv_yaml", "camera.yml", Ignore<ReadOpenCvCalibration>},
    {"opencv_xml", "camera.xml", Ignore<ReadOpenCvCalibration>},
    {"rxt", "a.rxt", Ignore<ReadRxt>},
    {"shades", "a.csv", Ignore<ReadShadeTable>},
    {"ply", "a.ply", ReadMesh},
    {"stl", "a.stl", ReadMesh},
    {"obj", "a.obj", ReadMesh},
};

}  // namespace

std::span<const Parser> Parsers() { return kParsers; }

std::string Feed(const Parser& parser, const std::string& bytes) {
  static const bool kept = std::filesystem::copy_file(Folder() / "capture.json", Folder() / "as_bundled.json",
                                                      std::filesystem::copy_options::overwrite_existing);
  Check(kept, "the bundled capture is there");
  const Path file = Folder() / parser.file_name;
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  try {
    parser.read(file);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace crownfit
