#include "calibration/estimate_blur.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "calibration/draw.h"
#include "calibration/opencv_image.h"

namespace crownfit {
namespace {

constexpr double kReach_px = 12.0;
// Three-point Gauss-Legendre rule over a pixel's square.
constexpr double kNode = 0.3872983346207417, kNodes[] = {-kNode, 0.0, kNode},
                 kWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

/// Fraction of a Gaussian's light that passes a step at distance x.
template <class T>
T Step(const T& x, const T& sigma) {
  using std::erf;
  return 0.5 + 0.5 * erf(x / (std::numbers::sqrt2 * sigma));
}

struct EdgePixel {
  double across, along, value;  ///< distance from the edge's middle, towards light and along the edge
};

/// Residuals of a blurred step: offset, turn (rad), dark, light, slope of the light side, log sigma, log wide sigma,
/// wide weight.
struct BlurredStep {
  const std::vector<EdgePixel>& pixels;
  glm::dvec2 normal;  ///< in pixels' axes
  bool two;

  template <class T>
  bool operator()(const T* p, T* residuals) const {
    using std::exp;
    const T sigma = exp(p[5]), wide = exp(p[6]);
    for (size_t i = 0; i < pixels.size(); ++i) {
      const T across = pixels[i].across - p[0] - p[1] * pixels[i].along;
      T step(0.0);
      for (int k = 0; k < 9; ++k) {
        const T d = across + (kNodes[k % 3] * normal.x + kNodes[k / 3] * normal.y);
        T share = Step(d, sigma);
        if (two) share += p[7] * (Step(d, wide) - share);
        step += kWeights[k % 3] * kWeights[k / 3] * share;
      }
      const T light = p[3] * (1.0 + p[4] * std::max(0.0, pixels[i].across));
      residuals[i] = p[2] + (light - p[2]) * step - pixels[i].value;
    }
    return true;
  }
};

struct StepSolution {
  std::array<double, 8> p;
  double sum_of_squares;
  Eigen::MatrixXd covariance;  ///< scaled by the residuals
};

StepSolution SolveStep(const std::vector<EdgePixel>& pixels, const glm::dvec2& normal, std::array<double, 8> start,
                       bool two) {
  auto* cost = new ceres::AutoDiffCostFunction<BlurredStep, ceres::DYNAMIC, 8>(new BlurredStep{pixels, normal, two},
                                                                               static_cast<int>(pixels.size()));
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, start.data());
  problem.SetParameterLowerBound(start.data(), 5, std::log(0.05));
  problem.SetParameterUpperBound(start.data(), 5, std::log(10.0));
  if (two) {
    problem.SetParameterLowerBound(start.data(), 6, std::log(1.5));
    problem.SetParameterUpperBound(start.data(), 6, std::log(8.0));
    problem.SetParameterLowerBound(start.data(), 7, 0.0);
    problem.SetParameterUpperBound(start.data(), 7, 0.6);
  } else {
    problem.SetManifold(start.data(), new ceres::SubsetManifold(8, {6, 7}));
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  StepSolution solution{start, 2.0 * summary.final_cost, {}};
  const auto free = static_cast<double>(two ? 8 : 6);
  ceres::CRSMatrix sparse;
  problem.Evaluate({}, nullptr, nullptr, nullptr, &sparse);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int row = 0; row < sparse.num_rows; ++row)
    for (int k = sparse.rows[row]; k < sparse.rows[row + 1]; ++k) jacobian(row, sparse.cols[k]) = sparse.values[k];
  const double variance = solution.sum_of_squares / std::max(1.0, static_cast<double>(pixels.size()) - free);
  solution.covariance = variance * (jacobian.transpose() * jacobian).completeOrthogonalDecomposition().pseudoInverse();
  return solution;
}

}  // namespace

