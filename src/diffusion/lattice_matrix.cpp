#include "diffusion/lattice_matrix.h"

#include <algorithm>

#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr int kFewNodes = 400;  // largest number of nodes of the coarsest lattice, which is solved directly

/// Values of several right-hand sides at one node, and at all nodes.
template <size_t N>
using Values = std::array<double, N>;
template <size_t N>
using Columns = std::vector<Values<N>>;

template <size_t N>
Values<N> Dot(const Columns<N>& a, const Columns<N>& b) {
  Values<N> sum{};
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t k = 0; k < N; ++k) sum[k] += a[i][k] * b[i][k];
  return sum;
}

/// Product of one matrix row with the neighbours' values.
template <size_t N>
Values<N> RowTimes(const double* row, const int* beside, const Values<N>* x) {
  Values<N> sum{};
  for (int k = 0; k < LatticeNodes::kBeside; ++k) {
    const Values<N>& there = x[beside[k]];
    for (size_t n = 0; n < N; ++n) sum[n] += row[k] * there[n];
  }
  return sum;
}

template <size_t N>
void MultiplyColumns(const LatticeNodes& nodes, const LatticeMatrix& m, const Values<N>* x, Values<N>* y) {
  for (size_t i = 0; i < nodes.place.size(); ++i)
    y[i] = RowTimes<N>(&m[i * LatticeNodes::kBeside], &nodes.beside[i * LatticeNodes::kBeside], x);
}

/// The coarse nodes that interpolate a fine node, and their weights.
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

/// Every second node of each row, where a fine node in use needs it.
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
  for (size_t at = 0, i = 0; i < nodes.place.size(); ++i) {
    y[i] = 0;
    for (int k = 0; k < LatticeNodes::kBeside; ++k, ++at) y[i] += m[at] * x[nodes.beside[at]];
  }
}

struct LatticeSolver::Level {
  const LatticeNodes* nodes;
  std::unique_ptr<LatticeNodes> owned;  ///< the nodes of all levels but the finest
  LatticeMatrix matrix;
  std::vector<Parents> parents;  ///< of every node, in the next level; empty in the coarsest level
  Eigen::MatrixXd inverse;       ///< of the coarsest level's matrix

  template <size_t N>
  void Sweep(const Columns<N>& b, Columns<N>& x, bool forward) const {
    const size_t n = nodes->place.size();
    for (size_t step = 0; step < n; ++step) {
      const size_t i = forward ? step : n - 1 - step, first = i * LatticeNodes::kBeside;
      const Values<N> there = RowTimes<N>(&matrix[first], &nodes->beside[first], x.data());
      for (size_t k = 0; k < N; ++k) x[i][k] += (b[i][k] - there[k]) / matrix[first + LatticeNodes::kSelf];
    }
  }

  /// Multigrid cycle: approximates x = inverse times b with this level and the coarser ones.
  template <size_t N>
  static void Cycle(std::span<const Level> levels, const Columns<N>& b, Columns<N>& x) {
    const Level& level = levels[0];
    const size_t n = level.nodes->place.size();
    x.assign(n, Values<N>{});
    if (levels.size() == 1) {
      using Rows =
          Eigen::Matrix<double, Eigen::Dynamic, static_cast<int>(N), N == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
      const auto rows = static_cast<Eigen::Index>(n);
      Eigen::Map<Rows>(x[0].data(), rows, N) = level.inverse * Eigen::Map<const Rows>(b[0].data(), rows, N);
      return;
    }
    level.Sweep(b, x, true);
    Columns<N> left(n), coarse(levels[1].nodes->place.size(), Values<N>{}), correction;
    MultiplyColumns<N>(*level.nodes, level.matrix, x.data(), left.data());
    for (size_t i = 0; i < n; ++i) {
      const Parents& p = level.parents[i];
      for (int a = 0; a < p.count; ++a)
        for (size_t k = 0; k < N; ++k) coarse[p.node[a]][k] += p.weight[a] * (b[i][k] - left[i][k]);
    }
    Cycle(levels.subspan(1), coarse, correction);
    for (size_t i = 0; i < n; ++i) {
      const Parents& p = level.parents[i];
      for (int a = 0; a < p.count; ++a)
        for (size_t k = 0; k < N; ++k) x[i][k] += p.weight[a] * correction[p.node[a]][k];
    }
    level.Sweep(b, x, false);
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

template <size_t N>
int LatticeSolver::SolveTogether(std::span<const std::vector<double>> b, std::span<std::vector<double>> x,
                                 double tolerance) const {
  constexpr int kMost = 100;
  const Level& finest = levels_[0];
  const size_t n = finest.nodes->place.size();
  Columns<N> at(n), left(n), direction(n, Values<N>{}), product(n), conditioned;
  Values<N> size{}, along{};
  for (size_t k = 0; k < N; ++k) {
    x[k].resize(n, 0.0);
    for (size_t i = 0; i < n; ++i) at[i][k] = x[k][i], size[k] += b[k][i] * b[k][i];
  }
  MultiplyColumns<N>(*finest.nodes, finest.matrix, at.data(), left.data());
  for (size_t k = 0; k < N; ++k)
    for (size_t i = 0; i < n; ++i) left[i][k] = b[k][i] - left[i][k];
  int iteration = 0;
  for (; iteration < kMost; ++iteration) {
    const Values<N> rest = Dot<N>(left, left);
    bool is_enough = true;
    for (size_t k = 0; k < N; ++k) is_enough = is_enough && rest[k] <= tolerance * tolerance * size[k];
    if (is_enough) break;
    Level::Cycle<N>(levels_, left, conditioned);
    const Values<N> now = Dot<N>(left, conditioned);
    Values<N> turn{}, step{};
    for (size_t k = 0; k < N; ++k) turn[k] = along[k] > 0 ? now[k] / along[k] : 0.0;
    for (size_t i = 0; i < n; ++i)
      for (size_t k = 0; k < N; ++k) direction[i][k] = conditioned[i][k] + turn[k] * direction[i][k];
    along = now;
    MultiplyColumns<N>(*finest.nodes, finest.matrix, direction.data(), product.data());
    const Values<N> curve = Dot<N>(direction, product);
    for (size_t k = 0; k < N; ++k) step[k] = curve[k] > 0 ? along[k] / curve[k] : 0.0;
    for (size_t i = 0; i < n; ++i)
      for (size_t k = 0; k < N; ++k) at[i][k] += step[k] * direction[i][k], left[i][k] -= step[k] * product[i][k];
  }
  for (size_t k = 0; k < N; ++k)
    for (size_t i = 0; i < n; ++i) x[k][i] = at[i][k];
  return iteration;
}

int LatticeSolver::Solve(std::span<const std::vector<double>> b, std::span<std::vector<double>> x,
                         double tolerance) const {
  int iterations = 0;
  for (size_t first = 0, n = 0; first < b.size(); first += n) {
    n = b.size() - first >= 4 ? 4 : b.size() - first >= 2 ? 2 : 1;
    const auto of_b = b.subspan(first, n);
    const auto of_x = x.subspan(first, n);
    iterations = std::max(iterations, n == 4   ? SolveTogether<4>(of_b, of_x, tolerance)
                                      : n == 2 ? SolveTogether<2>(of_b, of_x, tolerance)
                                               : SolveTogether<1>(of_b, of_x, tolerance));
  }
  return iterations;
}

}  // namespace crownfit
