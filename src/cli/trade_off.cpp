#include "cli/trade_off.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>

#include "base/error.h"
#include "batch/crown_record.h"
#include "batch/process_pool.h"
#include "capture/capture.h"
#include "fit/compare_photographs.h"
#include "optics/material_file.h"
#include "photo/image_io.h"
#include "scene/cast_capture.h"

namespace crownfit {
namespace {

struct Configuration {
  const char *name, *model;
  std::vector<std::string> arguments;
};

/// The configurations of `crownfit render`; each model and each setting of it is a row ...
const std::vector<Configuration>& Predictions() {
  static const std::vector<Configuration> table{
      {"13 taps, half size", "shader", {"--twelve-taps", "--scale", "0.5"}},
      {"half size", "shader", {"--scale", "0.5"}},
      {"13 taps", "shader", {"--twelve-taps"}},
      {"49 taps", "shader", {}},
      {"49 taps, 4 x light samples", "shader", {"--fine"}},
      {"0 collisions, 8 paths", "diffusion", {"--collisions", "0", "--paths", "8"}},
      {"4 collisions, 16 paths", "diffusion", {"--collisions", "4", "--paths", "16"}},
      {"10 collisions, 16 paths", "diffusion", {"--paths", "16"}},
      {"10 collisions, 64 paths", "diffusion", {"--paths", "64"}},
      {"30 collisions, 64 paths", "diffusion", {"--collisions", "30", "--paths", "64"}},
      {"4 paths, half size", "path", {"--paths", "4", "--scale", "0.5"}},
      {"4 paths", "path", {"--paths", "4"}},
      {"16 paths", "path", {"--paths", "16"}},
      {"64 paths", "path", {"--paths", "64"}},
      {"256 paths", "path", {"--paths", "256"}},
  };
  return table;
}

/// ... and those of `crownfit fit`. Where no truth is known the last row replaces it.
const std::vector<Configuration>& Fits() {
  static const std::vector<Configuration> table{
      {"13 taps", "shader", {"--twelve-taps", "--profiles", "0"}},
      {"1500 pixels", "shader", {"--max-pixels", "1500", "--profiles", "0"}},
      {"49 taps", "shader", {"--profiles", "0"}},
      {"250,000 walks", "diffusion", {"--walks", "250000"}},
      {"1,250,000 walks", "diffusion", {"--walks", "1250000"}},
      {"50,000 walks", "path", {"--walks", "50000"}},
      {"250,000 walks", "path", {"--walks", "250000"}},
      {"1,250,000 walks", "path", {"--walks", "1250000"}},
  };
  return table;
}

std::string FolderName(const std::string& model, const std::string& name) {
  std::string folder = model + " " + name;
  for (char& c : folder)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return folder;
}

std::string FirstLine(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

/// Runs the program with one row's arguments; its output goes to `folder`.
class Runner {
 public:
  Runner(const std::filesystem::path& program, const std::filesystem::path& capture, int threads, size_t runs,
         Progress& progress)
      : program_(program), capture_(capture), threads_(threads), runs_(runs), progress_(progress) {}

  TradeOffRow Run(const char* command, const Configuration& row, const std::vector<std::string>& more,
                  const std::filesystem::path& folder) {
    TradeOffRow done;
    done.name = row.name;
    done.model = row.model;
    done.arguments = {"--model", row.model};
    done.arguments.insert(done.arguments.end(), row.arguments.begin(), row.arguments.end());
    std::vector<std::string> words{program_, command, capture_, "-o", folder, "--progress", "none"};
    words.insert(words.end(), {"--threads", std::to_string(threads_)});
    words.insert(words.end(), done.arguments.begin(), done.arguments.end());
    words.insert(words.end(), more.begin(), more.end());
    std::filesystem::create_directories(folder);
    const auto said = folder / "messages.txt";
    ProcessPool pool({.seconds = HUGE_VAL});
    pool.Start(0, words, said);
    std::optional<std::pair<size_t, ProcessEnd>> ended;
    while (!ended) {
      progress_.Show("measuring", static_cast<double>(done_) / static_cast<double>(runs_),
                     std::string(command) + " by " + row.model + ", " + row.name);
      ended = pool.Wait(1.0);
    }
    ++done_;
    const ProcessEnd& end = ended->second;
    done.cpu_s = end.cpu_s;
    done.wall_s = end.wall_s;
    done.peak_MiB = end.peak_MiB;
    const bool is_fit_refused = std::string(command) == "fit" && end.exit_code == 1;  // has a result nevertheless
    if (end.exit_code != 0 && !is_fit_refused) done.fault = Words(end, {}) + ": " + FirstLine(said);
    return done;
  }

 private:
  std::filesystem::path program_, capture_;
  int threads_;
  size_t runs_, done_ = 0;
  Progress& progress_;
};

/// Enlarges by repeating pixels: a smaller picture as it is shown at full size.
Image Enlarged(const Image& image, int width, int height) {
  Image large(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < image.channels; ++c)
        large.at(x, y, c) = image.at(x * image.width / width, y * image.height / height, c);
  return large;
}

/// Pixels that lie wholly on the object, per photograph.
std::vector<std::vector<uint8_t>> ObjectMasks(const Capture& capture, const Material& material, int threads,
                                              Progress& progress) {
  const CrownInput input = ReadInput(capture, threads, /*with_images=*/false);
  CastOptions options;
  options.strata = options.gather_strata = 1;  // light is not needed
  options.threads = threads;
  const CastState state = CastAll(input, ThicknessesOf(input.capture, material), options, progress);
  std::vector<std::vector<uint8_t>> masks;
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const Camera& camera = capture.photographs[i].camera;
    masks.emplace_back(static_cast<size_t>(camera.width) * camera.height, 0);
    for (const PixelCast& pixel : state.photographs[i].pixels)
      masks.back()[static_cast<size_t>(pixel.y) * camera.width + pixel.x] = !pixel.at_silhouette;
  }
  return masks;
}

/// The path model's pictures, in two halves with independent walks, whose difference gives their noise.
class Reference {
 public:
  Reference(const Capture& capture, std::vector<std::vector<uint8_t>> masks,
            const std::array<std::filesystem::path, 2>& halves)
      : capture_(capture), masks_(std::move(masks)) {
    std::vector<Image> first = Read(halves[0]), second = Read(halves[1]);
    for (size_t i = 0; i < first.size(); ++i) {
      Image mean = first[i];
      for (size_t k = 0; k < mean.values.size(); ++k)
        mean.values[k] = 0.5f * (first[i].values[k] + second[i].values[k]);
      pictures_.push_back(std::move(mean));
    }
    // The halves differ by twice the noise of their mean.
    const auto [median, p95, worst] = Off(first, second);
    noise_median_ = 0.5 * median;
    noise_p95_ = 0.5 * p95;
  }

