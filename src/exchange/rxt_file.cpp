#include "exchange/rxt_file.h"

#include <algorithm>
#include <charconv>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "exchange/exporters.h"
#include "optics/adding_doubling.h"
#include "optics/slab.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

/// The words of every non-empty line, without comments.
struct Line {
  size_t number;
  std::vector<std::string> words;
};
std::vector<Line> LinesOf(const std::string& text) {
  std::string with_lf;  // of CR LF, CR or LF
  for (size_t i = 0; i < text.size(); ++i)
    if (text.compare(i, 2, "\r\n") != 0) with_lf += text[i] == '\r' ? '\n' : text[i];
  std::vector<Line> lines;
  std::istringstream stream(with_lf);
  size_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    Line found{number, {}};
    for (std::string word; words >> word;) found.words.push_back(word);
    if (!found.words.empty()) lines.push_back(found);
  }
  return lines;
}

std::string Where(size_t line) { return "line " + std::to_string(line); }

double NumberIn(const Path& file, size_t line, const std::string& word, double low, double high, const char* what) {
  double value = 0;
  const char* begin = word.data() + (word.starts_with('+') && !word.starts_with("+-") ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !(value >= low && value <= high))
    throw InputError(file, Where(line), std::string("expected ") + what + ", found '" + word + "'",
                     "Write numbers with a decimal point and without a unit; comments begin with #.");
  return value;
}

/// Column letters as in iad; a number of columns means the first of r, t, u.
std::string ColumnsOf(const Path& file, const Line& line) {
  std::string letters;
  for (const std::string& word : line.words)
    for (const char c : word)
      if (c != '-') letters += c;
  if (letters == "1") return "r";
  if (letters == "2") return "rt";
  const std::string known = "Lrtdng", unused = "BwWRTqe";  // beam, walls, standards, iad's own settings
  for (const char c : letters)
    if ((known + unused).find(c) == std::string::npos || std::count(letters.begin(), letters.end(), c) > 1)
      throw InputError(file, Where(line.number), "column '" + std::string(1, c) + "' can't be used",
                       "Known columns: L r t d n g, once each. Correct the readings for spheres, for slides that "
                       "differ between rows and for unscattered light, then remove the column.");
  if (letters.find_first_of("rt") == std::string::npos)
    throw InputError(file, Where(line.number), "there is no column r or t",
                     "Name the columns by their letters, such as: L r t");
  return letters;
}

constexpr double kMostThickness_mm = 100.0, kMostIndex = 3.0;

}  // namespace

RxtFile ReadRxt(const Path& file) {
  constexpr double kMostBytes = 16e6;
  std::string text = ReadWholeFile(file, kMostBytes, "An .rxt file has one number per line, then a table.");
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // a byte order mark
  if (!text.starts_with("IAD1"))
    throw InputError(file, "line 1", "a file of iad must begin with IAD1", "Give the .rxt file that iad reads.");
  const std::vector<Line> lines = LinesOf(text.substr(4));
  RxtFile rxt;
  RxtRow common;
  double spheres = 0;
  // Index and thickness of sample and slides, beam, standard, number of spheres; then five values per sphere.
  constexpr size_t kHeader = 17;
  const struct {
    const char* what;
    double low, high;
    double* to;
  } header[] = {{"the sample's index of refraction", 1.0, kMostIndex, &common.ior},
                {"the slides' index of refraction", 0.0, kMostIndex, &rxt.slide_ior},
                {"the sample's thickness in mm", 1e-3, kMostThickness_mm, &common.thickness_mm},
                {"the slides' thickness in mm", 0.0, 20.0, &rxt.slide_thickness_mm},
                {"the beam's diameter in mm", 0.0, 1e4, nullptr},
                {"the standard's reflectance", 0.0, 2.0, nullptr},
                {"the number of spheres", 0, 2, &spheres}};
  size_t at = 0, count = 0;
  for (; at < lines.size() && count < kHeader; ++at)
    for (const std::string& word : lines[at].words) {
      if (count == kHeader)
        throw InputError(file, Where(lines[at].number), "the header has more than 17 numbers",
                         "Put the letters of the columns, such as L r t, on a line of their own.");
      const bool of_sphere = count >= std::size(header);
      const double value =
          NumberIn(file, lines[at].number, word, of_sphere ? 0.0 : header[count].low,
                   of_sphere ? 1e4 : header[count].high, of_sphere ? "a number of a sphere" : header[count].what);
      if (!of_sphere && header[count].to) *header[count].to = value;
      ++count;
    }
  if (count < kHeader || at == lines.size())
    throw InputError(file, "", "the file ends after " + std::to_string(count) + " of the header's 17 numbers",
                     "List the numbers of the spheres too, even if none was used.");
  if (spheres != 0)
    throw InputError(file, "number of spheres", "readings that are not corrected for the sphere can't be used",
                     "Correct them (iad prints the corrected ones). For a dual-beam instrument write 0.");
  if (rxt.slide_ior == 0 || rxt.slide_ior == 1 || rxt.slide_thickness_mm == 0)
    rxt.slide_ior = 1, rxt.slide_thickness_mm = 0;

  const Line& legend = lines[at++];
  const std::string columns = ColumnsOf(file, legend);
  const bool is_counted = legend.words[0].find_first_of("12") == 0;
  for (; at < lines.size(); ++at) {
    const Line& line = lines[at];
    std::string letters = columns;
    // Without letters an additional first number, above 1, is the wavelength.
    if (is_counted && line.words.size() == columns.size() + 1) letters = "L" + columns;
    if (line.words.size() != letters.size())
      throw InputError(file, Where(line.number),
                       "expected " + std::to_string(letters.size()) + " numbers (" + letters + "), found " +
                           std::to_string(line.words.size()),
                       "Write one row per line, with a number for each column.");
    RxtRow row = common;
    for (size_t i = 0; i < letters.size(); ++i) {
      const auto number = [&](double low, double high, const char* what) {
        return NumberIn(file, line.number, line.words[i], low, high, what);
      };
      if (letters[i] == 'L') row.wavelength_nm = number(200, 2500, "a wavelength in nm");
      if (letters[i] == 'r') row.reflectance = number(0, 1, "a reflectance between 0 and 1");
      if (letters[i] == 't') row.transmittance = number(0, 1, "a transmittance between 0 and 1");
      if (letters[i] == 'd') row.thickness_mm = number(1e-3, kMostThickness_mm, "a thickness in mm");
      if (letters[i] == 'n') row.ior = number(1, kMostIndex, "an index of refraction");
      if (letters[i] == 'g') row.asymmetry = number(-0.99, 0.99, "a mean cosine");
    }
    rxt.rows.push_back(row);
  }
  if (rxt.rows.empty()) throw InputError(file, "", "the file has no row of readings");
  return rxt;
}

