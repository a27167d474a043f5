#include "calibration/estimate_lights.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <set>

#include "base/linear_algebra.h"
#include "calibration/draw.h"
#include "scene/light_samples.h"

namespace crownfit {

namespace {

/// Readings of one card: positions on it, and the photograph's values.
struct CardReading {
  glm::dvec3 position_mm, normal;  ///< in the camera frame
  glm::dvec2 pixel;
  glm::dvec3 value, reflectance;
  size_t photograph;
};

std::vector<CardReading> ReadCards(const std::vector<const CardPhotograph*>& cards) {
  constexpr int kGrid = 14;
  std::vector<CardReading> readings;
  for (size_t k = 0; k < cards.size(); ++k) {
    const CardPhotograph& card = *cards[k];
    for (int i = 0; i < kGrid * kGrid; ++i) {
      const int column = i % kGrid, row = i / kGrid;
      const glm::dvec2 share((column + 0.5) / kGrid, (row + 0.5) / kGrid);
      const glm::dvec3 at = card.camera_from_card.Point(glm::dvec3(glm::mix(card.low_mm, card.high_mm, share), 0.0));
      const auto pixel = PixelFromPoint(card.camera, at);
      if (!pixel) continue;
      const int x0 = static_cast<int>(pixel->x), y0 = static_cast<int>(pixel->y);
      constexpr int kRadius = 2;
      if (x0 < kRadius || y0 < kRadius || x0 >= card.linear->width - kRadius || y0 >= card.linear->height - kRadius)
        continue;
      glm::dvec3 sum(0.0);
      bool saturated = false;
      for (int y = y0 - kRadius; y <= y0 + kRadius; ++y)
        for (int x = x0 - kRadius; x <= x0 + kRadius; ++x)
          for (int c = 0; c < 3; ++c) {
            const double v = card.linear->at(x, y, std::min(c, card.linear->channels - 1));
            saturated |= v >= card.saturation[c];
            sum[c] += v / 25.0;
          }
      if (saturated || sum.x <= 0 || sum.y <= 0 || sum.z <= 0) continue;
      readings.push_back({at, card.camera_from_card.Direction({0, 0, -1}), *pixel, sum, card.reflectance, k});
    }
  }
  return readings;
}

glm::dvec3 IrradianceAt(const LightShape& shape, const glm::dvec3& at, const glm::dvec3& normal) {
  std::vector<LightSample> samples;
  SampleLight(shape, at, normal, 4, samples);
  Spectrum sum;
  for (const LightSample& s : samples) sum += s.weight * std::max(0.0, glm::dot(s.direction, normal));
  return VectorOf(sum);
}

/// Log ratios of reading to prediction, less their mean in each channel: independent of the intensity.
struct ShapeResiduals {
  const std::vector<CardReading>& readings;
  const Light& start;
  double noise;  ///< relative, of a reading

