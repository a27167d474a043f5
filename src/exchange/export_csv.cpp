#include <cmath>

#include "base/files.h"
#include "exchange/equivalents.h"
#include "exchange/exporters.h"
#include "optics/media.h"

namespace crownfit {
namespace {

/// A field quoted by RFC 4180.
std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

class Table {
 public:
  explicit Table(const ExportScene& scene) : scene_(scene) {}

  void AddStated(const std::string& layer, const ParameterRow& row, const Spectrum& values,
                 const ParameterRecord& record) {
    if (!record.is_stated) return;
    const int channels = row.per_channel ? values.size() : 1;
    for (int c = 0; c < channels; ++c) {
      const auto of = [&](const auto& list) {
        using Item = std::decay_t<decltype(list[0])>;
        if (list.empty()) return Item{};
        return list[list.size() == 1 ? 0 : static_cast<size_t>(c)];
      };
      const auto interval = of(record.interval95);
      const auto stddev = of(record.stddev);
      Add(layer, row.key, row.per_channel ? c : -1, values[c], row.unit,
          (stddev ? NumberText(*stddev) : "") + "," + (interval ? NumberText((*interval)[0]) : "") + "," +
              (interval ? NumberText((*interval)[1]) : "") + "," +
              (record.status_by_channel.empty() ? record.status : record.status_by_channel[c]));
    }
  }
  void AddDerived(const std::string& layer, const std::string& key, const Spectrum& values, const char* unit) {
    for (int c = 0; c < values.size(); ++c) Add(layer, key, c, values[c], unit, ",,,derived");
  }
  const std::string& text() const { return text_; }

 private:
  void Add(const std::string& layer, const std::string& key, int channel, double value, const std::string& unit,
           const std::string& rest) {
    const bool has_channel = channel >= 0;
    text_ += Quoted(layer) + "," + key + "," + (has_channel ? Quoted(scene_.channel_names[channel]) : "") + "," +
             (has_channel ? NumberText(scene_.wavelengths_nm[channel]) : "") + "," +
             (std::isfinite(value) ? NumberText(value) : "") + "," + unit + "," + rest + "\n";
  }
  const ExportScene& scene_;
  std::string text_ = "layer,quantity,channel,wavelength_nm,value,unit,stddev,low95,high95,status\n";
};

}  // namespace

void WriteCsv(const ExportScene& scene, const std::filesystem::path& folder) {
  Table table(scene);
  const MaterialRecord& record = scene.record;
  for (size_t l = 0; l < scene.layers.size(); ++l) {
    const ExportedLayer& layer = scene.layers[l];
    for (const ParameterRow& row : kParameters)
      if (row.owner == Owner::kLayer)
        table.AddStated(layer.name, row, record.material.layers[l][row.quantity],
                        record.layers[l][static_cast<size_t>(row.quantity)]);
    table.AddDerived(layer.name, "scattering_per_mm", layer.scattering_per_mm, "1/mm");
    table.AddDerived(layer.name, "mean_free_path_mm", MeanFreePath_mm(layer), "mm");
    table.AddDerived(layer.name, "single_scattering_albedo",
                     layer.scattering_per_mm / (layer.scattering_per_mm + layer.absorption_per_mm), "1");
    table.AddDerived(layer.name, "multiple_scattering_albedo", MultipleScatteringAlbedo(layer), "1");
    Spectrum diffuse = layer.absorption_per_mm;
    for (int c = 0; c < diffuse.size(); ++c)
      diffuse[c] = DiffuseMeanFreePath_mm(layer.reduced_scattering_per_mm()[c], layer.absorption_per_mm[c]);
    table.AddDerived(layer.name, "diffuse_mean_free_path_mm", diffuse, "mm");
  }
  for (const ParameterRow& row : kParameters)
    if (row.owner == Owner::kSurface)
      table.AddStated("surface", row, record.material.surface[row.quantity],
                      record.surface[static_cast<size_t>(row.quantity)]);
  WriteTextFile(folder / "material.csv", table.text());
}

}  // namespace crownfit
