#include "calibrate/align_scan.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "base/parallel.h"
#include "base/random.h"

namespace crownfit {
namespace {

constexpr double kCorrelation_px = 8.0;

using Vector6 = Eigen::Matrix<double, 6, 1>;

glm::dmat3 RotationOf(const glm::dvec3& w) {
  const double angle = glm::length(w);
  if (angle < 1e-12) return glm::dmat3(1.0);
  const glm::dvec3 a = w / angle;
  const auto turned = [&](const glm::dvec3& v) {
    return v * std::cos(angle) + glm::cross(a, v) * std::sin(angle) + a * glm::dot(a, v) * (1 - std::cos(angle));
  };
  return {turned({1, 0, 0}), turned({0, 1, 0}), turned({0, 0, 1})};
}

/// A turn about `centre` and a shift, in the object's frame.
RigidTransform MotionOf(const Vector6& x, const glm::dvec3& centre) {
  const glm::dmat3 r = RotationOf({x(0), x(1), x(2)});
  return {r, centre + glm::dvec3(x(3), x(4), x(5)) - r * centre};
}

RigidTransform Joined(const RigidTransform& a, const RigidTransform& b) {
  return {a.rotation * b.rotation, a.rotation * b.translation_mm + a.translation_mm};
}

/// A picture smaller by a whole factor, averaged.
Image Reduced(const Image& image, int factor) {
  Image small(image.width / factor, image.height / factor, image.channels);
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x)
      for (int c = 0; c < image.channels; ++c)
        small.at(x / factor, y / factor, c) += image.at(x, y, c) / static_cast<float>(factor * factor);
  return small;
}

Camera ReducedCamera(const Camera& camera, int factor) {
  Camera small = camera;
  small.width = camera.width / factor;
  small.height = camera.height / factor;
  for (double* v : {&small.fx, &small.fy, &small.cx, &small.cy}) *v /= factor;
  return small;
}

/// Which pixels' rays meet the object. Directions are computed once.
class Silhouette {
 public:
  explicit Silhouette(const Camera& camera) : width_(camera.width), height_(camera.height) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) directions_.push_back(DirectionFromPixel(camera, {x + 0.5, y + 0.5}));
  }
  std::vector<uint8_t> Mask(const RayCaster& caster, const RigidTransform& camera_from_object) const {
    const RigidTransform back = camera_from_object.Inverse();
    std::vector<uint8_t> mask(directions_.size());
    for (size_t i = 0; i < directions_.size(); ++i)
      mask[i] = caster.Occluded(back.translation_mm, back.Direction(directions_[i]));
    return mask;
  }
  int width() const { return width_; }

 private:
  int width_, height_;
  std::vector<glm::dvec3> directions_;
};

/// Log odds of object against surroundings by colour: red and blue shares of the light, and its amount.
struct ColourOdds {
  static constexpr int kShares = 24, kLevels = 6;
  std::vector<double> odds = std::vector<double>(kShares * kShares * kLevels, 0.0);
  double contrast = 0;