void WriteRxt(const ExportScene& scene, const Path& folder) {
  std::vector<double> totals_mm;
  double known = 0;
  for (const ExportedLayer& layer : scene.layers) known += layer.thickness_mm.value_or(0.0);
  const bool all_known = std::all_of(scene.layers.begin(), scene.layers.end(),
                                     [](const ExportedLayer& l) { return l.thickness_mm.has_value(); });
  if (!all_known && scene.layers.size() > 1)
    throw InputError("", "--to rxt", "the material does not state the thickness of each layer",
                     "Give --capture CAPTURE, or a material with one layer.");
  if (all_known) totals_mm.push_back(known);
  for (const double mm : {0.5, 1.0, 1.5, 2.0})
    if (!all_known || std::abs(mm - known) > 1e-9) totals_mm.push_back(mm);

  const ExportedLayer& outer = scene.layers[0];
  std::string text = "IAD1  # what crownfit predicts of flat samples, in the format of iad\n";
  const auto add = [&](double value, const char* what) { text += NumberText(value) + "  # " + what + "\n"; };
  add(outer.ior, "index of refraction of the sample (of its outermost layer)");
  add(1, "index of refraction of the slides: none");
  add(totals_mm[0], "mm, thickness of the sample");
  add(0, "mm, thickness of the slides");
  add(0.1, "mm, diameter of the beam");
  add(1, "reflectance of the calibration standard");
  add(0, "number of spheres");
  for (const char* sphere : {"reflection", "transmission"})
    for (const double v : {200.0, 25.0, 10.0, 1.0, 0.98}) add(v, (std::string(sphere) + " sphere, not used").c_str());
  text += "L d r t g\n";
  for (const double total_mm : totals_mm)
    for (int c = 0; c < scene.channels(); ++c) {
      Slab slab;
      for (const ExportedLayer& l : scene.layers)
        slab.layers.push_back({l.ior, l.asymmetry, l.isotropic_fraction, l.scattering_per_mm[c], l.absorption_per_mm[c],
                               all_known ? *l.thickness_mm * total_mm / known : total_mm});
      const SlabAnswer answer = SolveByAddingDoubling(slab);
      for (const double v : {scene.wavelengths_nm[static_cast<size_t>(c)], total_mm,
                             answer.specular + answer.value.reflectance_collimated,
                             answer.value.transmittance_collimated, (1 - outer.isotropic_fraction) * outer.asymmetry})
        text += NumberText(v) + " ";
      text.back() = '\n';
    }
  WriteTextFile(folder / "material.rxt", text);
}

}  // namespace crownfit
