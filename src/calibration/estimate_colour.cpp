#include "calibration/estimate_colour.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/linear_algebra.h"
#include "calibration/product.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

double Luminance(const glm::dvec3& rgb) { return 0.2126729 * rgb.x + 0.7151522 * rgb.y + 0.0721750 * rgb.z; }

/// Residuals in units close to CIEDE2000: Lab differences over the weights S_L and S_C at the reference.
struct LabResiduals {
  const std::vector<std::array<double, 6>>& terms;
  const std::vector<glm::dvec3>& lab;
  int columns;
  bool operator()(const double* const* parameters, double* residuals) const {
    for (size_t i = 0; i < lab.size(); ++i) {
      glm::dvec3 rgb(0.0);
      for (int c = 0; c < columns; ++c)
        for (int r = 0; r < 3; ++r) rgb[r] += parameters[0][3 * c + r] * terms[i][c];
      const glm::dvec3 d = LabFromLinearRgb(rgb) - lab[i];
      const double l50 = (lab[i].x - 50) * (lab[i].x - 50), chroma = std::hypot(lab[i].y, lab[i].z);
      residuals[3 * i] = d.x / (1 + 0.015 * l50 / std::sqrt(20 + l50));
      residuals[3 * i + 1] = d.y / (1 + 0.045 * chroma);
      residuals[3 * i + 2] = d.z / (1 + 0.045 * chroma);
    }
    return true;
  }
};

/// Columns of a transform for some patches: 3 for a matrix, 6 for a root polynomial.
std::vector<glm::dvec3> FitColumns(const Chart& chart, const std::vector<PatchReading>& readings,
                                   const std::vector<size_t>& patches, int columns) {
  const auto n = static_cast<Eigen::Index>(patches.size());
  Eigen::MatrixXd left(n, columns), right(n, 3);
  std::vector<std::array<double, 6>> terms;
  std::vector<glm::dvec3> lab;
  for (Eigen::Index i = 0; i < n; ++i) {
    const glm::dvec3 wanted = chart.patches[patches[i]].linear_rgb;
    terms.push_back(RootTerms(readings[patches[i]].mean));
    lab.push_back(LabFromLinearRgb(wanted));
    const double weight = 1.0 / std::pow(std::max(0.01, Luminance(wanted)), 2.0 / 3.0);  // the slope of lightness
    for (int c = 0; c < columns; ++c) left(i, c) = weight * terms.back()[c];
    for (int r = 0; r < 3; ++r) right(i, r) = weight * wanted[r];
  }
  const Eigen::MatrixXd start = ShortestNearest(left, right);
  std::vector<double> x(3 * columns);
  for (int c = 0; c < columns; ++c)
    for (int r = 0; r < 3; ++r) x[3 * c + r] = start(c, r);
  auto* cost = new ceres::DynamicNumericDiffCostFunction<LabResiduals>(new LabResiduals{terms, lab, columns});
  cost->AddParameterBlock(3 * columns);
  cost->SetNumResiduals(static_cast<int>(3 * n));
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, x.data());
  ceres::Solver::Options options;
  options.max_num_iterations = 50;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  std::vector<glm::dvec3> result;
  for (int c = 0; c < columns; ++c) result.emplace_back(x[3 * c], x[3 * c + 1], x[3 * c + 2]);
  return result;
}

ColourTransform TransformOf(const std::vector<glm::dvec3>& columns) {
  ColourTransform transform;
  transform.columns.assign(columns.begin(), columns.begin() + 3);
  if (columns.size() == 6) {
    transform.root_polynomial.emplace();
    std::copy(columns.begin(), columns.end(), transform.root_polynomial->begin());
  }
  return transform;
}

double Difference(const ColourTransform& transform, const ChartPatch& patch, const PatchReading& reading) {
  return Ciede2000(LabFromLinearRgb(patch.linear_rgb), LabFromLinearRgb(transform(reading.mean)));
}