  static int BinOf(const Image& image, size_t pixel, double white) {
    const double r = std::max(0.0f, image.values[3 * pixel]), g = std::max(0.0f, image.values[3 * pixel + 1]),
                 b = std::max(0.0f, image.values[3 * pixel + 2]);
    const double sum = r + g + b + 1e-9;
    const int i = std::clamp(static_cast<int>(kShares * (r / sum - 0.2) / 0.6), 0, kShares - 1);
    const int j = std::clamp(static_cast<int>(kShares * (b / sum) / 0.5), 0, kShares - 1);
    const int k =
        std::clamp(static_cast<int>(kLevels * (1.0 + std::log2(sum / (3 * white) + 1e-9) / kLevels)), 0, kLevels - 1);
    return (k * kShares + i) * kShares + j;
  }
  ColourOdds(const Image& image, const std::vector<uint8_t>& mask, double white) {
    // Surroundings: what is not further from the object than a tenth of the picture.
    std::vector<double> inside(odds.size(), 0.0), outside(odds.size(), 0.0);
    const std::vector<uint8_t> near = Dilated(mask, image.width, image.height, image.width / 10);
    for (size_t p = 0; p < mask.size(); ++p)
      if (near[p]) (mask[p] ? inside : outside)[BinOf(image, p, white)] += 1;
    Smooth(inside);
    Smooth(outside);
    const double in = std::accumulate(inside.begin(), inside.end(), 1e-9),
                 out = std::accumulate(outside.begin(), outside.end(), 1e-9);
    for (size_t b = 0; b < odds.size(); ++b) {
      const double a = inside[b] / in, o = outside[b] / out;
      odds[b] = std::log((a + 1e-4) / (o + 1e-4));
      contrast += 0.5 * std::abs(a - o);
    }
  }
  static std::vector<uint8_t> Dilated(const std::vector<uint8_t>& mask, int width, int height, int radius) {
    Image soft(width, height, 1);
    for (size_t p = 0; p < mask.size(); ++p) soft.values[p] = mask[p];
    soft = BoxMean(soft, radius);
    std::vector<uint8_t> grown(mask.size());
    for (size_t p = 0; p < mask.size(); ++p) grown[p] = soft.values[p] > 0;
    return grown;
  }
  static void Smooth(std::vector<double>& histogram) {
    for (int pass = 0; pass < 2; ++pass) {
      std::vector<double> from = histogram;
      for (int k = 0; k < kLevels; ++k)
        for (int i = 0; i < kShares; ++i)
          for (int j = 0; j < kShares; ++j) {
            const auto at = [&](int a, int b) {
              return from[(k * kShares + std::clamp(a, 0, kShares - 1)) * kShares + std::clamp(b, 0, kShares - 1)];
            };
            histogram[(k * kShares + i) * kShares + j] =
                0.5 * at(i, j) + 0.125 * (at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1));
          }
    }
  }
};

/// One photograph, made ready at some reduction.
struct Level {
  Image image;
  Camera camera;
  double white;
  Level(const ScanPhotograph& photo, int factor)
      : image(factor > 1 ? Reduced(*photo.linear, factor) : *photo.linear),
        camera(ReducedCamera(photo.camera, factor)) {
    std::vector<float> values = image.values;
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 98 / 100);
    std::nth_element(values.begin(), at, values.end());
    white = std::max(1e-9f, *at);
  }
};

/// Log odds of every pixel, limited so that no single colour decides.
Image OddsImage(const Level& level, const ColourOdds& colours) {
  Image odds(level.image.width, level.image.height, 1);
  for (size_t p = 0; p < odds.values.size(); ++p)
    odds.values[p] =
        static_cast<float>(std::clamp(colours.odds[ColourOdds::BinOf(level.image, p, level.white)], -3.0, 3.0));
  return odds;
}

double Bilinear(const Image& image, const glm::dvec2& pixel, int c) {
  const double px = pixel.x - 0.5, py = pixel.y - 0.5;
  const int x = std::clamp(static_cast<int>(std::floor(px)), 0, image.width - 2),
            y = std::clamp(static_cast<int>(std::floor(py)), 0, image.height - 2);
  const double u = std::clamp(px - x, 0.0, 1.0), v = std::clamp(py - y, 0.0, 1.0);
  return (1 - v) * ((1 - u) * image.at(x, y, c) + u * image.at(x + 1, y, c)) +
         v * ((1 - u) * image.at(x, y + 1, c) + u * image.at(x + 1, y + 1, c));
}

}  // namespace

std::vector<int> ConnectedParts(const TriangleMesh& mesh) {
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    root[find(t.y)] = find(t.x);
    root[find(t.z)] = find(t.x);
  }
  std::vector<int> parts;
  for (const auto& t : mesh.triangles) parts.push_back(find(t.x));
  return parts;
}

