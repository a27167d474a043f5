#include "walk/walk_pool.h"

namespace crownfit {
namespace {

class Pool {
 public:
  Pool(const Studio& studio, const Clearance& clearance, size_t count, int lanes,
       const std::function<PathStart(size_t)>& start, WalkCounters& counters)
      : studio_(studio), clearance_(clearance), start_(start), counters_(counters), values_(count) {
    paths_.reserve(lanes);
    for (int i = 0; i < lanes; ++i) {
      paths_.emplace_back(studio, counters);
      slot_[i] = i;
      if (!Refill(i)) break;
      ++active_;
    }
  }

  std::vector<glm::dvec3> Trace() {
    while (active_ > 0) {
      lanes_.Fly(clearance_, active_);
      counters_.flights += active_;
      FlyByRay();
      lanes_.Scatter(active_);
      for (int i = 0; i < active_; ++i)
        if (lanes_.until_roulette[i] <= 0.0 && !ended_[i]) PlayRoulette(i);
      for (int i = active_ - 1; i >= 0; --i)
        if (ended_[i] && !Refill(i)) MoveLane(--active_, i);
    }
    return std::move(values_);
  }

 private:
  CameraPath& PathOf(int lane) { return paths_[slot_[lane]]; }

  /// Starts the next path that goes inside; false when there is none.
  bool Refill(int lane) {
    CameraPath& path = PathOf(lane);
    while (next_ < values_.size()) {
      const size_t task = next_++;
      const PathStart s = start_(task);
      task_[slot_[lane]] = task;
      if (path.Begin(s.position, s.direction, s.hero, s.random)) {
        lanes_.until_roulette[lane] = kRouletteEvery;
        Load(lane);
        return true;
      }
      values_[task] = path.value();
    }
    return false;
  }

  /// Flights that might meet something.
  void FlyByRay() {
    asking_.clear();
    flights_.clear();
    media_.clear();
    for (int i = 0; i < active_; ++i) {
      ended_[i] = false;
      if (lanes_.collides[i] != 0.0) continue;
      Store(i);
      const CameraPath& path = PathOf(i);
      const bool scatters = studio_.media[path.state.medium].scattering[path.hero()] > 0;
      asking_.push_back(i);
      media_.push_back(path.state.medium);
      flights_.push_back({path.state.position, path.state.direction, scatters ? lanes_.flight_mm[i] : kFar});
    }
    boundaries_.resize(asking_.size());
    studio_.scene.NextOfMany(flights_, media_, boundaries_);
    for (size_t k = 0; k < asking_.size(); ++k) EndFlight(asking_[k], flights_[k].max_mm, boundaries_[k]);
  }

  void EndFlight(int lane, double flight_mm, const std::optional<Boundary>& boundary) {
    CameraPath& path = PathOf(lane);
    WalkState& state = path.state;
    const Medium& medium = studio_.media[state.medium];
    Visit& visit = state.visits[state.medium];
    const double way_mm = boundary ? boundary->distance_mm : flight_mm;
    if (std::isinf(way_mm)) {  // a clear medium without an end: rounding let the walk through between two facets
      ++counters_.lost;
      return End(lane);
    }
    visit.length_mm += way_mm;
    if (medium.texture) visit.textured_mm += medium.texture->Along(state.position, state.direction, way_mm);
    if (boundary) {
      state.position = boundary->position;
      ++counters_.boundaries;
      if (!path.Meet(*boundary)) return End(lane);
    } else {
      state.position += way_mm * state.direction;
      lanes_.collides[lane] = 1.0;
    }
    Load(lane);
  }

  void PlayRoulette(int lane) {
    lanes_.until_roulette[lane] = kRouletteEvery;
    CameraPath& path = PathOf(lane);
    Store(lane);
    if (!studio_.scene.Holds(path.state.position)) {
      ++counters_.lost;
      return End(lane);
    }
    if (!SurvivesRoulette(studio_.media, path.state, path.random())) return End(lane);
    Load(lane);
  }

  void End(int lane) {
    values_[task_[slot_[lane]]] = PathOf(lane).value();
    lanes_.collides[lane] = 0.0;
    ended_[lane] = true;
  }

  void Load(int i) {
    CameraPath& path = PathOf(i);
    const WalkState& state = path.state;
    const Medium& medium = studio_.media[state.medium];
    const double scattering = medium.scattering[path.hero()];
    lanes_.x[i] = state.position.x, lanes_.y[i] = state.position.y, lanes_.z[i] = state.position.z;
    lanes_.dx[i] = state.direction.x, lanes_.dy[i] = state.direction.y, lanes_.dz[i] = state.direction.z;
    lanes_.random[i] = path.random().state();
    lanes_.random_step[i] = path.random().step();
    lanes_.free_path_mm[i] = scattering > 0 ? 1.0 / scattering : 1.0;
    lanes_.needs_every_ray[i] = scattering > 0 && !medium.texture ? 0.0 : 1.0;
    lanes_.g[i] = medium.g;
    lanes_.isotropic_fraction[i] = medium.isotropic_fraction;
    lanes_.length_mm[i] = 0.0;
    lanes_.collisions[i] = 0.0;
  }
  void Store(int i) {
    CameraPath& path = PathOf(i);
    WalkState& state = path.state;
    state.position = {lanes_.x[i], lanes_.y[i], lanes_.z[i]};
    state.direction = {lanes_.dx[i], lanes_.dy[i], lanes_.dz[i]};
    path.random().set_state(lanes_.random[i]);
    state.visits[state.medium].length_mm += lanes_.length_mm[i];
    state.visits[state.medium].collisions += static_cast<int>(lanes_.collisions[i]);
    lanes_.length_mm[i] = lanes_.collisions[i] = 0.0;
  }
  void MoveLane(int from, int to) {
    if (from == to) return;
    lanes_.Copy(from, to);
    std::swap(slot_[from], slot_[to]);
    ended_[to] = ended_[from];
  }

  const Studio& studio_;
  const Clearance& clearance_;
  const std::function<PathStart(size_t)>& start_;
  WalkCounters& counters_;
  std::vector<glm::dvec3> values_;
  FlightLanes lanes_{};
  std::vector<CameraPath> paths_;
  std::array<int, FlightLanes::kMax> slot_{};
  std::array<size_t, FlightLanes::kMax> task_{};
  std::array<bool, FlightLanes::kMax> ended_{};
  std::vector<int> asking_, media_;  ///< lanes whose flights need a ray
  std::vector<Ray> flights_;
  std::vector<std::optional<Boundary>> boundaries_;
  int active_ = 0;
  size_t next_ = 0;
};

}  // namespace

std::vector<glm::dvec3> TracePaths(const Studio& studio, const Clearance& clearance, size_t count, int lanes,
                                   const std::function<PathStart(size_t)>& start, WalkCounters& counters) {
  return Pool(studio, clearance, count, std::min(lanes, FlightLanes::kMax), start, counters).Trace();
}

}  // namespace crownfit