double LeaveOneOut(const Chart& chart, const std::vector<PatchReading>& readings, const std::vector<size_t>& patches,
                   int columns) {
  double sum = 0;
  for (size_t left : patches) {
    std::vector<size_t> others;
    for (size_t p : patches)
      if (p != left) others.push_back(p);
    sum += Difference(TransformOf(FitColumns(chart, readings, others, columns)), chart.patches[left], readings[left]);
  }
  return sum / static_cast<double>(patches.size());
}

std::vector<size_t> Undamaged(const std::vector<PatchReading>& readings) {
  std::vector<size_t> patches;
  for (size_t i = 0; i < readings.size(); ++i)
    if (readings[i].damage.empty()) patches.push_back(i);
  return patches;
}

/// Grey patches: those whose reference has almost no chroma.
std::vector<size_t> Greys(const Chart& chart, const std::vector<size_t>& patches) {
  std::vector<size_t> greys;
  for (size_t p : patches) {
    const glm::dvec3 lab = LabFromLinearRgb(chart.patches[p].linear_rgb);
    if (std::hypot(lab.y, lab.z) < 4) greys.push_back(p);
  }
  return greys;
}

/// Slope of a straight line through the points.
double Slope(const std::vector<glm::dvec2>& points) {
  glm::dvec2 mean(0.0);
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double xx = 0, xy = 0;
  for (const auto& p : points) xx += (p.x - mean.x) * (p.x - mean.x), xy += (p.x - mean.x) * (p.y - mean.y);
  return xx > 0 ? xy / xx : 1.0;
}

/// Fall-off of light across the chart, from a plane through the log ratios of the readings to their expected values.
void AddFallOff(const Chart& chart, const std::vector<PatchReading>& readings, ColourEstimate& estimate) {
  std::vector<size_t> light;  // stray light dominates dark patches
  for (size_t p : estimate.used)
    if (Luminance(chart.patches[p].linear_rgb) > 0.12) light.push_back(p);
  const auto n = static_cast<Eigen::Index>(light.size());
  if (n < 8) return;
  Eigen::MatrixXd left(n, 3);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const size_t p = light[i];
    const int column = static_cast<int>(p) % chart.columns, row = static_cast<int>(p) / chart.columns;
    left.row(i) << 1.0, column / (chart.columns - 1.0), row / std::max(1.0, chart.rows() - 1.0);
    right(i) = std::log(std::max(1e-6, Luminance(estimate.transform(readings[p].mean))) /
                        std::max(1e-6, Luminance(chart.patches[p].linear_rgb)));
  }
  const Eigen::VectorXd plane = ShortestNearest(left, right);
  estimate.fall_off = std::hypot(plane(1), plane(2));
  const double variance = (right - left * plane).squaredNorm() / static_cast<double>(n - 3);
  const Eigen::Matrix3d covariance = variance * InverseOfSymmetric(left.transpose() * left);
  estimate.fall_off_stddev = std::sqrt(std::max(covariance(1, 1), covariance(2, 2)));
}

/// Correlation of the log luminances of readings and references.
double Agreement(const Chart& chart, const std::vector<PatchReading>& readings, const std::vector<size_t>& order) {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    const PatchReading& r = readings[order[i]];
    if (!r.damage.empty()) continue;
    const double a = std::log(std::max(1e-4, Luminance(chart.patches[i].linear_rgb))),
                 b = std::log(std::max(1e-6, r.mean.y));
    ++n, x += a, y += b, xx += a * a, yy += b * b, xy += a * b;
  }
  return n > 3 ? (xy - x * y / n) / std::sqrt(std::max(1e-12, (xx - x * x / n) * (yy - y * y / n))) : 0.0;
}

struct Order {
  double agreement = -1;
  std::vector<size_t> of_patch;  ///< which reading belongs to it
  bool is_mirrored = false;
};

