#include "capture/environment_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/error.h"
#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr size_t kMostFarLamps = 512;

/// Interval of `ends` (cumulative up to 1) that holds u, and how far into it u lies.
std::pair<size_t, double> Choose(const double* ends, size_t count, double u) {
  const size_t i = std::min<size_t>(std::upper_bound(ends, ends + count, u) - ends, count - 1);
  const double begin = i == 0 ? 0.0 : ends[i - 1], width = ends[i] - begin;
  return {i, width > 0 ? std::clamp((u - begin) / width, 0.0, 1.0) : 0.5};
}

Spectrum ChannelsOf(const Image& image, size_t pixel) {
  return image.channels == 1 ? Spectrum(static_cast<double>(image.values[pixel])) : crownfit::PixelOf(image, pixel);
}

/// In single precision, as maps have always been summed.
double MeanOf(const Image& image, size_t pixel) {
  const float* p = &image.values[pixel * image.channels];
  return std::accumulate(p, p + image.channels, 0.0f) / static_cast<double>(image.channels);
}

struct Part {
  int top, bottom, left, right;  ///< of a FineGrid, ends excluded
};

struct LitPart {
  Part part;
  EnvironmentMap::FarLamp lamp;
  double spread;  ///< total light, less the length of its vector sum
};

/// A map's pixels, cut into smaller ones where they are coarse.
class FineGrid {
 public:
  explicit FineGrid(const Image& radiance)
      : radiance_(radiance),
        cut_((kLeastRows + radiance.height - 1) / radiance.height),
        height_(cut_ * radiance.height),
        width_(cut_ * radiance.width) {
    for (int y = 0; y <= height_; ++y) edge_.push_back(std::cos(kPi * y / height_));
    for (int y = 0; y < height_; ++y) sine_.push_back(std::sin(kPi * (y + 0.5) / height_));
    for (int x = 0; x < width_; ++x) {
      const double longitude = kPi * (1.0 - 2.0 * (x + 0.5) / width_);
      towards_.emplace_back(std::sin(longitude), std::cos(longitude));
    }
  }

  Part Whole() const { return {0, height_, 0, width_}; }

  LitPart Lit(const Part& part) const {
    Spectrum light(0.0);
    glm::dvec3 mean(0.0);
    ForPixels(part, [&](int, int, const Spectrum& l, const glm::dvec3& weighted) {
      light += l;
      mean += weighted;
    });
    LitPart lit{part, {}, 0.0};
    lit.lamp.low = glm::dvec2(part.left, part.top) / glm::dvec2(width_, height_);
    lit.lamp.high = glm::dvec2(part.right, part.bottom) / glm::dvec2(width_, height_);
    const double sum = light.Sum(), length = glm::length(mean);
    lit.spread = sum - length;
    if (length > 0) {
      lit.lamp.direction = mean / length;
      lit.lamp.irradiance = light * (length / sum);
      lit.lamp.radius_rad = 2.0 * std::sqrt(std::max(0.0, lit.spread / sum));
    }
    return lit;
  }

  /// Cuts where the remaining spread of both halves is least.
  std::pair<Part, Part> Cut(const Part& part) const {
    std::vector<glm::dvec3> rows(part.bottom - part.top, glm::dvec3(0.0)),
        columns(part.right - part.left, glm::dvec3(0.0));
    ForPixels(part, [&](int x, int y, const Spectrum&, const glm::dvec3& weighted) {
      rows[y - part.top] += weighted;
      columns[x - part.left] += weighted;
    });
    const auto [row, by_rows] = BestCut(rows);
    const auto [column, by_columns] = BestCut(columns);
    Part first = part, second = part;
    if (by_rows > by_columns)
      first.bottom = second.top = part.top + row;
    else
      first.right = second.left = part.left + column;
    return {first, second};
  }

 private:
  static constexpr int kLeastRows = 64;

  /// The slice before which to cut (0: no cut), and the summed lengths of both halves' vector sums.
  static std::pair<int, double> BestCut(const std::vector<glm::dvec3>& slices) {
    glm::dvec3 after = std::accumulate(slices.begin(), slices.end(), glm::dvec3(0.0)), before(0.0);
    std::pair<int, double> best{0, 0.0};
    for (size_t cut = 1; cut < slices.size(); ++cut) {
      before += slices[cut - 1];
      after -= slices[cut - 1];
      const double length = glm::length(before) + glm::length(after);
      if (length > best.second) best = {static_cast<int>(cut), length};
    }
    return best;
  }

  /// `use(x, y, light, direction times the sum of its channels)`.
  template <class Use>
  void ForPixels(const Part& part, const Use& use) const {
    for (int y = part.top; y < part.bottom; ++y)
      for (int x = part.left; x < part.right; ++x) {
        const Spectrum radiance = ChannelsOf(radiance_, static_cast<size_t>(y / cut_) * radiance_.width + x / cut_);
        const Spectrum light = 2.0 * kPi / width_ * (edge_[y] - edge_[y + 1]) * radiance;
        const glm::dvec3 direction(sine_[y] * towards_[x].x, 0.5 * (edge_[y] + edge_[y + 1]), sine_[y] * towards_[x].y);
        use(x, y, light, light.Sum() * direction);
      }
  }

  const Image& radiance_;
  const int cut_, height_, width_;
  std::vector<double> edge_;         ///< of a row: cosine
  std::vector<double> sine_;         ///< of a row's middle
  std::vector<glm::dvec2> towards_;  ///< +x and +z, of a column's middle
};

}  // namespace

