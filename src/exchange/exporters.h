#pragma once
// A material, and the scene it was photographed in, as files of other programs. Every exporter writes a folder of its
// own; docs/exchange.md says for each what becomes of which quantity, and what is lost.

#include <filesystem>
#include <map>
#include <string>

#include "exchange/export_scene.h"

namespace crownfit {

struct Exporter {
  /// Writes the files. Throws InputError when the folder can't be written.
  void (*write)(const ExportScene& scene, const std::filesystem::path& folder);
  const char* title;    ///< for people
  const char* how_to;   ///< Markdown: what is where, and the command that renders it
  const char* what_is;  ///< Markdown table rows: quantity | becomes | formula
  const char* is_lost;  ///< Markdown list: what this format can't hold of any material or scene
  /// How near its pictures come to those by crownfit's walks, as measured (docs/exchange.md); empty: it makes none.
  const char* tolerance = "";
};

/// By the word after --to.
const std::map<std::string, Exporter>& Exporters();

void WriteCsv(const ExportScene& scene, const std::filesystem::path& folder);
void WriteMaterialX(const ExportScene& scene, const std::filesystem::path& folder);
void WriteMitsuba(const ExportScene& scene, const std::filesystem::path& folder);
void WritePbrt(const ExportScene& scene, const std::filesystem::path& folder);
void WriteGltf(const ExportScene& scene, const std::filesystem::path& folder);
void WriteRxt(const ExportScene& scene, const std::filesystem::path& folder);
void WriteBlender(const ExportScene& scene, const std::filesystem::path& folder);

/// The meshes of layers, cuts, things and lamps as binary PLY (mm, single precision) in `folder`/meshes, and
/// environments as EXR beside them.
void WriteMeshes(const ExportScene& scene, const std::filesystem::path& folder);

/// Where WriteMeshes puts things, relative to the folder; photographs that see the same thing name the same file.
struct MeshNames {
  std::vector<std::string> layer;               ///< what was scanned of it, or all
  std::vector<std::string> cut;                 ///< closes its neck; empty where nothing does
  std::vector<std::vector<std::string>> lamp;   ///< per photograph and lamp; empty where it has no mesh
  std::vector<std::vector<std::string>> thing;  ///< per photograph and thing
};
MeshNames MeshNamesOf(const ExportScene& scene);

/// Numbers as their shortest text that reads back the same.
std::string NumberText(double v);
std::string NumberText(const glm::dvec3& v, const char* between);

}  // namespace crownfit