std::vector<Edge> FindSlantedSquare(const ImageFile& photo) {
  const cv::Mat grey = StoredGrey8(photo);
  cv::Mat dark;
  cv::threshold(grey, dark, 0, 255, cv::THRESH_BINARY_INV | cv::THRESH_OTSU);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(dark, contours, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  double largest = 40.0 * 40.0;
  std::vector<Edge> edges;
  for (const auto& contour : contours) {
    std::vector<cv::Point> corners;
    cv::approxPolyDP(contour, corners, 0.03 * cv::arcLength(contour, true), true);
    const double area = cv::contourArea(contour);
    if (corners.size() != 4 || !cv::isContourConvex(corners) || area < largest) continue;
    if (area > 0.5 * static_cast<double>(grey.total())) continue;
    cv::Mat inside = cv::Mat::zeros(grey.size(), CV_8UC1);
    cv::fillConvexPoly(inside, corners, 255);
    cv::erode(inside, inside, cv::Mat(), {-1, -1}, 5);
    cv::Scalar mean, spread;
    cv::meanStdDev(dark, mean, spread, inside);
    if (mean[0] < 250) continue;  // a marker has light squares inside
    std::vector<Edge> candidate;
    bool slanted = true;
    for (int i = 0; i < 4; ++i) {
      const glm::dvec2 a(corners[i].x + 0.5, corners[i].y + 0.5),
          b(corners[(i + 1) % 4].x + 0.5, corners[(i + 1) % 4].y + 0.5);
      const double angle =
          std::abs(std::remainder(std::atan2(b.y - a.y, b.x - a.x), std::numbers::pi / 2)) * 180 / std::numbers::pi;
      slanted &= angle > 1.5;
      candidate.push_back({a, b});
    }
    if (!slanted) continue;
    // The dark side must lie to the left of every edge. Clockwise in a picture whose y points down, it lies to the
    // right.
    double turn = 0;
    for (int i = 0; i < 4; ++i) {
      const auto &a = candidate[i].from, &b = candidate[(i + 1) % 4].from;
      turn += a.x * b.y - a.y * b.x;
    }
    if (turn > 0)
      for (Edge& edge : candidate) std::swap(edge.from, edge.to);
    edges = candidate;
    largest = area;
  }
  return edges;
}

std::optional<EdgeFit> FitEdge(const Image& linear, const Edge& edge, int channel, double saturation) {
  const glm::dvec2 along = glm::normalize(edge.to - edge.from), towards_light(-along.y, along.x);
  const glm::dvec2 middle = 0.5 * (edge.from + edge.to);
  const double half = 0.4 * glm::length(edge.to - edge.from);
  if (half < 8) return std::nullopt;
  std::vector<EdgePixel> pixels;
  for (int y = 0; y < linear.height; ++y)
    for (int x = 0; x < linear.width; ++x) {
      const glm::dvec2 d = glm::dvec2(x + 0.5, y + 0.5) - middle;
      const EdgePixel pixel{glm::dot(d, towards_light), glm::dot(d, along), linear.at(x, y, channel)};
      if (std::abs(pixel.across) > kReach_px || std::abs(pixel.along) > half) continue;
      if (pixel.value >= saturation) return std::nullopt;
      pixels.push_back(pixel);
    }
  double dark = 0, light = 0, darks = 0, lights = 0;
  for (const EdgePixel& p : pixels) {
    if (p.across < -0.7 * kReach_px) dark += p.value, ++darks;
    if (p.across > 0.7 * kReach_px) light += p.value, ++lights;
  }
  if (pixels.size() < 200 || darks == 0 || lights == 0) return std::nullopt;
  dark /= darks;
  light /= lights;
  if (light - dark < 0.3 * light) return std::nullopt;
  const StepSolution one =
      SolveStep(pixels, towards_light, {0, 0, dark, light, 0, std::log(0.8), std::log(3.0), 0.0}, false);
  auto start = one.p;
  start[5] = std::log(0.8 * std::exp(one.p[5]));
  start[7] = 0.1;
  const StepSolution two = SolveStep(pixels, towards_light, start, true);
  EdgeFit fit;
  // Adds a second Gaussian where the residuals require it.
  const double n = static_cast<double>(pixels.size());
  const bool use_two = n * std::log(one.sum_of_squares / two.sum_of_squares) > 20.0 && two.p[7] > 0.01 &&
                       two.p[6] > two.p[5] + std::log(1.5);
  const StepSolution& best = use_two ? two : one;
  fit.dark = best.p[2];
  fit.light = best.p[3];
  fit.sigma_px = std::exp(best.p[5]);
  fit.stddev_px = fit.sigma_px * std::sqrt(best.covariance(5, 5));
  fit.wide_sigma_px = use_two ? std::exp(two.p[6]) : 0.0;
  fit.wide_weight = use_two ? two.p[7] : 0.0;
  fit.wide_weight_stddev = use_two ? std::sqrt(two.covariance(7, 7)) : 0.0;
  fit.angle_deg =
      std::abs(std::remainder(std::atan2(along.y, along.x) + best.p[1], std::numbers::pi / 2)) * 180 / std::numbers::pi;
  fit.rms = std::sqrt(best.sum_of_squares / n) / (fit.light - fit.dark);
  fit.pixels = pixels.size();
  return fit;
}

namespace {

/// The picture around the edges, with the fitted values beside it.
Image BlurPicture(const Image& linear, const std::vector<Edge>& edges, const std::vector<std::string>& lines) {
  glm::dvec2 low(1e9), high(0);
  for (const Edge& edge : edges)
    for (const auto& p : {edge.from, edge.to}) low = glm::min(low, p), high = glm::max(high, p);
  low = glm::max(glm::floor(low - 20.0), glm::dvec2(0));
  high = glm::min(glm::ceil(high + 20.0), glm::dvec2(linear.width, linear.height));
  const int zoom = std::clamp(static_cast<int>(500 / std::max(1.0, high.x - low.x)), 1, 8);
  const int width = static_cast<int>(high.x - low.x) * zoom, height = static_cast<int>(high.y - low.y) * zoom;
  Image picture(std::max(width, 420), height + 18 * static_cast<int>(lines.size()) + 8, 3, 1.0f);
  float white = 0;
  for (float v : linear.values) white = std::max(white, v);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y, c) =
            std::sqrt(std::max(0.0f, linear.at(static_cast<int>(low.x) + x / zoom, static_cast<int>(low.y) + y / zoom,
                                               std::min(c, linear.channels - 1)) /
                                         white));
  for (const Edge& edge : edges)
    DrawLine(picture, (glm::mix(edge.from, edge.to, 0.1) - low) * static_cast<double>(zoom),
             (glm::mix(edge.from, edge.to, 0.9) - low) * static_cast<double>(zoom), {1, 0.2, 0.1});
  for (size_t i = 0; i < lines.size(); ++i)
    DrawText(picture, 6, height + 18 * static_cast<int>(i + 1), 13, lines[i], 0.0f);
  return picture;
}

}  // namespace

