#include "photo/colour.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/text.h"

namespace crownfit {

namespace {

/// IEC 61966-2-1; columns for r, g, b.
const glm::dmat3 kXyzFromLinearRgb({0.4124564, 0.2126729, 0.0193339}, {0.3575761, 0.7151522, 0.1191920},
                                   {0.1804375, 0.0721750, 0.9503041});
const glm::dvec3 kD65(0.95047, 1.0, 1.08883);

/// The inverse of CIELAB's cube root with its linear start.
double Cube(double t) { return t > 6.0 / 29.0 ? t * t * t : (116.0 * t - 16.0) * 27.0 / 24389.0; }

}  // namespace

glm::dvec3 LabFromLinearRgb(const glm::dvec3& rgb) {
  const glm::dvec3 xyz = kXyzFromLinearRgb * rgb / kD65;
  const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
  const double fx = f(xyz.x), fy = f(xyz.y), fz = f(xyz.z);
  return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

double LuminanceOf(const glm::dvec3& rgb) { return (kXyzFromLinearRgb * rgb).y; }

bool AreRedGreenBlue(std::span<const double> nm) {
  if (nm.size() != 3) return false;
  const auto is_within = [](double v, double low, double high) { return low <= v && v <= high; };
  return nm[0] > nm[1] && nm[1] > nm[2] && is_within(nm[0], 570, 700) && is_within(nm[1], 490, 600) &&
         is_within(nm[2], 400, 510);
}

bool AreSameBands(std::span<const double> some_nm, std::span<const double> others_nm) {
  constexpr double kSame_nm = 10.0;
  return std::equal(some_nm.begin(), some_nm.end(), others_nm.begin(), others_nm.end(),
                    [](double a, double b) { return std::abs(a - b) <= kSame_nm; });
}

std::string BandsText(std::span<const double> nm) {
  std::string text;
  for (const double v : nm) text += (text.empty() ? "" : ", ") + std::to_string(std::lround(v));
  return text + " nm";
}

glm::dvec3 LinearRgbFromRelativeXyz(const glm::dvec3& xyz) { return glm::inverse(kXyzFromLinearRgb) * (kD65 * xyz); }

glm::dvec3 LinearRgbFromLab(const glm::dvec3& lab) {
  const double fy = (lab.x + 16.0) / 116.0;
  return glm::inverse(kXyzFromLinearRgb) *
         (kD65 * glm::dvec3(Cube(fy + lab.y / 500.0), Cube(fy), Cube(fy - lab.z / 200.0)));
}

double Ciede2000(const glm::dvec3& lab1, const glm::dvec3& lab2) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double c_mean = 0.5 * (std::hypot(lab1.y, lab1.z) + std::hypot(lab2.y, lab2.z));
  const double c7 = std::pow(c_mean, 7), g = 0.5 * (1.0 - std::sqrt(c7 / (c7 + std::pow(25.0, 7))));
  const double a1 = (1.0 + g) * lab1.y, a2 = (1.0 + g) * lab2.y;
  const double c1 = std::hypot(a1, lab1.z), c2 = std::hypot(a2, lab2.z);
  const auto hue = [&](double a, double b) {
    if (a == 0 && b == 0) return 0.0;
    const double h = std::atan2(b, a) / kDegree;
    return h < 0 ? h + 360.0 : h;
  };
  const double h1 = hue(a1, lab1.z), h2 = hue(a2, lab2.z);
  const bool grey = c1 * c2 == 0;
  double dh = grey ? 0.0 : h2 - h1;
  if (dh > 180) dh -= 360;
  if (dh < -180) dh += 360;
  const double dl = lab2.x - lab1.x, dc = c2 - c1, dH = 2 * std::sqrt(c1 * c2) * std::sin(0.5 * dh * kDegree);
  const double l = 0.5 * (lab1.x + lab2.x), c = 0.5 * (c1 + c2);
  double h = h1 + h2;
  if (!grey) {
    if (std::abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 360 : -360;
    h *= 0.5;
  }
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double cc7 = std::pow(c, 7), rc = 2 * std::sqrt(cc7 / (cc7 + std::pow(25.0, 7)));
  const double turn = 30 * std::exp(-std::pow((h - 275) / 25, 2)), rt = -rc * std::sin(2 * turn * kDegree);
  const double l50 = (l - 50) * (l - 50), sl = 1 + 0.015 * l50 / std::sqrt(20 + l50), sc = 1 + 0.045 * c,
               sh = 1 + 0.015 * c * t;
  const double u = dl / sl, v = dc / sc, w = dH / sh;
  return std::sqrt(std::max(0.0, u * u + v * v + w * w + rt * v * w));
}

glm::dvec3 LinearRgbFromLabD50(const glm::dvec3& lab) {
  const double fy = (lab.x + 16.0) / 116.0;
  const glm::dvec3 d50(0.96422 * Cube(fy + lab.y / 500.0), Cube(fy), 0.82521 * Cube(fy - lab.z / 200.0));
  // Bradford's adaptation from D50 to D65 (Lam 1985; matrix of Lindbloom), then IEC 61966-2-1.
  const glm::dvec3 d65(0.9555766 * d50.x - 0.0230393 * d50.y + 0.0631636 * d50.z,
                       -0.0282895 * d50.x + 1.0099416 * d50.y + 0.0210077 * d50.z,
                       0.0122982 * d50.x - 0.0204830 * d50.y + 1.3299098 * d50.z);
  return {3.2404542 * d65.x - 1.5371385 * d65.y - 0.4985314 * d65.z,
          -0.9692660 * d65.x + 1.8760108 * d65.y + 0.0415560 * d65.z,
          0.0556434 * d65.x - 0.2040259 * d65.y + 1.0572252 * d65.z};
}

std::array<double, 6> RootTerms(const glm::dvec3& v) {
  const auto root = [](double a, double b) { return std::sqrt(std::max(0.0, a) * std::max(0.0, b)); };
  return {v.x, v.y, v.z, root(v.x, v.y), root(v.y, v.z), root(v.x, v.z)};
}

glm::dvec3 ColourTransform::operator()(const Spectrum& sensor) const {
  glm::dvec3 rgb(0.0);
  if (root_polynomial) {
    const auto terms = RootTerms({sensor[0], sensor[1], sensor[2]});
    for (int i = 0; i < 6; ++i) rgb += terms[i] * (*root_polynomial)[i];
    return rgb;
  }
  if (columns.empty())
    return sensor.size() == 3 ? glm::dvec3(sensor[0], sensor[1], sensor[2]) : glm::dvec3(sensor.Mean());
  for (size_t c = 0; c < columns.size(); ++c) rgb += columns[c] * sensor[static_cast<int>(c)];
  return rgb;
}

Spectrum BandColour::Reflectance(const glm::dvec3& linear_rgb, int channels) const {
  Spectrum x(channels, std::max(0.01, LuminanceOf(linear_rgb)));
  const int steps = rgb_from_sensor.root_polynomial ? 20 : 2;
  for (int step = 0; step < steps; ++step) {
    const glm::dvec3 at = LinearRgb(x);
    std::vector<glm::dvec3> slope;
    glm::dmat3 square(0.0);
    for (int c = 0; c < channels; ++c) {
      Spectrum beside = x;
      beside[c] += 1e-6;
      slope.push_back((LinearRgb(beside) - at) / 1e-6);
      square += glm::outerProduct(slope.back(), slope.back());
    }
    // The shortest change that leads to the wanted colour.
    const glm::dvec3 weight = glm::inverse(square) * (linear_rgb - at);
    for (int c = 0; c < channels; ++c) x[c] += glm::dot(slope[static_cast<size_t>(c)], weight);
  }
  constexpr double kConverged = 1e-6;
  if (!(glm::distance(LinearRgb(x), linear_rgb) < kConverged * std::max(1.0, glm::length(linear_rgb))))
    throw InputError("", "rgb_from_sensor",
                     Printed("no reflectance in the camera's bands has the colour R %.3g, G %.3g, B %.3g", linear_rgb.r,
                             linear_rgb.g, linear_rgb.b),
                     "Calibrate the camera's colours with a matrix instead of a root polynomial.");
  return x;
}

}  // namespace crownfit
