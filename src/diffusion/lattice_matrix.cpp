#include "diffusion/lattice_matrix.h"

#include <cmath>
#include <numeric>

#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr int kFewNodes = 400;  // of the coarsest lattice, solved at once

double Dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The coarse nodes of which a fine one is a mean, and their weights.
struct Parents {
  std::array<int, 8> node;
  std::array<double, 8> weight;
  int count = 0;
};

Parents ParentsOf(const LatticeNodes& coarse, const glm::ivec3& fine) {
  Parents p;
  const glm::ivec3 low = fine / 2, odd = fine - 2 * low;
  for (int k = 0; k < 8; ++k) {
    const glm::ivec3 up(k & 1, k >> 1 & 1, k >> 2);
    if (glm::any(glm::greaterThan(up, odd))) continue;
    p.node[p.count] = coarse.At(low + up);
    p.weight[p.count++] = 1.0 / static_cast<double>(1 << (odd.x + odd.y + odd.z));
  }
  return p;
}

/// Every second node of each row, where a fine one in use needs it.
LatticeNodes Coarser(const LatticeNodes& fine) {
  const glm::ivec3 size = fine.size / 2 + 1;
  std::vector<uint8_t> is_used(static_cast<size_t>(size.x) * size.y * size.z, 0);
  for (const glm::ivec3& p : fine.place)
    for (int k = 0; k < 8; ++k) {
      const glm::ivec3 low = p / 2, odd = p - 2 * low, up(k & 1, k >> 1 & 1, k >> 2);
      if (glm::any(glm::greaterThan(up, odd))) continue;
      const glm::ivec3 c = low + up;
      is_used[(static_cast<size_t>(c.z) * size.y + c.y) * size.x + c.x] = 1;
    }
  return LatticeNodes(size, std::move(is_used));
}

}  // namespace

LatticeNodes::LatticeNodes(const glm::ivec3& lattice, std::vector<uint8_t> is_used) : size(lattice) {
  number.assign(is_used.size(), -1);
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        if (const size_t i = IndexOf({x, y, z}); is_used[i]) number[i] = count(), place.emplace_back(x, y, z);
  beside.reserve(place.size() * kBeside);
  for (const glm::ivec3& p : place)
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const int other = At(p + glm::ivec3(x, y, z));
          beside.push_back(other < 0 ? At(p) : other);
        }
}

void Multiply(const LatticeNodes& nodes, const LatticeMatrix& m, std::span<const double> x, std::span<double> y) {
  const int n = nodes.count();
  for (int i = 0; i < n; ++i) {
    const int* beside = &nodes.beside[static_cast<size_t>(i) * LatticeNodes::kBeside];
    const double* row = &m[static_cast<size_t>(i) * LatticeNodes::kBeside];
    double sum = 0;
    for (int k = 0; k < LatticeNodes::kBeside; ++k) sum += row[k] * x[beside[k]];
    y[i] = sum;
  }
}

struct LatticeSolver::Level {
  const LatticeNodes* nodes;
  std::unique_ptr<LatticeNodes> owned;  ///< of all but the finest
  LatticeMatrix matrix;
  std::vector<Parents> parents;  ///< per node, in the next level; empty in the last
  Eigen::MatrixXd inverse;       ///< of the last
  void Sweep(const std::vector<double>& b, std::vector<double>& x, bool forward) const {
    const int n = nodes->count();
    for (int step = 0; step < n; ++step) {
      const int i = forward ? step : n - 1 - step;
      const int* beside = &nodes->beside[static_cast<size_t>(i) * LatticeNodes::kBeside];
      const double* row = &matrix[static_cast<size_t>(i) * LatticeNodes::kBeside];
      double rest = b[i];
      for (int k = 0; k < LatticeNodes::kBeside; ++k) rest -= row[k] * x[beside[k]];
      x[i] += rest / row[LatticeNodes::kSelf];
    }
  }
};