Order BestOrder(const Chart& chart, const std::vector<PatchReading>& readings) {
  const int columns = chart.columns, rows = chart.rows();
  Order best;
  for (int variant = 0; variant < 4; ++variant) {
    std::vector<size_t> order;
    for (int i = 0; i < columns * rows; ++i) {
      const int column = variant & 1 ? columns - 1 - i % columns : i % columns;
      const int row = variant & 2 ? rows - 1 - i / columns : i / columns;
      order.push_back(row * columns + column);
    }
    const double agreement = Agreement(chart, readings, order);
    if (agreement > best.agreement) best = {agreement, order, variant == 1 || variant == 2};
  }
  return best;
}

/// Whether a patch's corners run anticlockwise, as in a mirror.
bool SeenFromBehind(const PatchReading& r) {
  const glm::dvec2 a = r.corners[1] - r.corners[0], b = r.corners[2] - r.corners[1];
  return a.x * b.y - a.y * b.x < 0;
}

}  // namespace

double AgreementOf(const Chart& chart, const std::vector<PatchReading>& readings) {
  return BestOrder(chart, readings).agreement;
}

std::vector<PatchReading> InOrder(const Chart& chart, const std::vector<PatchReading>& readings, std::string& fault) {
  const Order best = BestOrder(chart, readings);
  if (best.agreement < 0.8)
    fault = "the patches are not those of a " + chart.name + " in any order (agreement " + Text(best.agreement) +
            "). Check that no part of it is hidden, and that --chart names this chart.";
  else if (best.is_mirrored != SeenFromBehind(readings[0]))
    fault = "the chart is mirrored: flip the photograph back";
  if (!fault.empty()) return {};
  std::vector<PatchReading> ordered;
  for (size_t i : best.of_patch) ordered.push_back(readings[i]);
  return ordered;
}

std::optional<ColourEstimate> EstimateColour(const Chart& chart, std::vector<PatchReading>& readings) {
  ColourEstimate estimate;
  estimate.used = Undamaged(readings);
  for (int round = 0; round <= 4; ++round) {
    if (estimate.used.size() < 12) return std::nullopt;
    estimate.transform = TransformOf(FitColumns(chart, readings, estimate.used, 3));
    std::vector<double> differences;
    for (size_t p : estimate.used) differences.push_back(Difference(estimate.transform, chart.patches[p], readings[p]));
    const size_t worst = std::max_element(differences.begin(), differences.end()) - differences.begin();
    std::vector<double> sorted = differences;
    std::sort(sorted.begin(), sorted.end());
    if (round == 4 || differences[worst] < std::max(8.0, 4.0 * sorted[sorted.size() / 2])) break;
    readings[estimate.used[worst]].damage = "does not fit the others (dE00 " + Text(differences[worst]) + ")";
    estimate.used = Undamaged(readings);
  }
  estimate.leave_one_out_matrix = estimate.leave_one_out = LeaveOneOut(chart, readings, estimate.used, 3);
  if (estimate.used.size() >= 18) {
    const double polynomial = LeaveOneOut(chart, readings, estimate.used, 6);
    if (polynomial < 0.9 * estimate.leave_one_out) {
      const std::vector<glm::dvec3> matrix = estimate.transform.columns;
      estimate.transform = TransformOf(FitColumns(chart, readings, estimate.used, 6));
      estimate.transform.columns = matrix;
      estimate.leave_one_out = polynomial;
    }
  }
  for (size_t p = 0; p < readings.size(); ++p)
    estimate.de00.push_back(Difference(estimate.transform, chart.patches[p], readings[p]));
  for (size_t p : estimate.used) {
    estimate.mean += estimate.de00[p] / static_cast<double>(estimate.used.size());
    estimate.worst = std::max(estimate.worst, estimate.de00[p]);
  }
  estimate.white = VectorOf(BandColour{estimate.transform}.Reflectance(glm::dvec3(1.0)));
  std::vector<glm::dvec2> tones;
  for (size_t p : Greys(chart, estimate.used))
    tones.emplace_back(std::log(Luminance(chart.patches[p].linear_rgb)), std::log(std::max(1e-6, readings[p].mean.y)));
  if (tones.size() >= 3) estimate.tone_slope = Slope(tones);
  AddFallOff(chart, readings, estimate);
  return estimate;
}

}  // namespace crownfit