std::vector<ContourPoint> Contours(const RayCaster& caster, const std::vector<int>& parts, const Camera& camera,
                                   const RigidTransform& camera_from_object, int step_px) {
  const RigidTransform back = camera_from_object.Inverse();
  struct Seen {
    int part = -1;
    double distance = 0;
    glm::dvec3 at{0.0};
  };
  const auto look = [&](const glm::dvec2& pixel) {
    const glm::dvec3 d = back.Direction(DirectionFromPixel(camera, pixel));
    const auto hit = caster.Nearest(back.translation_mm, d);
    return hit ? Seen{parts[hit->point.triangle], hit->distance_mm, back.translation_mm + hit->distance_mm * d}
               : Seen{};
  };
  const auto differ = [](const Seen& a, const Seen& b) {
    return a.part != b.part || (a.part >= 0 && std::abs(a.distance - b.distance) > 0.8);
  };
  const int columns = camera.width / step_px, rows = camera.height / step_px;
  std::vector<Seen> grid(static_cast<size_t>(columns) * rows);
  const auto centre = [&](int x, int y) { return glm::dvec2((x + 0.5) * step_px, (y + 0.5) * step_px); };
  ParallelFor(rows, 0, [&](size_t y) {
    for (int x = 0; x < columns; ++x) grid[y * columns + x] = look(centre(x, static_cast<int>(y)));
  });
  std::vector<std::vector<ContourPoint>> of_row(rows);
  ParallelFor(rows, 0, [&](size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < columns; ++x)
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
        if (x + dx >= columns || y + dy >= rows) continue;
        Seen a = grid[y * columns + x], b = grid[(y + dy) * columns + x + dx];
        if (!differ(a, b)) continue;
        glm::dvec2 pa = centre(x, y), pb = centre(x + dx, y + dy);
        for (int k = 0; k < 4; ++k) {
          const glm::dvec2 middle = 0.5 * (pa + pb);
          const Seen m = look(middle);
          if (differ(a, m)) {
            pb = middle, b = m;
          } else {
            pa = middle, a = m;
          }
        }
        const bool a_is_nearer = b.part < 0 || (a.part >= 0 && a.distance < b.distance);
        ContourPoint point{a_is_nearer ? a.at : b.at, 0.5 * (pa + pb), glm::dvec2(dx, dy) * (a_is_nearer ? 1.0 : -1.0),
                           a.part < 0 || b.part < 0};
        of_row[row].push_back(point);
      }
  });
  std::vector<ContourPoint> contours;
  for (const auto& points : of_row) contours.insert(contours.end(), points.begin(), points.end());
  // Normals: across the line through the neighbours, on the side that the grid's step pointed to.
  std::vector<glm::dvec2> normals(contours.size());
  ParallelFor(contours.size(), 0, [&](size_t i) {
    glm::dvec2 mean(0.0);
    double n = 0;
    double xx = 0, xy = 0, yy = 0;
    const double reach = 3.5 * step_px;
    for (int pass = 0; pass < 2; ++pass)
      for (size_t j = i > 400 ? i - 400 : 0; j < std::min(contours.size(), i + 400); ++j) {
        const glm::dvec2 d = contours[j].pixel - contours[i].pixel;
        if (glm::dot(d, d) > reach * reach || contours[j].is_outer != contours[i].is_outer) continue;
        if (pass == 0) {
          mean += d;
          ++n;
        } else {
          const glm::dvec2 e = d - mean / n;
          xx += e.x * e.x, xy += e.x * e.y, yy += e.y * e.y;
        }
      }
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
    glm::dvec2 normal(-std::sin(angle), std::cos(angle));
    if (n < 3) normal = contours[i].outward;
    normals[i] = glm::dot(normal, contours[i].outward) < 0 ? -normal : normal;
  });
  for (size_t i = 0; i < contours.size(); ++i) contours[i].outward = normals[i];
  return contours;
}

namespace {

/// The search by regions, all photographs at once.
struct RegionSearch {
  const RayCaster& caster;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  std::vector<Level> levels;
  std::vector<Silhouette> silhouettes;
  std::vector<Image> odds;
  std::vector<double> contrast;

