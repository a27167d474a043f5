#pragma once
// A material, and the scene it was photographed in, as files of other programs. Every exporter writes a folder of its
// own. docs/exchange.md lists for each how quantities are converted, and what is lost.

#include <filesystem>
#include <map>
#include <string>

#include "exchange/export_scene.h"

namespace crownfit {

struct Exporter {
  /// Writes the files. Throws InputError when the folder can't be written.
  void (*write)(const ExportScene& scene, const std::filesystem::path& folder);
  const char* title;    ///< for people
  const char* how_to;   ///< Markdown: the files, and the command that renders them
  const char* what_is;  ///< Markdown table rows: quantity | becomes | formula
  const char* is_lost;  ///< Markdown list: what this format cannot hold for any material or scene
  /// Measured difference between its pictures and crownfit's path-traced ones (docs/exchange.md); empty: it renders
  /// none.
  const char* tolerance = "";
  bool holds_all_channels = false;  ///< false: red, green and blue
};

/// Exporters by the value of --to.
const std::map<std::string, Exporter>& Exporters();

void WriteCsv(const ExportScene& scene, const std::filesystem::path& folder);
void WriteMaterialX(const ExportScene& scene, const std::filesystem::path& folder);
void WriteMitsuba(const ExportScene& scene, const std::filesystem::path& folder);
void WritePbrt(const ExportScene& scene, const std::filesystem::path& folder);
void WriteGltf(const ExportScene& scene, const std::filesystem::path& folder);
void WriteRxt(const ExportScene& scene, const std::filesystem::path& folder);
void WriteBlender(const ExportScene& scene, const std::filesystem::path& folder);

/// Writes the meshes of layers, cuts, objects and lamps as binary PLY (mm, single precision) to `folder`/meshes, and
/// environments as EXR beside them.
void WriteMeshes(const ExportScene& scene, const std::filesystem::path& folder);

/// Paths of WriteMeshes's files, relative to the folder; photographs of the same object name the same file.
struct MeshNames {
  std::vector<std::string> layer;               ///< its scanned part, or all of it
  std::vector<std::string> cut;                 ///< the cut that closes its neck; empty where there is none
  std::vector<std::vector<std::string>> lamp;   ///< per photograph and lamp; empty without a mesh
  std::vector<std::vector<std::string>> thing;  ///< per photograph and object
};
MeshNames MeshNamesOf(const ExportScene& scene);

/// The shortest text of a number that reads back the same.
std::string NumberText(double v);
std::string NumberText(const glm::dvec3& v, const char* between);
std::string NumberText(const Spectrum& v, const char* between);

}  // namespace crownfit