  std::vector<glm::dvec3> Ratios(const glm::dvec3& shift) const {
    const LightShape shape = Transformed(start.shape, {glm::dmat3(1.0), shift});
    std::vector<glm::dvec3> ratios;
    for (const CardReading& r : readings)
      ratios.push_back(r.value /
                       glm::max(glm::dvec3(1e-12), r.reflectance * IrradianceAt(shape, r.position_mm, r.normal)));
    return ratios;
  }
  /// Relative rms of the residuals.
  double Rms(const double* shift) const {
    std::vector<double> left(3 * readings.size());
    (*this)(shift, left.data());
    double sum = 0;
    for (const double r : left) sum += r * r;
    return noise * std::sqrt(sum / static_cast<double>(left.size()));
  }
  bool operator()(const double* shift, double* residuals) const {
    const auto ratios = Ratios({shift[0], shift[1], shift[2]});
    glm::dvec3 mean(0.0);
    for (const auto& r : ratios) mean += glm::log(r) / static_cast<double>(ratios.size());
    for (size_t i = 0; i < ratios.size(); ++i)
      for (int c = 0; c < 3; ++c) residuals[3 * i + c] = (std::log(ratios[i][c]) - mean[c]) / noise;
    return true;
  }
};

/// Prior on the position, at its measured value.
ceres::CostFunction* PlacePrior(const glm::dmat3& covariance_mm2) {
  constexpr double kLeast = 1e-6;  // of the largest variance
  const auto [variances, directions] =
      EigenOfSymmetric(Eigen::Map<const Eigen::Matrix3d>(glm::value_ptr(covariance_mm2)));
  const Eigen::VectorXd stddev = variances.cwiseMax(kLeast * variances[2]).cwiseSqrt();
  return new ceres::NormalPrior(stddev.cwiseInverse().asDiagonal() * directions.transpose(), Eigen::VectorXd::Zero(3));
}

}  // namespace

std::optional<CardFit> FitCards(const Light& start, const std::vector<const CardPhotograph*>& cards, bool refine) {
  const std::vector<CardReading> readings = ReadCards(cards);
  if (readings.size() < 10) return std::nullopt;
  CardFit fit;
  fit.light = start;
  glm::dvec3 shift(0.0);
  // Residuals are shared by neighbouring readings and by channels (a card's texture, a lamp's pattern, a lens's
  // fall-off): a card counts as four readings.
  constexpr double kOfACard = 4.0, kLeast = 0.002;
  std::set<size_t> read;
  for (const CardReading& r : readings) read.insert(r.photograph);
  const auto used = static_cast<double>(read.size());
  const bool has_place = !std::holds_alternative<DirectionalLight>(start.shape) && !IsAllAround(start.shape);
  double of_reading = 0.01;  // relative residual of a reading
  for (int round = 0; refine && has_place; ++round) {
    constexpr int kMostRounds = 10;
    const double more = std::sqrt(3.0 * static_cast<double>(readings.size()) / (kOfACard * used));
    const ShapeResiduals residuals{readings, start, more * of_reading};
    ceres::Problem problem;
    problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<ShapeResiduals, ceres::CENTRAL, ceres::DYNAMIC, 3>(
            new ShapeResiduals(residuals), ceres::TAKE_OWNERSHIP, static_cast<int>(3 * readings.size())),
        nullptr, &shift.x);
    problem.AddResidualBlock(PlacePrior(start.Stddev_mm() > 0 ? start.covariance_mm2 : glm::dmat3(25.0)), nullptr,
                             &shift.x);
    ceres::Solver::Options options;
    options.max_num_iterations = 50;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    const double found = std::max(kLeast, residuals.Rms(&shift.x));
    if (round < kMostRounds && std::abs(found - of_reading) > 0.1 * of_reading) {
      of_reading = found;
      continue;
    }
    ceres::Covariance covariance({});
    const std::vector<std::pair<const double*, const double*>> blocks{{&shift.x, &shift.x}};
    double block[9];
    if (covariance.Compute(blocks, &problem) && covariance.GetCovarianceBlock(&shift.x, &shift.x, block))
      fit.light.covariance_mm2 = glm::make_mat3(block);
    fit.light.shape = Transformed(start.shape, {glm::dmat3(1.0), shift});
    fit.moved_mm = glm::length(shift);
    break;
  }
  const auto ratios = ShapeResiduals{readings, start, 1.0}.Ratios(shift);
  // One intensity for all: the mean of the cards' means, so that a card near the lamp does not outweigh the others.
  glm::dvec3 mean(0.0);
  std::vector<glm::dvec3> of_card(cards.size(), glm::dvec3(0.0));
  std::vector<double> counts(cards.size(), 0.0);
  for (size_t i = 0; i < ratios.size(); ++i)
    of_card[readings[i].photograph] += glm::log(ratios[i]), ++counts[readings[i].photograph];
  for (size_t k = 0; k < cards.size(); ++k)
    if (counts[k] > 0) mean += of_card[k] / counts[k];
  mean /= used;
  fit.light.shape = Scaled(fit.light.shape, glm::exp(mean));
  fit.light.scale_is_free = false;
  fit.samples.resize(cards.size());
  glm::dvec3 squares(0.0);
  for (size_t i = 0; i < ratios.size(); ++i) {
    const glm::dvec3 left = glm::exp(glm::log(ratios[i]) - mean) - 1.0;
    squares += left * left / static_cast<double>(ratios.size());
    fit.samples[readings[i].photograph].push_back({readings[i].pixel, left.y});
  }
  fit.rms = std::sqrt((squares.x + squares.y + squares.z) / 3.0);
  fit.stddev = glm::sqrt(squares / (kOfACard * used));
  return fit;
}

namespace {

/// The cards' pictures with their residuals.
Image LightsPicture(const std::vector<std::pair<const CardPhotograph*, const std::vector<CardFit::Sample>*>>& cards) {
  constexpr int kWidth = 260, kLine = 18;
  const int columns = std::min<int>(4, static_cast<int>(cards.size()));
  const Image& first = *cards[0].first->linear;
  const int height = kWidth * first.height / first.width;
  const int rows = (static_cast<int>(cards.size()) + columns - 1) / columns;
  Image picture(columns * kWidth, rows * (height + kLine) + kLine, 3, 1.0f);
  for (size_t k = 0; k < cards.size(); ++k) {
    const int x0 = static_cast<int>(k) % columns * kWidth,
              y0 = static_cast<int>(k) / columns * (height + kLine) + kLine;
    const Image& image = *cards[k].first->linear;
    const double zoom = static_cast<double>(kWidth) / image.width;
    const Image shown = DisplayCopy(image, zoom);
    for (int y = 0; y < std::min(height, shown.height); ++y)
      for (int x = 0; x < std::min(kWidth, shown.width); ++x)
        for (int c = 0; c < 3; ++c) picture.at(x0 + x, y0 + y, c) = shown.at(x, y, c);
    for (const auto& s : *cards[k].second) {
      const double t = std::clamp(s.left / 0.1, -1.0, 1.0);  // blue: darker than predicted, red: lighter
      DrawDot(picture, glm::dvec2(x0, y0) + zoom * s.pixel, 4,
              t < 0 ? glm::dvec3(1 + t, 1 + t, 1) : glm::dvec3(1, 1 - t, 1 - t));
    }
    DrawText(picture, x0 + 4, y0 - 5, 12, cards[k].first->light, 0.0f);
  }
  DrawText(picture, 4, picture.height - 4, 12,
           "dots: 10 % darker than predicted (blue), as predicted (white), 10 % lighter (red)", 0.0f);
  return picture;
}

}  // namespace