  RegionSearch(const RayCaster& c, const std::vector<ScanPhotograph>& p, const glm::dvec3& middle)
      : caster(c), photographs(p), centre(middle) {
    for (const auto& photo : photographs) {
      levels.emplace_back(photo, std::max(1, photo.linear->width / 180));
      silhouettes.emplace_back(levels.back().camera);
    }
    contrast.assign(photographs.size(), 0.0);
  }
  void Learn(const Vector6& x) {
    odds.clear();
    for (size_t k = 0; k < photographs.size(); ++k) {
      const ColourOdds colours(levels[k].image,
                               silhouettes[k].Mask(caster, Joined(photographs[k].start, MotionOf(x, centre))),
                               levels[k].white);
      contrast[k] = colours.contrast;
      odds.push_back(OddsImage(levels[k], colours));
    }
  }
  /// Sum of log odds under the object, less what lies outside it in its surroundings; more is better.
  double Score(const Vector6& x) const {
    double score = 0;
    for (size_t k = 0; k < photographs.size(); ++k) {
      const auto mask = silhouettes[k].Mask(caster, Joined(photographs[k].start, MotionOf(x, centre)));
      for (size_t p = 0; p < mask.size(); ++p) score += mask[p] ? odds[k].values[p] : 0.0;
    }
    return score;
  }
};

struct Match {
  size_t photograph;
  glm::dvec3 on_object_mm;
  glm::dvec2 edge, normal;
};

/// The edge that a contour point belongs to: the steepest change along its normal within reach, nearer ones preferred.
std::optional<glm::dvec2> EdgeNear(const Level& level, const Image& odds, const ContourPoint& point, double reach_px) {
  double best = 0, at = 0;
  const double scale = std::max(1.0, reach_px / 12.0), limit = 0.06;
  for (double d = -reach_px; d <= reach_px; d += 0.5) {
    const glm::dvec2 inner = point.pixel + (d - scale) * point.outward,
                     outer = point.pixel + (d + scale) * point.outward;
    if (inner.x < 1 || inner.y < 1 || outer.x < 1 || outer.y < 1 || inner.x > level.image.width - 1 ||
        inner.y > level.image.height - 1 || outer.x > level.image.width - 1 || outer.y > level.image.height - 1)
      continue;
    double change;
    if (point.is_outer) {
      change = (Bilinear(odds, inner, 0) - Bilinear(odds, outer, 0)) / 6.0;  // from object to surroundings
    } else {
      change = std::abs(Bilinear(level.image, inner, 1) - Bilinear(level.image, outer, 1)) / level.white;
    }
    change *= std::exp(-0.5 * d * d / (0.25 * reach_px * reach_px));
    if (change > best) best = change, at = d;
  }
  if (best < limit || std::abs(at) > reach_px - 0.75) return std::nullopt;
  return point.pixel + at * point.outward;
}

/// The fit to edges, all photographs at once.
struct ContourFit {
  const RayCaster& caster;
  const std::vector<int>& parts;
  const std::vector<ScanPhotograph>& photographs;
  glm::dvec3 centre;
  int threads;
  std::vector<Level> levels;
  std::vector<Image> odds;

  /// What is left after a fit.
  struct State {
    Vector6 motion;
    double sigma = 1;
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity();
    std::vector<double> rms_px, matched;
    double support =
        0;  ///< share of contour points that lie on an edge, each less by the square of its distance over 6 px
  };

  RigidTransform PoseOf(size_t k, const Vector6& x) const { return Joined(photographs[k].start, MotionOf(x, centre)); }

  /// Contours are found again after every step, and edges are looked for in an ever smaller reach.
  State Fit(const Vector6& start, const std::vector<double>& reaches, int step_px,
            const std::function<void(double)>& tell) const {
    State state;
    state.motion = start;
    const double scale = std::max(1.0, photographs[0].linear->width / 1440.0);
    for (size_t step = 0; step < reaches.size(); ++step) {
      const double reach = reaches[step] * scale;
      std::vector<Match> matches;
      std::vector<double> points(photographs.size(), 0.0);
      for (size_t k = 0; k < photographs.size(); ++k) {
        const auto contours = Contours(caster, parts, photographs[k].camera, PoseOf(k, state.motion), step_px);
        std::vector<std::optional<glm::dvec2>> edges(contours.size());
        ParallelFor(contours.size(), threads,
                    [&](size_t i) { edges[i] = EdgeNear(levels[k], odds[k], contours[i], reach); });
        for (size_t i = 0; i < contours.size(); ++i)
          if (edges[i]) matches.push_back({k, contours[i].on_object_mm, *edges[i], contours[i].outward});
        points[k] = static_cast<double>(contours.size());
      }
      if (matches.size() < 30) return state;
      for (int inner = 0; inner < 4; ++inner) Step(matches, state);
      Measure(matches, points, 6.0 * scale, state);
      if (tell) tell(static_cast<double>(step + 1) / static_cast<double>(reaches.size()));
    }
    return state;
  }

