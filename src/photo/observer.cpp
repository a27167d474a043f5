#include "photo/observer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace crownfit {
namespace {

constexpr double kFirst_nm = 380.0, kStep_nm = 5.0;

/// CIE 1931 2 degree colour matching functions x, y, z (ISO/CIE 11664-1:2019; CIE 15:2018, table 5) and the relative
/// power of illuminant D65 (ISO/CIE 11664-2:2022), from 380 to 780 nm in steps of 5 nm.
struct ObserverRow {
  double x, y, z, d65;
};
// clang-format off
constexpr std::array<ObserverRow, 81> kObserver{{
    {0.001368, 3.9e-05, 0.006450001, 49.9755}, {0.002236, 6.4e-05, 0.01054999, 52.3118},
    {0.004243, 0.00012, 0.02005001, 54.6482}, {0.00765, 0.000217, 0.03621, 68.7015},
    {0.01431, 0.000396, 0.06785001, 82.7549}, {0.02319, 0.00064, 0.1102, 87.1204}, {0.04351, 0.00121, 0.2074, 91.486},
    {0.07763, 0.00218, 0.3713, 92.4589}, {0.13438, 0.004, 0.6456, 93.4318}, {0.21477, 0.0073, 1.0390501, 90.057},
    {0.2839, 0.0116, 1.3856, 86.6823}, {0.3285, 0.01684, 1.62296, 95.7736}, {0.34828, 0.023, 1.74706, 104.865},
    {0.34806, 0.0298, 1.7826, 110.936}, {0.3362, 0.038, 1.77211, 117.008}, {0.3187, 0.048, 1.7441, 117.41},
    {0.2908, 0.06, 1.6692, 117.812}, {0.2511, 0.0739, 1.5281, 116.336}, {0.19536, 0.09098, 1.28764, 114.861},
    {0.1421, 0.1126, 1.0419, 115.392}, {0.09564, 0.13902, 0.8129501, 115.923}, {0.05795001, 0.1693, 0.6162, 112.367},
    {0.03201, 0.20802, 0.46518, 108.811}, {0.0147, 0.2586, 0.3533, 109.082}, {0.0049, 0.323, 0.272, 109.354},
    {0.0024, 0.4073, 0.2123, 108.578}, {0.0093, 0.503, 0.1582, 107.802}, {0.0291, 0.6082, 0.1117, 106.296},
    {0.06327, 0.71, 0.07824999, 104.79}, {0.1096, 0.7932, 0.05725001, 106.239}, {0.1655, 0.862, 0.04216, 107.689},
    {0.2257499, 0.9148501, 0.02984, 106.047}, {0.2904, 0.954, 0.0203, 104.405}, {0.3597, 0.9803, 0.0134, 104.225},
    {0.4334499, 0.9949501, 0.008749999, 104.046}, {0.5120501, 1, 0.005749999, 102.023}, {0.5945, 0.995, 0.0039, 100},
    {0.6784, 0.9786, 0.002749999, 98.1671}, {0.7621, 0.952, 0.0021, 96.3342}, {0.8425, 0.9154, 0.0018, 96.0611},
    {0.9163, 0.87, 0.001650001, 95.788}, {0.9786, 0.8163, 0.0014, 92.2368}, {1.0263, 0.757, 0.0011, 88.6856},
    {1.0567, 0.6949, 0.001, 89.3459}, {1.0622, 0.631, 0.0008, 90.0062}, {1.0456, 0.5668, 0.0006, 89.8026},
    {1.0026, 0.503, 0.00034, 89.5991}, {0.9384, 0.4412, 0.00024, 88.6489}, {0.8544499, 0.381, 0.00019, 87.6987},
    {0.7514, 0.321, 0.0001, 85.4936}, {0.6424, 0.265, 4.999999e-05, 83.2886}, {0.5419, 0.217, 3e-05, 83.4939},
    {0.4479, 0.175, 2e-05, 83.6992}, {0.3608, 0.1382, 1e-05, 81.863}, {0.2835, 0.107, 2.117582368e-22, 80.0268},
    {0.2187, 0.0816, 0, 80.1207}, {0.1649, 0.061, 0, 80.2146}, {0.1212, 0.04458, 0, 81.2462},
    {0.0874, 0.032, 0, 82.2778}, {0.0636, 0.0232, 0, 80.281}, {0.04677, 0.017, 0, 78.2842},
    {0.0329, 0.01192, 0, 74.0027}, {0.0227, 0.00821, 0, 69.7213}, {0.01584, 0.005723, 0, 70.6652},
    {0.01135916, 0.004102, 0, 71.6091}, {0.008110916, 0.002929, 0, 72.979}, {0.005790346, 0.002091, 0, 74.349},
    {0.004109457, 0.001484, 0, 67.9765}, {0.002899327, 0.001047, 0, 61.604}, {0.00204919, 0.00074, 0, 65.7448},
    {0.001439971, 0.00052, 0, 69.8856}, {0.0009999493, 0.0003611, 0, 72.4863}, {0.0006900786, 0.0002492, 0, 75.087},
    {0.0004760213, 0.0001719, 0, 69.3398}, {0.0003323011, 0.00012, 0, 63.5927}, {0.0002348261, 8.48e-05, 0, 55.0054},
    {0.0001661505, 6e-05, 0, 46.4182}, {0.000117413, 4.24e-05, 0, 56.6118}, {8.307527e-05, 3e-05, 0, 66.8054},
    {5.870652e-05, 2.12e-05, 0, 65.0941}, {4.150994e-05, 1.499e-05, 0, 63.3828},
}};
// clang-format on

/// The two channels around a wavelength, and the share of the second; the same one twice beyond the outermost.
struct Between {
  size_t low, high;
  double share;
};
Between ChannelsAround(double nm, std::span<const double> wavelengths_nm, std::span<const size_t> ascending) {
  const auto above =
      std::find_if(ascending.begin(), ascending.end(), [&](size_t c) { return wavelengths_nm[c] >= nm; });
  if (above == ascending.begin()) return {ascending.front(), ascending.front(), 0.0};
  if (above == ascending.end()) return {ascending.back(), ascending.back(), 0.0};
  const size_t high = *above, low = *(above - 1);
  return {low, high, (nm - wavelengths_nm[low]) / (wavelengths_nm[high] - wavelengths_nm[low])};
}

bool CoverTheVisible(std::span<const double> wavelengths_nm) {
  constexpr size_t kFewest = 8;
  constexpr double kFrom_nm = 400.0, kTo_nm = 700.0, kFurthest_nm = 30.0;
  if (wavelengths_nm.size() < kFewest) return false;
  for (int step = 0; kFrom_nm + kStep_nm * step <= kTo_nm; ++step) {
    const double nm = kFrom_nm + kStep_nm * step;
    if (std::ranges::none_of(wavelengths_nm, [&](double at) { return std::abs(at - nm) <= kFurthest_nm; }))
      return false;
  }
  return true;
}

}  // namespace