EnvironmentMap::EnvironmentMap(Image radiance) : radiance_(std::move(radiance)) {
  const size_t width = radiance_.width, height = radiance_.height;
  column_ends_.resize(width * height);
  for (size_t y = 0; y < height; ++y) {
    double sum = 0;
    for (size_t x = 0; x < width; ++x) {
      sum += MeanOf(radiance_, y * width + x);
      column_ends_[y * width + x] = sum;
    }
    for (size_t x = 0; x < width && sum > 0; ++x) column_ends_[y * width + x] /= sum;
    total_ += sum * SolidAngle(static_cast<int>(y));
    row_ends_.push_back(total_);
  }
  for (double& end : row_ends_) end /= total_;
  CutIntoLamps();
}

void EnvironmentMap::CutIntoLamps() {
  const FineGrid grid(radiance_);
  const auto less_spread = [](const LitPart& a, const LitPart& b) { return a.spread < b.spread; };
  std::vector<LitPart> parts{grid.Lit(grid.Whole())};  // a heap
  for (size_t count = 1; count <= kMostFarLamps; count *= 2) {
    while (parts.size() < count) {
      std::pop_heap(parts.begin(), parts.end(), less_spread);
      const auto [first, second] = grid.Cut(parts.back().part);
      parts.back() = grid.Lit(first);
      std::push_heap(parts.begin(), parts.end(), less_spread);
      parts.push_back(grid.Lit(second));
      std::push_heap(parts.begin(), parts.end(), less_spread);
    }
    for (const LitPart& p : parts) far_lamps_.push_back(p.lamp);
  }
}

std::span<const EnvironmentMap::FarLamp> EnvironmentMap::FarLamps(size_t at_most) const {
  const size_t count = std::bit_floor(std::clamp<size_t>(at_most, 1, kMostFarLamps));
  return std::span(far_lamps_).subspan(count - 1, count);
}

double EnvironmentMap::SolidAngle(int row) const {
  const double top = kPi * row / radiance_.height, bottom = kPi * (row + 1) / radiance_.height;
  return 2.0 * kPi / radiance_.width * (std::cos(top) - std::cos(bottom));
}

glm::dvec2 EnvironmentMap::PlaceOf(const glm::dvec3& d) {
  return {0.5 * (1.0 - std::atan2(d.x, d.z) / kPi), std::acos(std::clamp(d.y, -1.0, 1.0)) / kPi};
}

size_t EnvironmentMap::PixelOf(const glm::dvec3& direction) const {
  const glm::dvec2 place = PlaceOf(direction);
  const size_t x = std::min<size_t>(static_cast<size_t>(place.x * radiance_.width), radiance_.width - 1),
               y = std::min<size_t>(static_cast<size_t>(place.y * radiance_.height), radiance_.height - 1);
  return y * radiance_.width + x;
}

Spectrum EnvironmentMap::Radiance(const glm::dvec3& direction) const {
  return ChannelsOf(radiance_, PixelOf(direction));
}

glm::dvec3 EnvironmentMap::Sample(const glm::dvec2& uniform) const {
  const auto [y, down] = Choose(row_ends_.data(), row_ends_.size(), uniform.x);
  const auto [x, right] = Choose(&column_ends_[y * radiance_.width], radiance_.width, uniform.y);
  const double top = std::cos(kPi * static_cast<double>(y) / radiance_.height),
               bottom = std::cos(kPi * static_cast<double>(y + 1) / radiance_.height);
  const double height = top + down * (bottom - top), sine = std::sqrt(std::max(0.0, 1.0 - height * height));
  const double longitude = kPi * (1.0 - 2.0 * (static_cast<double>(x) + right) / radiance_.width);
  return {sine * std::sin(longitude), height, sine * std::cos(longitude)};
}

double EnvironmentMap::Density(const glm::dvec3& direction) const {
  return MeanOf(radiance_, PixelOf(direction)) / total_;
}

std::shared_ptr<const EnvironmentMap> ReadEnvironmentMap(const std::filesystem::path& file,
                                                         const std::vector<std::string>& names) {
  const ImageFile read = ReadImageFile(file, names);
  const Image& image = read.image;
  const Transfer transfer = Resolved(read.transfer, {}, file, "");
  if (image.width != 2 * image.height)
    throw InputError(file, "",
                     "an environment map must be twice as wide as high, but this one is " +
                         std::to_string(image.width) + " x " + std::to_string(image.height),
                     "Give a latitude-longitude panorama.");
  const int found = image.channels - (read.alpha_channel >= 0 ? 1 : 0), wanted = static_cast<int>(names.size()),
            channels = found < 3 && wanted != found ? 1 : std::max(1, found);
  if (wanted > 0 && channels != 1 && channels != wanted)
    throw InputError(file, "",
                     "the environment map has " + std::to_string(channels) + " channels, but the capture has " +
                         std::to_string(wanted),
                     "Give one with the capture's channels, or a grey one.");
  Image radiance(image.width, image.height, channels);
  double sum = 0;
  for (size_t p = 0; p < radiance.values.size() / channels; ++p)
    for (int c = 0; c < channels; ++c) {
      const float v = image.values[p * image.channels + c];
      if (v < 0)
        throw InputError(file, "",
                         "the environment map has a negative value at column " + std::to_string(p % image.width) +
                             ", row " + std::to_string(p / image.width),
                         "Light can't be negative: clamp such values to 0.");
      radiance.values[channels * p + c] = static_cast<float>(transfer.Light(v, c));
      sum += radiance.values[channels * p + c];
    }
  if (!(sum > 0)) throw InputError(file, "", "the environment map is black");
  return std::make_shared<EnvironmentMap>(std::move(radiance));
}

}  // namespace crownfit