Product LightsProduct(const std::vector<Light>& geometry, const std::vector<CardPhotograph>& cards, bool refine,
                      std::vector<std::string> notes) {
  constexpr double kLargestRms = 0.1, kGoodRms = 0.04, kLargest_deg = 5.0;
  Product product;
  product.format = "crownfit-light-rig/1";
  product.notes = std::move(notes);
  std::vector<Light> lights;
  std::vector<CardFit> fits;
  std::vector<std::pair<const CardPhotograph*, std::pair<size_t, size_t>>> drawn;
  for (const Light& start : geometry) {
    std::vector<const CardPhotograph*> of_light;
    for (const auto& card : cards)
      if (card.light == start.name) of_light.push_back(&card);
    Light light = start;
    if (const auto* p = std::get_if<PointLight>(&start.shape)) {
      product.figures.push_back({start.name + "_x", p->position_mm.x, "mm"});
      product.figures.push_back({start.name + "_y", p->position_mm.y, "mm"});
      product.figures.push_back({start.name + "_z", p->position_mm.z, "mm"});
    }
    if (start.Stddev_mm() > 0) product.figures.push_back({start.name + "_stddev", start.Stddev_mm(), "mm"});
    if (start.stddev_deg > 0) product.figures.push_back({start.name + "_direction_stddev", start.stddev_deg, "deg"});
    if (start.stddev_deg > kLargest_deg)
      product.refusals.push_back("light " + start.name + ": its direction is only known to " +
                                 Text(start.stddev_deg, "degrees") + ". Photograph the ball at least 100 px wide.");
    if (of_light.empty()) {
      product.notes.push_back("light " + start.name + ": no card was photographed under it" +
                              (start.scale_is_free
                                   ? ", so its intensity is unknown (1 at the ball) and every fit frees it. Absorption "
                                     "is determined far better if the intensity is known."
                                   : "; its intensity is that of the rig."));
    } else if (const auto fit = FitCards(start, of_light, refine)) {
      light = fit->light;
      // A good card's reflectance is known to a hundredth.
      light.intensity_stddev = std::hypot(0.01, std::max({fit->stddev.x, fit->stddev.y, fit->stddev.z}));
      product.figures.push_back({start.name + "_card_rms", 100 * fit->rms, "%"});
      product.figures.push_back(
          {start.name + "_intensity_stddev", 100 * std::max({fit->stddev.x, fit->stddev.y, fit->stddev.z}), "%"});
      if (refine) product.figures.push_back({start.name + "_moved", fit->moved_mm, "mm"});
      if (fit->rms > kLargestRms)
        product.refusals.push_back("light " + start.name +
                                   ": the card's shading disagrees with the place of the lamp by " +
                                   Text(100 * fit->rms, "%") +
                                   ". Check the place of the lamp, the pose of the card, that no second lamp is on, "
                                   "and that the card is matt.");
      else if (fit->rms > kGoodRms)
        product.notes.push_back("light " + start.name + ": the card's shading differs from the prediction by " +
                                Text(100 * fit->rms, "%") + ". The lamp may be larger than stated, or uneven.");
      for (size_t k = 0; k < of_light.size(); ++k) drawn.push_back({of_light[k], {fits.size(), k}});
      fits.push_back(*fit);
    } else {
      product.refusals.push_back(
          "light " + start.name +
          ": the card could not be read. It is saturated or outside the picture, or its pose is wrong.");
    }
    lights.push_back(light);
  }
  for (const auto& card : cards)
    if (std::none_of(geometry.begin(), geometry.end(), [&](const Light& l) { return l.name == card.light; }))
      product.refusals.push_back("a card was photographed under '" + card.light +
                                 "', but this light is neither on a ball nor in the rig");
  product.content = {{"lights", LightsJson(lights)}};
  std::vector<std::pair<const CardPhotograph*, const std::vector<CardFit::Sample>*>> pictures;
  for (const auto& [card, at] : drawn) pictures.emplace_back(card, &fits[at.first].samples[at.second]);
  if (!pictures.empty()) product.picture = LightsPicture(pictures);
  return product;
}

}  // namespace crownfit