std::optional<std::vector<glm::dvec3>> ObserverColumns(std::span<const double> wavelengths_nm) {
  if (!CoverTheVisible(wavelengths_nm)) return std::nullopt;
  std::vector<size_t> ascending(wavelengths_nm.size());
  std::iota(ascending.begin(), ascending.end(), size_t{0});
  std::ranges::stable_sort(ascending, {}, [&](size_t c) { return wavelengths_nm[c]; });
  std::vector<glm::dvec3> xyz(wavelengths_nm.size(), glm::dvec3(0.0));
  glm::dvec3 white(0.0);
  for (size_t i = 0; i < kObserver.size(); ++i) {
    const ObserverRow& row = kObserver[i];
    const glm::dvec3 seen = row.d65 * glm::dvec3(row.x, row.y, row.z);
    const Between at = ChannelsAround(kFirst_nm + kStep_nm * static_cast<double>(i), wavelengths_nm, ascending);
    xyz[at.low] += (1.0 - at.share) * seen;
    xyz[at.high] += at.share * seen;
    white += seen;
  }
  std::vector<glm::dvec3> columns;
  for (const glm::dvec3& of_channel : xyz) columns.push_back(LinearRgbFromRelativeXyz(of_channel / white));
  return columns;
}

bool HaveColour(std::span<const double> wavelengths_nm) {
  return wavelengths_nm.size() == 3 || CoverTheVisible(wavelengths_nm);
}

ColourTransform ColourOfChannels(std::span<const double> wavelengths_nm) {
  return {ObserverColumns(wavelengths_nm).value_or(std::vector<glm::dvec3>()), {}};
}

}  // namespace crownfit