Product BlurProduct(const Image& linear, const BlurInput& input) {
  constexpr double kLargest_px = 4.0, kDirections = 1.5;
  const int channels = std::min(3, linear.channels);
  std::vector<std::vector<EdgeFit>> fits(channels);
  std::vector<std::string> lines;
  for (size_t e = 0; e < input.edges.size(); ++e)
    for (int c = 0; c < channels; ++c)
      if (const auto fit = FitEdge(linear, input.edges[e], c, input.saturation[c])) {
        fits[c].push_back(*fit);
        if (c == std::min(1, channels - 1))
          lines.push_back("edge " + std::to_string(e + 1) + ": sigma " + Text(fit->sigma_px) + " +- " +
                          Text(fit->stddev_px, "px") + ", slant " + Text(fit->angle_deg, "deg") + ", residual " +
                          Text(100 * fit->rms, "% of the step"));
      }
  if (fits.empty() || fits[0].empty())
    throw InputError("", "",
                     "no edge could be measured: the edges are shorter than 25 px, saturated, or without contrast",
                     "Photograph the printed square at least 100 px wide, with the paper at half of saturation.");
  const auto mean_of = [&](auto value) {
    double sum = 0, squares = 0, n = 0;
    for (const auto& channel : fits)
      for (const EdgeFit& fit : channel) sum += value(fit), squares += value(fit) * value(fit), ++n;
    const double mean = sum / n;
    return std::pair(mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / std::max(1.0, n - 1)));
  };
  const auto [sigma, sigma_scatter] = mean_of([](const EdgeFit& f) { return f.sigma_px; });
  const auto [weight, weight_scatter] = mean_of([](const EdgeFit& f) { return f.wide_weight; });
  const auto [formal, unused] = mean_of([](const EdgeFit& f) { return f.stddev_px; });
  const auto [wide_formal, unused2] = mean_of([](const EdgeFit& f) { return f.wide_weight_stddev; });
  double wide_sum = 0, weights = 0;
  for (const auto& channel : fits)
    for (const EdgeFit& fit : channel) wide_sum += fit.wide_weight * fit.wide_sigma_px, weights += fit.wide_weight;
  size_t measured = 0;
  for (const auto& channel : fits) measured += channel.size();
  const double sigma_stddev = std::max(sigma_scatter, formal / std::sqrt(static_cast<double>(measured)));
  const double weight_stddev = std::max(weight_scatter, wide_formal / std::sqrt(static_cast<double>(measured)));

  Product product;
  product.format = "crownfit-blur/1";
  JsonValue::Array psf{JsonValue::Object{{"sigma_px", sigma}, {"weight", 1.0 - weight}}};
  if (weights > 0) psf.emplace_back(JsonValue::Object{{"sigma_px", wide_sum / weights}, {"weight", weight}});
  product.content.emplace_back("psf", psf);
  product.figures = {{"sigma", sigma, "px"}, {"sigma_stddev", sigma_stddev, "px"}};
  if (weights > 0) {
    product.figures.push_back({"wide_sigma", wide_sum / weights, "px"});
    product.figures.push_back({"wide_weight", weight, ""});
    product.figures.push_back({"wide_weight_stddev", weight_stddev, ""});
  }
  double glare = 0, glare_stddev = 0;
  if (input.dark_reflectance) {
    const double ratio = *input.dark_reflectance / input.light_reflectance.value_or(0.9);
    double sum = 0, squares = 0, n = 0;
    for (int c = 0; c < channels; ++c) {
      double mean = 0;
      for (size_t i = c; i < linear.values.size(); i += linear.channels) mean += linear.values[i];
      mean /= static_cast<double>(linear.width) * linear.height;
      for (const EdgeFit& fit : fits[c]) {
        // dark = (1 - g) k dark_reflectance + g mean, and light likewise.
        const double g = (fit.dark - ratio * fit.light) / (mean * (1.0 - ratio));
        sum += g;
        squares += g * g;
        ++n;
      }
    }
    glare = sum / n;
    glare_stddev = std::sqrt(std::max(0.0, squares / n - glare * glare) / std::max(1.0, n - 1));
    product.figures.push_back({"veiling_glare", glare, ""});
    product.figures.push_back({"veiling_glare_stddev", glare_stddev, ""});
    if (glare < -3 * glare_stddev - 0.003)
      product.refusals.push_back("the dark side is darker than its stated reflectance allows: --dark-reflectance " +
                                 Text(*input.dark_reflectance) + " is too high, or the black level was not removed");
    glare = std::max(glare, 0.0);
  } else {
    product.notes.push_back(
        "veiling glare was not measured, because it needs --dark-reflectance (0 for a hole into a dark box).");
  }
  product.content.emplace_back("veiling_glare", glare);
  product.content.emplace_back(
      "stddev",
      JsonValue::Object{{"sigma_px", sigma_stddev}, {"wide_weight", weight_stddev}, {"veiling_glare", glare_stddev}});
  product.figures.push_back({"edges", static_cast<double>(measured) / channels, ""});

  double least = 1e9, most = 0;
  for (const auto& channel : fits)
    for (const EdgeFit& fit : channel) least = std::min(least, fit.sigma_px), most = std::max(most, fit.sigma_px);
  if (sigma > kLargest_px)
    product.refusals.push_back("sigma " + Text(sigma, "px") + " is over " + Text(kLargest_px, "px") +
                               ". Focus on the square, or open the aperture if it is too small for this pixel pitch.");
  if (most > kDirections * least && most - least > 0.3)
    product.refusals.push_back(
        "sigma is " + Text(least) + " to " + Text(most, "px") +
        " between edges or colours. The camera shook, or part of the square is out of focus: photograph it again.");
  product.picture = BlurPicture(linear, input.edges, lines);
  return product;
}

}  // namespace crownfit