  double Residual(const Match& m, const RigidTransform& motion) const {
    const auto pixel = PixelFromPoint(photographs[m.photograph].camera,
                                      Joined(photographs[m.photograph].start, motion).Point(m.on_object_mm));
    return pixel ? glm::dot(*pixel - m.edge, m.normal) : 0.0;
  }

  /// One Gauss-Newton step with Tukey's biweight on distances along the normals.
  void Step(const std::vector<Match>& matches, State& state) const {
    Eigen::MatrixXd jacobian(matches.size(), 6);
    Eigen::VectorXd residual(matches.size());
    std::array<RigidTransform, 6> moved;
    const auto step_of = [](int k) { return k < 3 ? 1e-5 : 1e-4; };
    for (int k = 0; k < 6; ++k) {
      Vector6 y = state.motion;
      y(k) += step_of(k);
      moved[k] = MotionOf(y, centre);
    }
    const RigidTransform motion = MotionOf(state.motion, centre);
    std::vector<double> sizes;
    for (size_t i = 0; i < matches.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      residual(row) = Residual(matches[i], motion);
      sizes.push_back(std::abs(residual(row)));
      for (int k = 0; k < 6; ++k) jacobian(row, k) = (Residual(matches[i], moved[k]) - residual(row)) / step_of(k);
    }
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    state.sigma = std::max(0.3, 1.4826 * sizes[sizes.size() / 2]);
    Eigen::VectorXd weights(residual.size());
    for (Eigen::Index i = 0; i < residual.size(); ++i) {
      const double u = residual(i) / (3.5 * state.sigma);
      weights(i) = std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0.0;
    }
    state.normal = jacobian.transpose() * weights.asDiagonal() * jacobian;
    const Eigen::Matrix<double, 6, 6> damped =
        state.normal + Eigen::Matrix<double, 6, 6>(1e-6 * state.normal.diagonal().asDiagonal());
    state.motion -= damped.ldlt().solve(jacobian.transpose() * (weights.asDiagonal() * residual));
  }

  void Measure(const std::vector<Match>& matches, const std::vector<double>& points, double reach_px,
               State& state) const {
    const size_t count = photographs.size();
    std::vector<double> squares(count, 0.0), numbers(count, 0.0);
    double support = 0, all = 0;
    const RigidTransform motion = MotionOf(state.motion, centre);
    for (const Match& m : matches) {
      const double off = std::abs(Residual(m, motion));
      squares[m.photograph] += std::pow(std::min(3.5 * state.sigma, off), 2.0);
      ++numbers[m.photograph];
      support += std::max(0.0, 1.0 - off * off / (reach_px * reach_px));
    }
    state.rms_px.assign(count, 0.0);
    state.matched.assign(count, 0.0);
    for (size_t k = 0; k < count; ++k) {
      state.rms_px[k] = std::sqrt(squares[k] / std::max(1.0, numbers[k]));
      state.matched[k] = numbers[k] / std::max(1.0, points[k]);
      all += points[k];
    }
    state.support = support / std::max(1.0, all);
  }
};

}  // namespace

