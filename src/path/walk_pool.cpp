#include "path/walk_pool.h"

#include "base/error.h"
#include "path/collision_lanes.h"

namespace crownfit {
namespace {

class Pool {
 public:
  Pool(const PathContext& context, const TriangleGrid& grid, size_t count, int lanes,
       const std::function<PathStart(size_t)>& start, const std::function<void(size_t, const CameraPath&)>& ended,
       WalkCounters& counters)
      : context_(context), grid_(grid), start_(start), hand_over_(ended), counters_(counters), count_(count) {
    if (context.uncollided) collisions_.emplace(context);
    paths_.reserve(lanes);
    for (int i = 0; i < lanes; ++i) {
      paths_.emplace_back(context, counters);
      slot_[i] = i;
      if (!Refill(i)) break;
      ++active_;
    }
  }

  void Trace() {
    while (active_ > 0) {
      lanes_.Fly(grid_, active_);
      counters_.flights += active_;
      FlyPastFacets();
      if (collisions_) collisions_->Score(lanes_, active_, [&](int lane) -> CameraPath& { return PathOf(lane); });
      lanes_.Scatter(active_);
      if (context_.wants_derivatives) lanes_.ScorePhase(active_);
      for (int i = 0; i < active_; ++i)
        if (lanes_.until_roulette[i] <= 0.0 && !ended_[i]) EndOfCount(i);
      for (int i = active_ - 1; i >= 0; --i)
        if (ended_[i] && !Refill(i)) MoveLane(--active_, i);
    }
  }

 private:
  CameraPath& PathOf(int lane) { return paths_[slot_[lane]]; }

  /// Starts the next path that enters the object; false when there is none.
  bool Refill(int lane) {
    CameraPath& path = PathOf(lane);
    while (next_ < count_) {
      const size_t task = next_++;
      const PathStart s = start_(task);
      task_[slot_[lane]] = task;
      if (path.Begin(s.position, s.direction, s.hero, s.random)) {
        lanes_.until_roulette[lane] = CollisionsToGo(path.state);
        Load(lane);
        return true;
      }
      hand_over_(task, path);
    }
    return false;
  }

  /// Finds the ends of flights that might meet something.
  void FlyPastFacets() {
    size_t asking = 0;
    for (int i = 0; i < active_; ++i) {
      ended_[i] = false;
      if (lanes_.collides[i] != 0.0) continue;
      asking_[asking] = i;
      flights_[asking++] = {{lanes_.x[i], lanes_.y[i], lanes_.z[i]},
                            {lanes_.dx[i], lanes_.dy[i], lanes_.dz[i]},
                            medium_[i],
                            scatters_[i] ? lanes_.flight_mm[i] : kFar};
    }
    counters_.searches += asking;
    grid_.FindEnds({flights_.data(), asking});
    for (size_t k = 0; k < asking; ++k) EndFlight(asking_[k], flights_[k]);
  }

  void EndFlight(int lane, const FacetFlight& flight) {
    const double way_mm = std::min(flight.distance_mm, flight.max_mm);
    if (std::isinf(way_mm)) {  // clear medium without an end: rounding let the walk pass between two facets
      ++counters_.lost;
      return EndBranch(lane);
    }
    if (const AbsorptionTexture* texture = context_.media[flight.medium].texture)
      PathOf(lane).state.textured_mm[flight.medium] += texture->Along(flight.origin, flight.direction, way_mm);
    lanes_.length_mm[lane] += way_mm;
    const glm::dvec3 to = flight.origin + way_mm * flight.direction;
    lanes_.x[lane] = to.x, lanes_.y[lane] = to.y, lanes_.z[lane] = to.z;
    if (!flight.is_ended()) {
      lanes_.collides[lane] = 1.0;
      return;
    }
    ++counters_.boundaries;
    Store(lane);
    if (!SurvivesBoundary(PathOf(lane).state, PathOf(lane).random())) return EndBranch(lane);
    if (!PathOf(lane).Meet(context_.scene.EndOf(flight))) return EndBranch(lane);
    Load(lane);
  }

  /// Collisions until the roulette, or until the walk switches to the reduced coefficient or to diffusion.
  double CollisionsToGo(const WalkState& state) const {
    if (!context_.hand_over.fields) return kRouletteEvery;
    return std::clamp(context_.hand_over.collisions - state.collisions, 1, kRouletteEvery);
  }

  void EndOfCount(int lane) {
    CameraPath& path = PathOf(lane);
    const bool was_last = context_.IsReduced(path.state);
    Store(lane);
    if (!context_.scene.Holds(path.state.position)) {
      ++counters_.lost;
      return EndBranch(lane);
    }
    if (was_last) {
      path.HandOver();
      return EndBranch(lane);
    }
    if (!SurvivesRoulette(context_.media, path.state, path.random())) return EndBranch(lane);
    lanes_.until_roulette[lane] = CollisionsToGo(path.state);
    Load(lane);
  }

  void EndBranch(int lane) {
    if (PathOf(lane).Resume()) {
      lanes_.until_roulette[lane] = CollisionsToGo(PathOf(lane).state);
      return Load(lane);
    }
    hand_over_(task_[slot_[lane]], PathOf(lane));
    lanes_.collides[lane] = 0.0;
    ended_[lane] = true;
  }

