#include "plan/fit_seconds.h"

#include <algorithm>

#include "capture/calibration_error.h"
#include "capture/capture.h"
#include "capture/light_rig.h"
#include "fit/calibration_derivatives.h"
#include "fit/choose_pixels.h"
#include "fit/fit_shader.h"
#include "fit_path/gather_walks.h"
#include "fit_path/walk_schedule.h"
#include "path/path_derivatives.h"
#include "scene/build_crown.h"

namespace crownfit {
namespace {

constexpr double kCores = 2;

// Of one core.
constexpr double kOfShare = 0.4e-6, kOfVertex = 13e-6;
constexpr double kOfWalk = 12e-6, kOfScoring = 4e-6;    // to its end; a photograph's lamps at its collisions
constexpr double kOfHandedWalk = 5e-6;                  // until it is handed over; twice that with derivatives
constexpr double kOfCells = 0.5;                        // of a picture, with the rays of light that fills them
constexpr double kOfNode = 5e-6, kOfNodeSlopes = 9e-6;  // a photograph's
constexpr double kOfRay = 2e-6, kOfCollision = 0.2e-6;  // a lamp's
constexpr double kSlopes = 2.5;                         // times a ray without
constexpr double kOfBody = 1.0;                         // whose thickness was moved, with its lattice

bool IsDifferenced(const FreeEntry& e) {
  return e.quantity == Quantity::kThickness || e.quantity == Quantity::kThicknessScale || e.quantity == Quantity::kIor;
}

CastSeconds CastOf(const Capture& capture, const FitState& at, double vertices) {
  const std::vector<CalibrationError> errors = StatedErrors(capture);
  constexpr double kRaysOfMoved = 2 * kStrataOfMoved * kStrataOfMoved;  // to either side
  double rays = 0, of_slopes = 0;
  for (const FitPixels& p : at.pixels) {
    const PhotographSpec& spec = capture.photographs[p.photograph];
    const CastOptions strata;
    for (const size_t light : spec.lights) {
      const int times = IsAllAround(capture.lights[light].shape) ? 4 : 1;
      rays += strata.strata * strata.strata * times;
      for (const CalibrationError& e : errors) of_slopes += e.light == light ? kRaysOfMoved * times : 0;
    }
    if (spec.backing || !spec.scenery.empty()) rays += strata.gather_strata * strata.gather_strata;
  }
  return {vertices * rays * kOfShare, vertices * of_slopes * kOfShare};
}

/// Vertices of Crown::fine in a fit. The cast may be coarser, or hold a root besides.
double FineVertices(const FitState& at) {
  const TriangleMesh& outer = at.cast.crown->surfaces[0];
  const size_t refined = Refined(outer, FineEdge_mm(outer, CrownDetail().fine_triangles)).vertices.size();
  return static_cast<double>(std::max(refined, at.cast.crown->fine.vertices.size()));
}

}  // namespace

void FitSeconds::Count(const Capture& capture, const FitState& at) {
  cast_ = CastOf(capture, at, vertices_);
  shared_.clear();
  std::vector<size_t> photographs;
  for (const FitPixels& p : at.pixels) photographs.push_back(p.photograph);
  for (const std::vector<size_t>& together : WhichShareWalks(capture, photographs)) {
    Shared& s = shared_.emplace_back();
    for (const size_t k : together) {
      s.photographs += 1.0;
      s.lamps += static_cast<double>(capture.photographs[photographs[k]].lights.size());
      const double sharp = coarse_.Merged(photographs[k]) * static_cast<double>(at.pixels[k].sources.size());
      const bool is_blurred = capture.photographs[photographs[k]].blur.has_value();
      s.pixels = std::max(s.pixels, is_blurred ? sharp : std::min(sharp, static_cast<double>(most_pixels_)));
    }
  }
}

FitSeconds FitSeconds::Of(const Capture& capture, const FitState& at) const {
  FitSeconds other = *this;
  other.Count(capture, at);
  return other;
}

FitSeconds::FitSeconds(const FitProblem& problem, const FitState& at, const Coarseness& coarse)
    : coarse_(coarse), vertices_(FineVertices(at)), most_pixels_(problem.options.max_pixels_by_walks()) {
  Count(problem.capture, at);
  const std::vector<FreeEntry>& entries = problem.free.entries;
  const auto any = [&](const auto& is) { return std::any_of(entries.begin(), entries.end(), is); };
  // A free depth is sought from five places.
  const bool has_depth = any([](const FreeEntry& e) { return e.quantity == Quantity::kThickness && !e.moves_surface; });
  steps_of_shader_ = (has_depth ? 150.0 : 30.0) * vertices_ * static_cast<double>(at.pixels.size());
  if (KeepsALaw(problem.capture)) steps_of_shader_ *= 1.3;  // which is asked about at the end
  pictures_beside_ = 2.0 * static_cast<double>(std::count_if(entries.begin(), entries.end(), IsDifferenced));
  has_rough_ = any([](const FreeEntry& e) { return e.quantity == Quantity::kRoughness; });

  const Material material = MaterialAt(problem.free, at.x);
  fewest_ = FewestPaths(material);
  collisions_that_tell_ = CollisionsThatTell(material);
  const std::vector<TriangleMesh>& surfaces = at.cast.crown->surfaces;
  nodes_ = VolumeLattice::NodesFor(surfaces[0], ElementFor(surfaces, material, 0.0));
  nodes_of_search_ = VolumeLattice::NodesFor(surfaces[0], ElementFor(surfaces, material, kShortestOfSearch));
}

double FitSeconds::ByShader() const {
  constexpr int kWithoutErrors = 2;
  const double casts = cast_.derivatives > 0 ? kMostCasts : kWithoutErrors;
  return (casts * (cast_.values + cast_.derivatives) + steps_of_shader_ * kOfVertex) / kCores;
}

double FitSeconds::Handed(const Shared& s, double nodes, const Picture& p) const {
  return kOfCells + p.paths * kOfHandedWalk * (p.has_derivatives ? 2.0 : 1.0) +
         s.photographs * nodes * (p.has_derivatives ? kOfNodeSlopes : kOfNode) +
         s.lamps * p.rays * (p.has_derivatives ? kSlopes : 1.0) * (kOfRay + kOfCollision * p.collisions);
}

double FitSeconds::Walked(const Shared& s, double paths) const {
  return kOfCells + std::max(paths, fewest_ * s.pixels) * (kOfWalk + kOfScoring * s.photographs);
}

double FitSeconds::Differentiated(const Shared& s, double nodes, double paths, double rays_of_a_path) const {
  const double walked = std::max(paths, kPathsOfAGroup * fewest_ * s.pixels), rays = rays_of_a_path * paths,
               beside = pictures_beside_ + (has_rough_ ? 2.0 : 0.0);
  return Handed(s, nodes, {walked, rays, collisions_that_tell_, true}) +
         beside * Handed(s, nodes, {walked, rays, collisions_that_tell_, false}) + pictures_beside_ * kOfBody;
}

double FitSeconds::ByWalks(double paths) const {
  // A free roughness is searched for from several places, a thickness sometimes from two.
  const double searches = has_rough_ ? 7 : pictures_beside_ > 0 ? 6 : 4, runs = 2;
  // The start by shader, and pixels for the search and for the runs.
  double seconds = 3.0 * cast_.values + 2.0 * cast_.derivatives + steps_of_shader_ * kOfVertex;
  for (const Shared& s : shared_) {
    Shared sought = s;
    sought.pixels = std::min(s.pixels, static_cast<double>(kSearch.pixels));
    seconds += searches * (Walked(sought, std::min(kSearch.values, paths)) +
                           Differentiated(sought, nodes_of_search_, std::min(kSearch.slopes, paths), kRaysOfSearch)) +
               Walked(s, paths) + runs * Differentiated(s, nodes_, std::min(kRun.slopes, paths), kRaysOfAPath);
  }
  return seconds / kCores;
}

}  // namespace crownfit