AlignedScan AlignScan(const TriangleMesh& mesh, const std::vector<ScanPhotograph>& photographs,
                      const AlignOptions& options, const std::function<void(double)>& progress) {
  const RayCaster caster({&mesh});
  const std::vector<int> parts = ConnectedParts(mesh);
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  const auto tell = [&](double share) {
    if (progress) progress(share);
  };

  // Region: many starts, the best few followed by a pattern search; colours are learned again from the best.
  RegionSearch search(caster, photographs, centre);
  Vector6 best = Vector6::Zero();
  const double turn = options.search_deg * std::numbers::pi / 180;
  for (int round = 0; round < 2; ++round) {
    search.Learn(best);
    std::vector<std::pair<double, Vector6>> tried(options.starts);
    const double spread = round == 0 ? 1.0 : 0.4;
    ParallelFor(tried.size(), options.threads, [&](size_t i) {
      Vector6 x = best;
      for (int k = 0; k < 6; ++k)
        x(k) += i == 0 ? 0.0 : spread * (k < 3 ? turn : options.search_mm) * Gaussian(Key(options.seed, round, i), k);
      tried[i] = {search.Score(x), x};
    });
    tell(0.1 + 0.3 * round);
    std::sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    tried.resize(std::min<size_t>(6, tried.size()));
    ParallelFor(tried.size(), options.threads, [&](size_t i) {
      auto& [score, x] = tried[i];
      for (double step = 0.5 * spread; step > 0.02; step *= 0.6)
        for (bool better = true; better;) {
          better = false;
          for (int k = 0; k < 6; ++k)
            for (const double sign : {1.0, -1.0}) {
              Vector6 y = x;
              y(k) += sign * step * (k < 3 ? turn : options.search_mm);
              const double value = search.Score(y);
              if (value > score) score = value, x = y, better = true;
            }
        }
    });
    best = std::max_element(tried.begin(), tried.end(), [](const auto& a, const auto& b) {
             return a.first < b.first;
           })->second;
    tell(0.3 + 0.3 * round);
  }

  // Edges, from the best place by colour and from others that are nearly as good: colours alone mistake what the scan
  // does not have (a further molar) for the object. The place whose contours lie on edges wins.
  search.Learn(best);
  ContourFit edges{caster, parts, photographs, centre, options.threads, {}, {}};
  for (size_t k = 0; k < photographs.size(); ++k) {
    edges.levels.emplace_back(photographs[k], 1);
    const ColourOdds colours(search.levels[k].image, search.silhouettes[k].Mask(caster, edges.PoseOf(k, best)),
                             search.levels[k].white);
    edges.odds.push_back(BoxMean(OddsImage(edges.levels[k], colours), 1));
  }
  Vector6 place = best;
  double support = -1;
  constexpr double kSpreads[] = {0.0, 0.3, 0.2, 0.12, 0.06};
  constexpr int kPlaces = 12;
  for (size_t round = 0; round < std::size(kSpreads); ++round) {
    const Vector6 around = place;
    for (int i = 0; i < (round ? kPlaces : 1); ++i) {
      Vector6 x = around;
      for (int k = 0; k < 6; ++k)
        x(k) += kSpreads[round] * (k < 3 ? turn : options.search_mm) * Gaussian(Key(options.seed, 7, round, i), k);
      const auto state = edges.Fit(x, {30, 24, 18, 14, 10, 8, 6}, 8, {});
      if (state.support > support) support = state.support, place = state.motion;
      tell(0.6 + 0.25 * (static_cast<double>(round) + (i + 1.0) / kPlaces) / std::size(kSpreads));
    }
  }
  const auto state = edges.Fit(place, {12, 10, 8, 8, 6, 6, 6}, 3, [&](double share) { tell(0.85 + 0.15 * share); });
  best = state.motion;
  AlignedScan result;
  result.contrast = search.contrast;
  result.rms_px = state.rms_px;
  result.matched = state.matched;
  const double sigma = state.sigma;
  const Eigen::Matrix<double, 6, 6>& normal = state.normal;
  // Neighbouring points share their edge's error: contours stand three pixels apart, an error reaches over several.
  const Eigen::Matrix<double, 6, 6> covariance =
      kCorrelation_px / 3.0 * sigma * sigma * normal.completeOrthogonalDecomposition().pseudoInverse();
  for (const auto& photo : photographs) {
    const RigidTransform pose = Joined(photo.start, MotionOf(best, centre));
    result.camera_from_object.push_back(pose);
    // From a turn about the object's centre and a shift in its frame to a turn about the camera and a shift in its
    // frame.
    Eigen::Matrix<double, 6, 6> change = Eigen::Matrix<double, 6, 6>::Zero();
    const glm::dvec3 c = pose.Point(centre);
    const glm::dmat3& r = photo.start.rotation;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        change(i, j) = r[j][i];
        change(3 + i, 3 + j) = r[j][i];
      }
    // Turning about c instead of the origin shifts by -w x c.
    for (int j = 0; j < 3; ++j) {
      const glm::dvec3 w(r[j][0], r[j][1], r[j][2]);
      const glm::dvec3 shift = -glm::cross(w, c);
      for (int i = 0; i < 3; ++i) change(3 + i, j) += shift[i];
    }
    const Eigen::Matrix<double, 6, 6> of_pose = change * covariance * change.transpose();
    std::array<double, 36> rows;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) rows[6 * i + j] = of_pose(i, j);
    result.covariance.push_back(rows);
  }
  return result;
}

}  // namespace crownfit