  void Load(int i) {
    CameraPath& path = PathOf(i);
    const WalkState& state = path.state;
    const Medium& medium = context_.media[state.medium];
    const double scattering = medium.scattering[path.hero()] * (context_.IsReduced(state) ? medium.similarity() : 1.0);
    lanes_.x[i] = state.position.x, lanes_.y[i] = state.position.y, lanes_.z[i] = state.position.z;
    lanes_.dx[i] = state.direction.x, lanes_.dy[i] = state.direction.y, lanes_.dz[i] = state.direction.z;
    lanes_.random[i] = path.random().state();
    lanes_.random_step[i] = path.random().step();
    lanes_.free_path_mm[i] = scattering > 0 ? 1.0 / scattering : 1.0;
    medium_[i] = state.medium;
    scatters_[i] = scattering > 0;
    lanes_.needs_search[i] = scattering > 0 && !medium.texture ? 0.0 : 1.0;
    lanes_.g[i] = medium.g;
    lanes_.isotropic_fraction[i] = medium.isotropic_fraction;
    lanes_.length_mm[i] = lanes_.collisions[i] = lanes_.phase_score[i] = 0.0;
    if (collisions_) collisions_->Open(i, path);
    if (context_.wants_derivatives) path.OpenStretch();
  }
  void Store(int i) {
    CameraPath& path = PathOf(i);
    WalkState& state = path.state;
    state.position = {lanes_.x[i], lanes_.y[i], lanes_.z[i]};
    state.direction = {lanes_.dx[i], lanes_.dy[i], lanes_.dz[i]};
    path.random().set_state(lanes_.random[i]);
    Visit& visit = state.visits[state.medium];
    const int collisions = static_cast<int>(lanes_.collisions[i]);
    visit.length_mm += lanes_.length_mm[i];
    visit.collisions += collisions;
    if (context_.IsReduced(state)) {  // the direction after its last collision is not needed
      visit.reduced_mm += lanes_.length_mm[i];
      visit.reduced_collisions += collisions;
    } else {
      visit.phase_score += lanes_.phase_score[i];
    }
    state.collisions += collisions;
    lanes_.length_mm[i] = lanes_.collisions[i] = lanes_.phase_score[i] = 0.0;
    if (context_.wants_derivatives) path.CloseStretch();
  }
  void MoveLane(int from, int to) {
    if (from == to) return;
    lanes_.Copy(from, to);
    if (collisions_) collisions_->Move(from, to);
    std::swap(slot_[from], slot_[to]);
    ended_[to] = ended_[from];
    scatters_[to] = scatters_[from];
    medium_[to] = medium_[from];
  }

  const PathContext& context_;
  const TriangleGrid& grid_;
  const std::function<PathStart(size_t)>& start_;
  const std::function<void(size_t, const CameraPath&)>& hand_over_;
  WalkCounters& counters_;
  size_t count_;
  FlightLanes lanes_{};
  std::optional<CollisionLanes> collisions_{};  ///< of walks that find lamps at collisions
  std::vector<CameraPath> paths_;
  std::array<int, FlightLanes::kMax> slot_{}, medium_{};
  std::array<size_t, FlightLanes::kMax> task_{};
  std::array<int, FlightLanes::kMax> asking_{};           ///< lanes whose flights might meet something ...
  std::array<FacetFlight, FlightLanes::kMax> flights_{};  ///< ... and those flights
  std::array<bool, FlightLanes::kMax> ended_{}, scatters_{};
  int active_ = 0;
  size_t next_ = 0;
};

void TraceOneByOne(const PathContext& context, size_t count, const std::function<PathStart(size_t)>& start,
                   const std::function<void(size_t, const CameraPath&)>& ended, WalkCounters& counters) {
  struct Rays {
    const WalkScene& scene;
    auto Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm) const {
      return scene.NextByRay(origin, direction, medium, max_mm);
    }
    bool Holds(const glm::dvec3& p) const { return scene.Holds(p); }
  } const rays{context.scene};
  CameraPath path(context, counters);
  for (size_t i = 0; i < count; ++i) {
    const PathStart s = start(i);
    for (bool is_inside = path.Begin(s.position, s.direction, s.hero, s.random); is_inside; is_inside = path.Resume())
      Walk(
          rays, context.media, s.hero, path.state, path.random(), counters, [&](const Boundary& b) { path.Meet(b); },
          [](int medium) { return medium == kOutside; });
    ended(i, path);
  }
}

}  // namespace

void TracePaths(const PathContext& context, const TriangleGrid& grid, size_t count, int lanes,
                const std::function<PathStart(size_t)>& start,
                const std::function<void(size_t, const CameraPath&)>& ended, WalkCounters& counters) {
  Check(lanes > 0 || !(context.hand_over.fields || context.uncollided),
        "walks that are handed over or find lamps at collisions need lanes");
  if (lanes <= 0) return TraceOneByOne(context, count, start, ended, counters);
  Pool(context, grid, count, std::min(lanes, FlightLanes::kMax), start, ended, counters).Trace();
}

}  // namespace crownfit