  void Compare(const std::filesystem::path& folder, TradeOffRow& row) const {
    const auto [median, p95, worst] = Off(pictures_, Read(folder));
    row.de00_median = median;
    row.de00_p95 = p95;
    row.de00_median_worst = worst;
  }
  double noise_median() const { return noise_median_; }
  double noise_p95() const { return noise_p95_; }

 private:
  std::vector<Image> Read(const std::filesystem::path& folder) const {
    std::vector<Image> images;
    for (const PhotographSpec& photo : capture_.photographs) {
      Image image = ReadImageFile(folder / (photo.name + ".exr"), ChannelsInFile(capture_)).image;
      if (image.width != photo.camera.width || image.height != photo.camera.height)
        image = Enlarged(image, photo.camera.width, photo.camera.height);
      images.push_back(std::move(image));
    }
    return images;
  }
  /// Photographs are weighted by their number of blocks.
  std::array<double, 3> Off(const std::vector<Image>& from, const std::vector<Image>& to) const {
    double median = 0, p95 = 0, worst = 0, blocks = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      const ColourDifference d = ComparePictures(from[i], to[i], masks_[i], capture_.photographs[i].rgb_from_sensor);
      const double weight = static_cast<double>(d.blocks);
      median += weight * d.median;
      p95 += weight * d.p95;
      blocks += weight;
      worst = std::max(worst, d.median);
    }
    return {median / blocks, p95 / blocks, worst};
  }