LatticeSolver::LatticeSolver(const LatticeNodes& nodes, LatticeMatrix matrix) {
  levels_.push_back({&nodes, nullptr, std::move(matrix), {}, {}});
  for (;;) {
    Level& fine = levels_.back();
    const int n = fine.nodes->count();
    auto coarse = std::make_unique<LatticeNodes>(Coarser(*fine.nodes));
    if (n <= kFewNodes || 2 * coarse->count() > n) break;
    for (const glm::ivec3& p : fine.nodes->place) fine.parents.push_back(ParentsOf(*coarse, p));
    LatticeMatrix product(static_cast<size_t>(coarse->count()) * LatticeNodes::kBeside, 0.0);
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < LatticeNodes::kBeside; ++k) {
        const size_t at = static_cast<size_t>(i) * LatticeNodes::kBeside + k;
        const int j = fine.nodes->beside[at];
        if (fine.matrix[at] == 0) continue;
        const Parents &of_i = fine.parents[i], &of_j = fine.parents[j];
        for (int a = 0; a < of_i.count; ++a)
          for (int b = 0; b < of_j.count; ++b) {
            const glm::ivec3 d = coarse->place[of_j.node[b]] - coarse->place[of_i.node[a]] + 1;
            product[static_cast<size_t>(of_i.node[a]) * LatticeNodes::kBeside + d.x + 3 * d.y + 9 * d.z] +=
                of_i.weight[a] * fine.matrix[at] * of_j.weight[b];
          }
      }
    const LatticeNodes* kept = coarse.get();
    levels_.push_back({kept, std::move(coarse), std::move(product), {}, {}});
  }
  Level& last = levels_.back();
  const int n = last.nodes->count();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < LatticeNodes::kBeside; ++k) {
      const size_t at = static_cast<size_t>(i) * LatticeNodes::kBeside + k;
      dense(i, last.nodes->beside[at]) += last.matrix[at];
    }
  last.inverse = InverseOfSymmetric(dense);
}

LatticeSolver::~LatticeSolver() = default;
LatticeSolver::LatticeSolver(LatticeSolver&&) noexcept = default;

void LatticeSolver::Cycle(size_t l, const std::vector<double>& b, std::vector<double>& x) const {
  const Level& level = levels_[l];
  const int n = level.nodes->count();
  x.assign(n, 0.0);
  if (l + 1 == levels_.size()) {
    Eigen::Map<Eigen::VectorXd>(x.data(), n) = level.inverse * Eigen::Map<const Eigen::VectorXd>(b.data(), n);
    return;
  }
  level.Sweep(b, x, true);
  std::vector<double> left(n), coarse(levels_[l + 1].nodes->count(), 0.0), correction;
  Multiply(*level.nodes, level.matrix, x, left);
  for (int i = 0; i < n; ++i) {
    const Parents& p = level.parents[i];
    for (int k = 0; k < p.count; ++k) coarse[p.node[k]] += p.weight[k] * (b[i] - left[i]);
  }
  Cycle(l + 1, coarse, correction);
  for (int i = 0; i < n; ++i) {
    const Parents& p = level.parents[i];
    for (int k = 0; k < p.count; ++k) x[i] += p.weight[k] * correction[p.node[k]];
  }
  level.Sweep(b, x, false);
}

int LatticeSolver::Solve(std::span<const double> b, std::vector<double>& x, double tolerance) const {
  constexpr int kMost = 100;
  const Level& finest = levels_[0];
  const size_t n = static_cast<size_t>(finest.nodes->count());
  x.resize(n, 0.0);
  std::vector<double> left(n), direction, product(n), conditioned;
  Multiply(*finest.nodes, finest.matrix, x, left);
  for (size_t i = 0; i < n; ++i) left[i] = b[i] - left[i];
  const double enough = tolerance * std::sqrt(Dot(b, b));
  double along = 0;
  for (int iteration = 0; iteration < kMost; ++iteration) {
    if (std::sqrt(Dot(left, left)) <= enough) return iteration;
    Cycle(0, left, conditioned);
    const double now = Dot(left, conditioned);
    if (iteration == 0)
      direction = conditioned;
    else
      for (size_t i = 0; i < n; ++i) direction[i] = conditioned[i] + now / along * direction[i];
    along = now;
    Multiply(*finest.nodes, finest.matrix, direction, product);
    const double step = along / Dot(direction, product);
    for (size_t i = 0; i < n; ++i) x[i] += step * direction[i], left[i] -= step * product[i];
  }
  return kMost;
}

}  // namespace crownfit