  const Capture& capture_;
  std::vector<std::vector<uint8_t>> masks_;
  std::vector<Image> pictures_;
  double noise_median_ = 0, noise_p95_ = 0;
};

/// Compares a fit's values with the true ones.
void CompareValues(const MaterialRecord& fitted, const Material& truth, TradeOffRow& row) {
  std::vector<double> errors;
  const auto compare = [&](const Material::Layer& mine, const Material::Layer& goal,
                           const MaterialRecord::Owner& records) {
    for (size_t i = 0; i < kParameters.size(); ++i) {
      const ParameterRecord& record = records[i];
      if (record.interval95.empty() || record.status == "fixed") continue;
      for (size_t c = 0; c < record.interval95.size(); ++c) {  // one, or one per channel
        const double value = mine.values[i][static_cast<int>(c)], right = goal.values[i][static_cast<int>(c)];
        if (value > 0 && right > 0) errors.push_back(100 * std::abs(std::log(value / right)));
        const auto& interval = record.interval95[c];
        ++row.intervals;
        row.intervals_that_hold += interval && (*interval)[0] <= right && right <= (*interval)[1];
      }
    }
  };
  for (size_t l = 0; l < truth.layers.size(); ++l)
    compare(fitted.material.layers[l], truth.layers[l], fitted.layers[l]);
  compare(fitted.material.surface, truth.surface, fitted.surface);
  if (errors.empty()) return;
  std::sort(errors.begin(), errors.end());
  row.error_median_percent = 0.5 * (errors[(errors.size() - 1) / 2] + errors[errors.size() / 2]);
  row.error_largest_percent = errors.back();
}

}  // namespace

TradeOff MeasureTradeOff(const std::filesystem::path& program, const std::filesystem::path& capture_path,
                         const TradeOffOptions& options, const std::filesystem::path& folder, Progress& progress) {
  const Capture capture = ReadCapture(capture_path);
  const auto truth_file = capture.folder / "truth.json";
  const bool has_truth = std::filesystem::exists(truth_file);
  const auto material_file = options.material.empty() && has_truth ? truth_file : options.material;
  const Material material = material_file.empty() ? StatedMaterial(capture) : ReadMaterialFile(material_file, capture);
  TradeOff result;
  result.rendered = material_file.empty() ? "the capture's own values" : material_file.filename().string();

  // All runs come before this process reads pictures: a child's peak memory is at least that of its parent.
  Runner runner(program, capture.file, options.threads, Predictions().size() + 2 + (options.fits ? Fits().size() : 0),
                progress);
  std::vector<std::string> with_material;
  if (!material_file.empty()) with_material = {"--material", material_file};
  const auto pictures = folder / "pictures", fits = folder / "fits";
  const std::array halves{pictures / "reference_1", pictures / "reference_2"};
  for (size_t h = 0; h < 2; ++h) {
    const Configuration half{"reference", "path", {"--paths", std::to_string(options.reference_paths / 2)}};
    std::vector<std::string> more = with_material;
    more.insert(more.end(), {"--seed", std::to_string(1000001 + h)});  // walks independent of all other rows
    const TradeOffRow done = runner.Run("render", half, more, halves[h]);
    if (!done.fault.empty()) throw InputError(capture.file, "", "its photographs can't be rendered: " + done.fault);
  }
  for (const Configuration& row : Predictions())
    result.predictions.push_back(runner.Run("render", row, with_material, pictures / FolderName(row.model, row.name)));
  if (options.fits)
    for (const Configuration& row : Fits())
      result.fits.push_back(runner.Run("fit", row, {}, fits / FolderName(row.model, row.name)));

  const Reference reference(capture, ObjectMasks(capture, material, options.threads, progress), halves);
  result.reference_de00_median = reference.noise_median();
  result.reference_de00_p95 = reference.noise_p95();
  for (TradeOffRow& row : result.predictions)
    if (row.fault.empty()) reference.Compare(pictures / FolderName(row.model, row.name), row);
  if (result.fits.empty()) return result;

  const bool last_is_whole = result.fits.back().fault.empty();
  const auto best_file = fits / FolderName(result.fits.back().model, result.fits.back().name) / "material.json";
  std::optional<Material> goal;
  if (has_truth) goal = ReadMaterialFile(truth_file, capture);
  if (!has_truth && last_is_whole) goal = ReadMaterialFile(best_file, capture);
  result.fitted_to = has_truth ? "truth.json" : last_is_whole ? "the fit by " + result.fits.back().name : "nothing";
  for (TradeOffRow& row : result.fits) {
    if (!row.fault.empty()) continue;
    const auto of_fit = fits / FolderName(row.model, row.name);
    const CrownRecord record = RecordOf(of_fit, capture.folder, row.arguments, HUGE_VAL);
    row.status = record.status;
    row.de00_median = record.de00_median.value_or(0.0);
    row.de00_p95 = record.de00_p95.value_or(0.0);
    if (goal && (has_truth || &row != &result.fits.back()))
      CompareValues(ReadMaterialRecord(of_fit / "material.json", capture), *goal, row);
  }
  return result;
}

}  // namespace crownfit
